# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""States and trajectories of joints between MoveIt's messages and values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import chain, pairwise
import math
from typing import Any

from moveit_msgs.msg import RobotState as StateMessage
from moveit_msgs.msg import RobotTrajectory
from sensor_msgs.msg import JointState
from std_msgs.msg import Header
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from arm_model import Array
from arm_model.ros import duration_fields
from arm_trajectory import Path

from ..exceptions import PlanningCode, PlanningError

POINT_PERIOD = 0.1
"""Longest time between two points of a trajectory in [s]: that of MoveIt's plans."""

MAX_SPLITS = 5000
"""Points that are added to a trajectory at most: those of a very slow one are farther apart."""


def joints_of(message: Any, known: Sequence[str]) -> Mapping[str, float]:  # noqa: ANN401
    """Return the positions in [rad] that a moveit_msgs/RobotState has, by joint.

    Args:
        known: Joints of the robot, mimic joints too.

    Raises:
        PlanningError: A joint is unknown, a position is missing or not finite, or there are joints
            of several degrees of freedom.
    """
    state = message.joint_state
    if message.multi_dof_joint_state.joint_names:
        raise _invalid('multi_dof_joint_state: the robot stands still, it has no such joint')
    if len(state.name) != len(state.position):
        raise _invalid(f'{len(state.name)} names and {len(state.position)} positions')
    for name, position in zip(state.name, state.position, strict=True):
        if name not in known:
            raise _invalid(f'no joint {name!r}; joints: {", ".join(known)}')
        if not math.isfinite(position):
            raise _invalid(f'the position of {name} is {position}; it must be finite')
    return dict(zip(state.name, state.position, strict=True))


def _invalid(reason: str) -> PlanningError:
    return PlanningError(PlanningCode.INVALID_ROBOT_STATE, f'robot state: {reason}')


def state_message(joints: Sequence[str], positions: Array, root: str) -> StateMessage:
    """Return joints at rest as a moveit_msgs/RobotState."""
    header = Header(frame_id=root)
    state = JointState(header=header, name=list(joints), position=positions.tolist())
    message = StateMessage(joint_state=state)
    message.multi_dof_joint_state.header = header
    return message


def trajectory_message(joints: Sequence[str], path: Path, root: str) -> RobotTrajectory:
    """Return a path as a moveit_msgs/RobotTrajectory.

    Its points are the ends of the path's polynomials and some in between, with velocities and
    accelerations: a quintic between two of them is the path itself, and a viewer that shows one
    point after the other shows a motion.
    """
    # of ends in the same nanosecond the last one: points of equal time are no trajectory
    ends = {round(time * 1e9): time for time in [*path.starts.tolist(), path.duration]}
    times = list(ends.values())
    period = max(POINT_PERIOD, path.duration / MAX_SPLITS)
    parts = [_split(begin, end, period) for begin, end in pairwise(times)]
    trajectory = JointTrajectory(header=Header(frame_id=root), joint_names=list(joints))
    trajectory.points = [_point(path, time) for time in (*chain(*parts), times[-1])]
    return RobotTrajectory(joint_trajectory=trajectory)


def _split(begin: float, end: float, period: float) -> Sequence[float]:
    """Return times from a begin up to an end, which is left out, that are near to each other."""
    count = math.ceil((end - begin) / period)
    return [begin + number * (end - begin) / count for number in range(count)]


def _point(path: Path, time: float) -> JointTrajectoryPoint:
    place = path.at(time)
    point = JointTrajectoryPoint(
        positions=place.position.tolist(),
        velocities=place.velocity.tolist(),
        accelerations=place.acceleration.tolist(),
    )
    fields = duration_fields(time)
    point.time_from_start.sec, point.time_from_start.nanosec = fields['sec'], fields['nanosec']
    return point
