# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Where the demo moves an arm that it does not know: a pose to start from, free ways to poses.

A square may be impossible where an arm starts from well: at the border of its reach, or in front
of a limit. So it is gone through on the model before, and another pose is chosen where it must be.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from arm_model import Array, ModelError, pose_quality, RobotModel, start_pose
from arm_trajectory import PathCheck

from .goals import beside

SPEED = 0.1
"""Greatest speed of the squares in [m/s]."""
SIDE = 0.08
"""Length of a side of a square in [m]."""
MAX_RUN_UP = 0.3
"""Greatest part of a side on which the joints may accelerate."""
SIDES = ((1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0))
"""Directions of the sides of a square."""
STEPS = 8
"""Steps in which a side is gone through on the model."""
SPEED_SHARE = 0.6
"""Share of a joint's speed that a square may need: what is left is for bends and corrections."""
OFF_LINE = 0.01
"""Share of the speed that may lead off a side on the model."""
MARGIN = 0.03
"""Share of a joint's range that a square keeps from its ends; of an endless one nothing."""
CLEARANCE, NEARER = 0.015, 0.001
"""Least distance of links on a square in [m], and how much nearer links may come that are near
each other where it begins."""
CANDIDATES, BEST = 400, 40
"""Poses that are drawn, and how many of them, the best first, are tried for a square."""
WAYS = (0.5, 0.25, 0.1)
"""How far joints go in a trajectory in [rad] or [m], the first that is free."""
VIAS = 100
"""Poses that are tried on the way to another one."""


def choose_start(model: RobotModel) -> Array:
    """Return a pose to start from, from which the squares are possible if there is one.

    Args:
        model: The arm.

    Raises:
        ModelError: No pose was found that is free and not singular.
    """
    first = start_pose(model)
    if square_fits(model, first):
        return first
    for pose in (*model.poses.values(), *_drawn(model)):
        if pose_quality(model, pose) > 0.0 and square_fits(model, pose):
            return pose
    return first


def square_fits(model: RobotModel, start: Array) -> bool:
    """Whether the tool can go along the squares in the base frame and in its own.

    Args:
        model: The arm.
        start: Joint positions in [rad].
    """
    return all(_fits(model, start, frame) for frame in (model.base, model.tip))


def can_go(model: RobotModel, start: Array, direction: Array) -> bool:
    """Whether the tool can be led along a direction from a pose.

    An arm of few joints cannot: its tool would leave the line, so that jogging does not move it.

    Args:
        model: The arm.
        start: Joint positions in [rad].
        direction: Of the tool, in the base frame.
    """
    jacobian = model.jacobian(start)
    twist = np.concatenate([direction, np.zeros(3)])
    shares = np.linalg.lstsq(jacobian * model.limits.velocity, twist, rcond=1e-3)[0]
    off = np.linalg.norm((jacobian @ (model.limits.velocity * shares) - twist)[:3])
    return bool(off <= OFF_LINE * np.linalg.norm(direction))


def square_speed(model: RobotModel, start: Array) -> float:
    """Return a speed for the squares that is reached early on each side in [m/s].

    A joint that moves r for each metre reaches its speed in r v/a + a/j.

    Args:
        model: The arm.
        start: Joint positions in [rad].
    """
    limits = model.limits
    scaled = np.linalg.pinv(model.jacobian(start) * limits.velocity, rcond=1e-3)[:, :3]
    axes = np.hstack(
        [model.pose(start, frame).rotation[:, :2] for frame in (model.base, model.tip)]
    )
    rates = limits.velocity * np.abs(scaled @ axes).max(axis=1)
    build_up, length = limits.acceleration / limits.jerk, MAX_RUN_UP * SIDE
    root = np.sqrt(build_up**2 + 4.0 * length * rates / limits.acceleration)
    return min(SPEED, float(np.min(2.0 * length / (build_up + root))))


def _fits(model: RobotModel, start: Array, frame: str) -> bool:
    limits, positions = model.limits, start.copy()
    least = min(CLEARANCE, model.clearance(start, CLEARANCE) - NEARER)
    margin = np.where(limits.continuous, 0.0, MARGIN * (limits.upper - limits.lower))
    for side in SIDES:
        velocity = SPEED * model.pose(positions, frame).rotation @ np.array(side, dtype=float)
        for _ in range(STEPS):
            jacobian = model.jacobian(positions)
            twist = np.concatenate([velocity, np.zeros(3)])
            shares = np.linalg.lstsq(jacobian * limits.velocity, twist, rcond=1e-3)[0]
            speeds = limits.velocity * shares
            off = np.linalg.norm((jacobian @ speeds - twist)[:3])
            positions = positions + speeds * (SIDE / SPEED) / STEPS
            inside = (positions >= limits.lower + margin) & (positions <= limits.upper - margin)
            slow = np.abs(shares) <= SPEED_SHARE
            if off > OFF_LINE * SPEED or not (inside & slow).all():
                return False
            if model.clearance(positions, CLEARANCE) < least:
                return False
    return True


def _drawn(model: RobotModel) -> list[Array]:
    """Return the best of some poses in the ranges, the best first."""
    poses = _draw(model)
    drawn = [next(poses) for _ in range(CANDIDATES)]
    qualities = [pose_quality(model, pose) for pose in drawn]
    order = np.argsort(qualities)[::-1][:BEST]
    return [drawn[number] for number in order]


def _draw(model: RobotModel) -> Iterator[Array]:
    """Draw poses, the same ones each time; no joint is turned by more than half a turn."""
    random = np.random.default_rng(0)
    lower = np.maximum(model.limits.lower, np.minimum(-np.pi, model.limits.upper - 2.0 * np.pi))
    upper = np.minimum(model.limits.upper, lower + 2.0 * np.pi)
    while True:
        yield random.uniform(lower, upper)


def is_free(model: RobotModel, begin: Array, end: Array) -> bool:
    """Whether no links meet on the straight way between two poses, as the controller judges it.

    Args:
        model: The arm.
        begin: Joint positions in [rad].
        end: The same.
    """
    check = PathCheck(model.scene)
    return check.contact(lambda times: begin + np.outer(times, end - begin), 1.0) is None


def free_way(model: RobotModel, begin: Array, end: Array) -> list[Array]:
    """Return the poses of a way: the end, or another one before it that leads around links.

    Args:
        model: The arm.
        begin: Joint positions in [rad].
        end: The same.
    """
    if is_free(model, begin, end):
        return [end]
    poses = _draw(model)
    for _ in range(VIAS):
        via = next(poses)
        if is_free(model, begin, via) and is_free(model, via, end):
            return [via, end]
    return [end]  # the controller says which links are in the way


def free_end(model: RobotModel, begin: Array) -> Array:
    """Return where a trajectory from a pose leads, free of collisions.

    Args:
        model: The arm.
        begin: Joint positions in [rad].

    Raises:
        ModelError: There is no such way.
    """
    for way in WAYS:
        end = beside(begin, model.limits, way)
        for target in (end, np.clip(2.0 * begin - end, model.limits.lower, model.limits.upper)):
            if (target != begin).any() and is_free(model, begin, target):
                return target
    raise ModelError(f'group {model.group}: links are in the way of all trajectories')
