# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Converts joint states and trajectories to messages, and checks those of clients."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import chain, pairwise
import math
from typing import Any

from moveit_msgs.msg import RobotState as StateMessage
from moveit_msgs.msg import RobotTrajectory
import numpy as np
from sensor_msgs.msg import JointState
from std_msgs.msg import Header
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from arm_model import Array
from arm_model.ros import duration_fields, seconds
from arm_trajectory import cubics, lines, Path, quintics

from ..exceptions import PlanningCode, PlanningError

POINT_PERIOD = 0.1
"""Longest time between two points of a trajectory in [s], as in MoveIt's plans."""

ROWS = ('positions', 'velocities', 'accelerations')
"""Fields of a point with one value per joint; positions are required."""

MAX_SPLITS = 5000
"""Greatest number of points added to a trajectory; a very slow one gets them farther apart."""


def joints_of(message: Any, known: Sequence[str]) -> Mapping[str, float]:  # noqa: ANN401
    """Return the positions in [rad] in a moveit_msgs/RobotState, by joint, or refuse it."""
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
    accelerations: quintic interpolation reproduces the path exactly, and a viewer that shows the
    points one by one shows a smooth motion.
    """
    # of ends in the same nanosecond the last one: points of equal time are no trajectory
    ends = {round(time * 1e9): time for time in [*path.starts.tolist(), path.duration]}
    times = list(ends.values())
    period = max(POINT_PERIOD, path.duration / MAX_SPLITS)
    parts = [
        np.linspace(begin, end, math.ceil((end - begin) / period), endpoint=False).tolist()
        for begin, end in pairwise(times)
    ]
    trajectory = JointTrajectory(header=Header(frame_id=root), joint_names=list(joints))
    trajectory.points = [_point(path, time) for time in (*chain(*parts), times[-1])]
    return RobotTrajectory(joint_trajectory=trajectory)


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


def check_trajectory(trajectory: Any) -> None:  # noqa: ANN401  # messages have no type
    """Refuse a trajectory whose points, rows, numbers or times no controller can follow."""
    names = list(trajectory.joint_names)
    if not trajectory.points:
        raise _no_trajectory('the trajectory has no points')
    if twice := [name for name in names if names.count(name) > 1]:
        raise _no_trajectory(f'joint {twice[0]} is named twice')
    before = -math.inf
    for number, point in enumerate(trajectory.points):
        for kind in ROWS:
            _check_row(number, kind, getattr(point, kind), names)
        time = seconds(point.time_from_start)
        if time < 0.0 or time <= before:
            after = 'not negative' if time < 0.0 else f'after {before:g} s, that of the one before'
            raise _no_trajectory(
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
    """Return a trajectory with the motion to its first point, if that has a time above 0."""
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
        raise _no_trajectory(f'point {number} has {len(values)} {kind} of {len(names)} joints')
    for name, value in zip(names, values, strict=False):
        if not math.isfinite(value):
            raise _no_trajectory(f'point {number}: one of the {kind} is {value}, that of {name}')


def _no_trajectory(reason: str) -> PlanningError:
    return PlanningError(PlanningCode.INVALID_MOTION_PLAN, reason)


def path_of(trajectory: Any) -> Path:  # noqa: ANN401
    """Return the path that joint_trajectory_controller interpolates through two or more points."""
    times = np.array([seconds(each.time_from_start) for each in trajectory.points])
    lasts = np.diff(times)
    rows = [[getattr(each, kind) for each in trajectory.points] for kind in ROWS]
    # velocities or accelerations that some points lack do not count
    q, v, a = (np.array(each if all(map(len, each)) else []) for each in rows)
    if a.shape == q.shape == v.shape:
        pieces = quintics(lasts, q, v, a)
    elif v.shape == q.shape:
        pieces = cubics(lasts, q, v)
    else:
        pieces = lines(lasts, q)
    return Path(lasts, pieces)
