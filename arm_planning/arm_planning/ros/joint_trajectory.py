# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What is looked at in a trajectory of a client before a controller gets it."""

from __future__ import annotations

from collections.abc import Sequence
import math
from typing import Any

from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from arm_model.ros import seconds

from ..exceptions import PlanningCode, PlanningError

ROWS = ('positions', 'velocities', 'accelerations')
"""What a point has of each joint; the positions it must have."""


def check_trajectory(trajectory: Any) -> None:  # noqa: ANN401  # messages have no type
    """Refuse a trajectory that no controller can follow.

    Raises:
        PlanningError: It has no points, names a joint twice, a row is too long or too short, a
            number is not finite, or its times do not increase.
    """
    names = list(trajectory.joint_names)
    if not trajectory.points:
        raise _invalid('the trajectory has no points')
    if twice := [name for name in names if names.count(name) > 1]:
        raise _invalid(f'joint {twice[0]} is named twice')
    before = -math.inf
    for number, point in enumerate(trajectory.points):
        for kind in ROWS:
            _check_row(number, kind, getattr(point, kind), names)
        time = seconds(point.time_from_start)
        if time < 0.0 or time <= before:
            after = 'not negative' if time < 0.0 else f'after {before:g} s, that of the one before'
            raise _invalid(
                f'point {number} has the time_from_start {time:g} s; it must be {after}'
            )
        before = time


def part_of(trajectory: Any, joints: Sequence[str]) -> JointTrajectory:  # noqa: ANN401
    """Return the trajectory of some of the joints."""
    names = list(trajectory.joint_names)
    columns = [names.index(joint) for joint in joints]
    part = JointTrajectory(joint_names=list(joints))
    for point in trajectory.points:
        picked = {
            kind: [float(values[column]) for column in columns] if len(values) else []
            for kind in ROWS
            for values in [getattr(point, kind)]
        }
        part.points.append(JointTrajectoryPoint(**picked, time_from_start=point.time_from_start))
    return part


def from_start(trajectory: Any, start: Sequence[float]) -> JointTrajectory:  # noqa: ANN401
    """Return a trajectory with the way to its first point, where that is later than its begin."""
    first = trajectory.points[0]
    if seconds(first.time_from_start) <= 0.0:
        return trajectory
    at_rest = JointTrajectoryPoint(
        positions=list(start),
        velocities=[0.0] * len(first.velocities),
        accelerations=[0.0] * len(first.accelerations),
    )
    return JointTrajectory(
        header=trajectory.header,
        joint_names=trajectory.joint_names,
        points=[at_rest, *trajectory.points],
    )


def _check_row(number: int, kind: str, values: Sequence[float], names: Sequence[str]) -> None:
    if len(values) != len(names) and (len(values) or kind == ROWS[0]):
        raise _invalid(f'point {number} has {len(values)} {kind} of {len(names)} joints')
    for name, value in zip(names, values, strict=False):
        if not math.isfinite(value):
            raise _invalid(f'point {number}: one of the {kind} is {value}, that of {name}')


def _invalid(reason: str) -> PlanningError:
    return PlanningError(PlanningCode.INVALID_MOTION_PLAN, reason)
