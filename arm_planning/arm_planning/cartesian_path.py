# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Straight lines through way-points, as MoveIt's compute_cartesian_path has them.

Joint positions are found at places at most ``max_step`` apart, each next to those before. The path
ends in front of the first place that has none, that is in contact, or to which joints would jump;
the fraction says how far it goes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
import math

import numpy as np

from arm_model import (
    Array,
    checked,
    Clearances,
    frozen,
    JointLimits,
    Mask,
    PlanningScene,
    Pose,
    RobotModel,
)

from .curves import Line
from .exceptions import PlanningCode, PlanningError
from .ik.link_kinematics import LinkKinematics
from .ik.numeric import descend
from .ik.solver import check_pose

MIN_STEPS_FOR_JUMPS = 10
"""Steps of a path at least for which a jump is judged by the mean step, as in MoveIt."""

MAX_STEPS = 100_000  # places on a path at most
ROTATION_STEP = 0.05  # greatest rotation between two places in [rad], where the way says less


@dataclass(frozen=True, slots=True)
class JumpThresholds:
    """What counts as a jump of the joints between two places; 0 does not look."""

    relative: float = 0.0  # times the mean step of the path, in joint space
    revolute: float = 0.0  # greatest step of a joint that turns in [rad]
    prismatic: float = 0.0  # greatest step of a joint that slides in [m]

    def __post_init__(self) -> None:
        """Refuse thresholds that are none."""
        for name in ('relative', 'revolute', 'prismatic'):
            value = getattr(self, name)
            if not value >= 0.0:
                raise PlanningError(
                    PlanningCode.INVALID_GOAL_CONSTRAINTS,
                    f'{name} jump threshold is {value}; give 0, or more',
                )


@dataclass(frozen=True, slots=True, eq=False)
class CartesianPath:
    """Joint positions along way-points."""

    positions: Array  # joint positions in [rad] (k, n), the start among them
    fraction: float  # share of the way that they lead, from 0 to 1
    reason: str  # why they end there, in words; empty where they lead to the end


def cartesian_path(
    model: RobotModel,
    start: Sequence[float] | Array,
    waypoints: Sequence[Pose],
    max_step: float,
    *,
    link: str = '',
    jumps: JumpThresholds | None = None,
    scene: PlanningScene | None = None,
    is_valid: Callable[[Array], bool] | None = None,
) -> CartesianPath:
    """Return joint positions along straight lines through way-points.

    Args:
        waypoints: Poses of the link in the root link.
        max_step: Greatest way of the link between two places in [m].
        link: The link; empty for the tip.
        jumps: What counts as a jump; None does not look.
        scene: Where the arm must be free of contact; None does not look.
        is_valid: What else must hold at each place, such as path constraints.

    Raises:
        PlanningError: There is no way-point, no step, or no such link.
        CommandError: A number is not finite, or there are too few or too many.
    """
    here = checked(start, len(model), 'start')
    moved = LinkKinematics(model, link)
    clearances = None if scene is None else Clearances(scene)
    lines = _lines(moved, here, waypoints)
    counts = _counts(lines, max_step)
    poses = (
        line.at(number / count)
        for line, count in zip(lines, counts, strict=True)
        for number in range(1, count + 1)
    )
    rows, reason = [here], ''
    for pose in poses:
        row, reason = _step(moved, model.limits, pose, rows[-1])
        if not reason and clearances is not None:
            reason = _contact(clearances, row)
        if not reason and is_valid is not None and not is_valid(row):
            reason = 'a constraint is violated next to it'
        if reason:
            break
        rows.append(row)
    positions = np.array(rows)
    if jumps is not None:
        turning = model.kinematics.projected(moved.axes(here))[3:]
        slides = np.abs(turning).max(axis=0) == 0.0
        kept = _first_jump(positions, jumps, slides)
        if kept < len(positions):
            positions, reason = positions[:kept], _jump_reason(positions, kept, model.limits)
    total = sum(counts)
    fraction = 1.0 if total == 0 else (len(positions) - 1) / total
    if reason:
        reason = f'the path ends at {fraction:.1%}: {reason}'
    return CartesianPath(frozen(positions), fraction, reason)


def _step(
    link: LinkKinematics, limits: JointLimits, pose: Pose, before: Array
) -> tuple[Array, str]:
    """Return positions for a pose next to others, or why there are none."""
    end = descend(link, pose, before, limits.lower, limits.upper)
    if end.converged:
        return end.positions, ''
    way, turn = np.linalg.norm(end.error[:3]), np.linalg.norm(end.error[3:])
    return before, (
        f'no joint positions within the limits next to it; {1e3 * way:.1f} mm and'
        f' {turn:.3f} rad are left'
    )


def _contact(clearances: Clearances, positions: Array) -> str:
    contacts = clearances.contacts(positions)
    if not contacts:
        return ''
    first, second = contacts[0].bodies
    return f'{first} and {second} overlap by {1e3 * contacts[0].depth:.1f} mm next to it'


def _lines(link: LinkKinematics, start: Array, waypoints: Sequence[Pose]) -> list[Line]:
    if not waypoints:
        raise PlanningError(
            PlanningCode.INVALID_GOAL_CONSTRAINTS, 'no way-points; give one at least'
        )
    lines, begin = [], link.pose(start)
    for pose in waypoints:
        check_pose(pose)
        lines.append(Line(begin, pose))
        begin = pose
    return lines


def _counts(lines: Sequence[Line], max_step: float) -> list[int]:
    """Return the number of steps of each line."""
    if not max_step > 0.0:
        raise PlanningError(
            PlanningCode.INVALID_GOAL_CONSTRAINTS,
            f'max_step is {max_step} m; give a positive one, such as 0.01',
        )
    counts = [math.ceil(max(line.length / max_step, line.angle / ROTATION_STEP)) for line in lines]
    if sum(counts) > MAX_STEPS:
        raise PlanningError(
            PlanningCode.INVALID_GOAL_CONSTRAINTS,
            f'{sum(counts)} steps of {max_step} m; {MAX_STEPS} are allowed: give a greater step',
        )
    return counts


def _first_jump(positions: Array, jumps: JumpThresholds, slides: Mask) -> int:
    """Return how many rows come before the first jump."""
    steps = np.abs(np.diff(positions, axis=0))
    most = np.where(slides, jumps.prismatic or np.inf, jumps.revolute or np.inf)
    jumped = (steps > most).any(axis=1)
    if jumps.relative and len(steps) >= MIN_STEPS_FOR_JUMPS:
        lengths = np.linalg.norm(steps, axis=1)
        jumped |= lengths > jumps.relative * lengths.mean()
    return int(jumped.argmax()) + 1 if jumped.any() else len(positions)


def _jump_reason(positions: Array, kept: int, limits: JointLimits) -> str:
    step = np.abs(positions[kept] - positions[kept - 1])
    joint = int(step.argmax())
    return f'{limits.names[joint]} would jump by {step[joint]:.3f}'
