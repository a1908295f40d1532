# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Trajectories, tolerances and states between ROS messages and the core."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from trajectory_msgs.msg import JointTrajectoryPoint

from arm_model import JointLimits, RobotState
from arm_model.ros import duration_fields, seconds
from arm_trajectory import GoalCode, GoalError, GoalPoint, JointTolerance, TrajectoryGoal

from .parameters import TrajectoryParameters


def goal_of_trajectory(
    message: Any,  # noqa: ANN401  # message classes have no type
    now: float,
    parameters: TrajectoryParameters,
) -> TrajectoryGoal:
    """Return the goal that a JointTrajectory is.

    Args:
        now: ROS time in [s].

    Raises:
        GoalError: It has efforts, which nothing would follow.
    """
    stamp = seconds(message.header.stamp)
    if any(len(point.effort) for point in message.points):
        raise GoalError(GoalCode.INVALID_GOAL, 'points have efforts; only positions are followed')
    return TrajectoryGoal(
        list(message.joint_names),
        [_point(point) for point in message.points],
        age=now - stamp if stamp else 0.0,
        path_tolerance=parameters.path,
        goal_tolerance=parameters.goal,
    )


def goal_of_action(
    request: Any,  # noqa: ANN401
    now: float,
    parameters: TrajectoryParameters,
) -> TrajectoryGoal:
    """Return the goal that a goal of FollowJointTrajectory is.

    Args:
        now: ROS time in [s].

    Raises:
        GoalError: It has parts that nothing would follow, or tolerances of unknown joints.
    """
    if request.multi_dof_trajectory.points or request.multi_dof_trajectory.joint_names:
        raise GoalError(GoalCode.INVALID_JOINTS, 'multi_dof_trajectory: the arm has none')
    if request.component_path_tolerance or request.component_goal_tolerance:
        raise GoalError(GoalCode.INVALID_GOAL, 'component tolerances are for multi-DOF joints')
    goal = goal_of_trajectory(request.trajectory, now, parameters)
    return TrajectoryGoal(
        goal.joints,
        goal.points,
        goal.age,
        _overridden(parameters.path, request.path_tolerance, 'path_tolerance'),
        _overridden(parameters.goal, request.goal_tolerance, 'goal_tolerance'),
        seconds(request.goal_time_tolerance),
    )


def point_of(state: RobotState, time: float = 0.0) -> JointTrajectoryPoint:
    """Return a state as a point."""
    point = JointTrajectoryPoint(
        positions=state.position.tolist(),
        velocities=state.velocity.tolist(),
        accelerations=state.acceleration.tolist(),
    )
    fields = duration_fields(time)
    point.time_from_start.sec, point.time_from_start.nanosec = fields['sec'], fields['nanosec']
    return point


def difference(limits: JointLimits, wanted: RobotState, actual: RobotState) -> RobotState:
    """Return wanted less actual; accelerations are not measured, so theirs are zero."""
    return RobotState(
        limits.error(wanted.position, actual.position),
        wanted.velocity - actual.velocity,
        0.0 * wanted.acceleration,
    )


def _point(point: Any) -> GoalPoint:  # noqa: ANN401
    return GoalPoint(
        seconds(point.time_from_start),
        list(point.positions),
        list(point.velocities),
        list(point.accelerations),
    )


def _overridden(
    defaults: Mapping[str, JointTolerance], asked: Sequence[Any], what: str
) -> Mapping[str, JointTolerance]:
    """Return tolerances of the parameters, overridden by those of a goal."""
    merged = dict(defaults)
    for tolerance in asked:
        if tolerance.name not in merged:
            known = ', '.join(merged)
            reason = f'{what}: no joint {tolerance.name!r}; joints: {known}'
            raise GoalError(GoalCode.INVALID_JOINTS, reason)
        before = merged[tolerance.name]
        values = (tolerance.position, tolerance.velocity)
        if any(value != value for value in values):  # noqa: PLR0124  # NaN
            raise GoalError(GoalCode.INVALID_GOAL, f'{what} of {tolerance.name} is not a number')
        merged[tolerance.name] = JointTolerance(
            tolerance.position or before.position, tolerance.velocity or before.velocity
        )
    return merged
