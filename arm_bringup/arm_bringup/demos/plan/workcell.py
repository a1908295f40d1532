# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A table, obstacles and a part where an arm that nobody knows can pick and place.

Everything is found by inverse kinematics and planning on the model, and is a share of the reach.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
import contextlib
from dataclasses import dataclass, replace
from itertools import islice, product
import math

import numpy as np

from arm_model import (
    Array,
    AttachedBody,
    Box,
    CollisionObject,
    combined,
    frozen,
    inverse,
    PlanningScene,
    Pose,
    RobotModel,
    start_pose,
)
from arm_planning import MotionRequest, Planner, PlanningError, PoseGoal

from .boxes import box_ahead, is_free, plan_free
from .tool import about_z, GAP, Tool

TABLE, PILLAR, WALL = 'table', 'pillar', 'wall'
"""Names of what stands around the arm."""
HEIGHTS = (0.15, 0.25, 0.05, 0.35, 0.0)
"""Heights of the table above the arm's base, as shares of its reach."""
RADII = (0.55, 0.5, 0.6, 0.45, 0.7)
"""Distances of the part from the arm's first axis, as shares of its reach."""
SPREADS = (0.6, 0.45, 0.8)
"""Angles between the pillar and where the part is picked or placed in [rad]."""
TURNS = (0.0, math.pi / 2, -math.pi / 2, math.pi)
"""Turns of a tool that looks down, beside the direction away from the arm, in [rad]."""
APPROACH = 0.1
"""Length of the straight approach and retreat, as a share of the reach."""
SOLUTIONS = 4
"""Solutions of inverse kinematics that are tried for a pose."""
IK_TIMEOUT = 0.05
"""Longest time of one search in [s]."""
WAYS_ASIDE = (1.5, 1.2, 0.9, 2.0)
"""How far one joint goes aside in [rad]."""
PASSED, POINTS = 0.25, 40
"""Share of the time of a way after which a box appears, and points of that way."""
CANDIDATES = 400
"""How many layouts are tried."""
DOWN = frozen(np.diag([1.0, -1.0, -1.0]))
"""Half a turn about the x axis: what looked up looks down."""


@dataclass(frozen=True, slots=True, eq=False)
class Station:
    """Where the part is picked or placed; poses are those of the tip in the root link.

    Attributes:
        part: The part at rest.
        grasp: Where the tip takes it up.
        above: Where the straight approach begins.
        joints: Joint positions there in [rad].
    """

    part: CollisionObject
    grasp: Pose
    above: Pose
    joints: Array


@dataclass(frozen=True, slots=True, eq=False)
class Workcell:
    """Where an arm picks and places.

    Attributes:
        obstacles: What stands around it.
        stations: Where the part is, and where it goes.
        home: Joint positions in which the arm begins and ends in [rad].
        aside: Joint positions on whose way from there a box can appear.
    """

    obstacles: tuple[CollisionObject, ...]
    stations: tuple[Station, Station]
    home: Array
    aside: Array


@dataclass(frozen=True, slots=True, eq=False)
class _Search:
    """What stays the same while places are looked for."""

    arm: RobotModel
    tool: Tool
    home: Array
    planner: Planner


def find_workcell(model: RobotModel, tool: Tool) -> Workcell | None:
    """Return a workcell in which all motions were found on the model; None where there is none.

    Args:
        model: The arm.
        tool: What it takes the part up with.
    """
    if len(model) < 6:  # it cannot turn its tool down wherever it is
        return None
    arm = model.with_others({**model.kinematics.others, **tool.others})
    home = start_pose(arm)
    found = (
        _works(arm, tool, cell) for cell in islice(_layouts(arm, tool, home), CANDIDATES) if cell
    )
    return next((cell for cell in found if cell), None)


def _layouts(arm: RobotModel, tool: Tool, home: Array) -> Iterator[Workcell | None]:
    """Go through layouts; None stands for one in which a pose is out of reach."""
    tip = arm.pose(home).position
    ahead = math.atan2(tip[1], tip[0])
    search = _Search(arm, tool, home, Planner(arm))
    directions = [ahead + turn for turn in TURNS]
    for direction, spread, height, radius in product(directions, SPREADS, HEIGHTS, RADII):
        yield _layout(search, (direction, spread, height, radius))


def _layout(search: _Search, numbers: tuple[float, float, float, float]) -> Workcell | None:
    arm, home = search.arm, search.home
    direction, spread, height, radius = numbers
    reach = arm.reach
    top = height * reach
    obstacles = tuple(_obstacles(arm, direction, top, radius * reach))
    scene = arm.scene
    for each in obstacles:
        scene = scene.with_object(each)
    if search.planner.is_valid(home, scene) is not None:
        return None
    stations = []
    for angle in (direction + spread, direction - spread):
        station = _station(search, scene, (angle, top, radius * reach))
        if station is None:
            return None
        stations.append(station)
    first, second = stations
    return Workcell(obstacles, (first, second), home, home)


def _obstacles(
    arm: RobotModel, direction: float, top: float, radius: float
) -> Iterator[CollisionObject]:
    reach = arm.reach
    thickness, width, pillar, tall = 0.03 * reach, 1.3 * reach, 0.06 * reach, 0.3 * reach
    deep = 0.5 * reach
    yield CollisionObject(
        TABLE,
        Box(deep, width, thickness),
        pose=_around(arm, direction, radius + 0.05 * reach, top - thickness / 2),
    )
    yield CollisionObject(
        PILLAR,
        Box(pillar, pillar, tall),
        pose=_around(arm, direction, radius, top + tall / 2),
    )
    yield CollisionObject(
        WALL,
        Box(thickness, width, 2 * tall),
        pose=_around(arm, direction, radius + 0.05 * reach + deep / 2 + thickness, top + tall),
    )


def _around(arm: RobotModel, angle: float, radius: float, height: float) -> Pose:
    """Return a pose around the arm's base in the root link, turned away from it."""
    place = frozen([radius * math.cos(angle), radius * math.sin(angle), height])
    base = arm.kinematics.link_pose(arm.base, np.zeros(len(arm)))
    return combined(base, Pose(about_z(angle), place))


def _downwards(pose: Pose, turn: float) -> Pose:
    """Return a pose whose z axis points down, turned about that."""
    return Pose(frozen(pose.rotation @ about_z(turn) @ DOWN), pose.position)


def _lifted(pose: Pose, way: float) -> Pose:
    """Return a pose moved against its own z axis."""
    return Pose(pose.rotation, frozen(pose.position - way * pose.rotation[:, 2]))


def _station(
    search: _Search, scene: PlanningScene, place: tuple[float, float, float]
) -> Station | None:
    """Return where the part is at an angle, on a height, at a distance."""
    arm, tool, home, planner = search.arm, search.tool, search.home, search.planner
    angle, top, radius = place
    middle = _around(arm, angle, radius, top + GAP + tool.height / 2)
    for turn in TURNS:
        grasp = combined(_downwards(middle, turn), inverse(tool.part.pose))
        part = tool.part.at(combined(grasp, tool.part.pose))
        above = _lifted(grasp, APPROACH * arm.reach)
        with_part = scene.with_object(part)
        try:
            solutions = planner.ik(
                above, home, scene=with_part, timeout=IK_TIMEOUT, count=SOLUTIONS
            )
        except PlanningError:
            continue
        for joints in solutions:
            with contextlib.suppress(PlanningError):
                planner.plan(MotionRequest(joints, [PoseGoal(grasp)], 'LIN'), with_part)
                return Station(part, grasp, above, joints)
    return None


def _works(arm: RobotModel, tool: Tool, cell: Workcell) -> Workcell | None:
    """Return a workcell with a pose aside, where all free motions of it are found."""
    planner = Planner(arm)
    picked, placed = cell.stations
    empty = arm.scene
    for each in cell.obstacles:
        empty = empty.with_object(each)
    with_part = empty.with_object(picked.part)
    holding = empty.with_attached(AttachedBody(tool.part, arm.tip, frozenset(tool.links)))
    with_placed = empty.with_object(placed.part)
    motions: tuple[tuple[Array, Array, PlanningScene], ...] = (
        (cell.home, picked.joints, with_part),
        (picked.joints, placed.joints, holding),
        (placed.joints, cell.home, with_placed),
    )
    if is_free(holding, picked.joints, placed.joints):
        return None  # nothing to plan around
    if any(plan_free(planner, *motion) is None for motion in motions):
        return None
    aside = _aside(arm, planner, cell.home, with_placed)
    return None if aside is None else replace(cell, aside=aside)


def _aside(arm: RobotModel, planner: Planner, home: Array, scene: PlanningScene) -> Array | None:
    """Return joint positions on whose way a box can appear, and be gone around."""
    limits = arm.limits
    for turn, sign, joint in product(WAYS_ASIDE, (1.0, -1.0), range(len(arm))):
        end = np.array(home)
        end[joint] += sign * turn
        if not ((end >= limits.lower) & (end <= limits.upper)).all():
            continue
        plan = plan_free(planner, home, end, scene)
        if plan is None:
            continue
        times = np.linspace(PASSED, 1.0, POINTS) * plan.path.duration
        rows = [plan.path.at(time).position for time in times.tolist()]
        box = box_ahead(arm, scene, rows, 'box')
        if box is not None and plan_free(planner, rows[0], end, scene.with_object(box)):
            return frozen(end)
    return None


def by_joint(model: RobotModel, positions: Array) -> Mapping[str, float]:
    """Return positions by joint.

    Args:
        model: The arm.
        positions: In the order of its joints in [rad].
    """
    return dict(zip(model.joints, positions.tolist(), strict=True))
