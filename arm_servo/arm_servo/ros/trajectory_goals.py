# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters and message conversion of the trajectory controller.

The parameters have joint_trajectory_controller's names. Messages are trajectories and states.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
import math
from typing import Any

from rclpy.node import Node
from trajectory_msgs.msg import JointTrajectoryPoint

from arm_model import JointLimits, ModelError, RobotState
from arm_model.ros import duration_fields, seconds
from arm_trajectory import (
    GoalCode,
    GoalError,
    GoalPoint,
    GoalRules,
    JointTolerance,
    TrajectoryGoal,
)
from node_runner import ParameterReader

from ..controllers.trajectory import ExecutionSettings

RATE_RANGE = (0.1, 1000.0)  # span of rates in [Hz]

GOAL_TOLERANCE = 0.05
"""Default goal tolerance in [rad], so that an arm that has not arrived is reported."""

GOAL_RANGE_SHARE = 0.02
"""Upper bound of the default as a share of a joint's range, for short prismatic joints."""

GOAL_TIME = 5.0
"""Default goal time tolerance in [s], so that a client of a stuck arm gets a result."""


@dataclass(frozen=True, slots=True)
class TrajectoryParameters:
    """Parameters of the trajectory controller."""

    execution: ExecutionSettings  # how trajectories are accepted and followed
    monitor_rate: float  # rate of the action's feedback in [Hz]
    state_rate: float  # rate of ~/controller_state in [Hz]
    speed: float  # speed scaling at the start, 0 to 1
    check: bool  # whether to refuse motions whose path has a collision
    rest_speed: float  # above which a joint moves in [rad/s] or [m/s]


def declare_trajectory(
    node: Node, joints: Sequence[str], limits: JointLimits | None = None, *, checks: bool = True
) -> TrajectoryParameters:
    """Declare the parameters of the trajectory controller.

    Args:
        limits: Joint limits; None for an end effector, which may stop at the object it grips.
        checks: Default of whether to refuse motions whose path has a collision.

    Raises:
        ModelError: The parameter ``joints`` names other joints, or an interface is not
            supported.
    """
    read = ParameterReader(node)
    named = read.texts('joints', list(joints), "names of the joints: those of the arm's group")
    if sorted(named) != sorted(joints):
        raise ModelError(f'joints: {named} are not those of the group, {list(joints)}')
    _declare_interfaces(read)
    stopped = read.number(
        'constraints.stopped_velocity_tolerance',
        0.01,
        (0.0, 100.0),
        'greatest speed of a joint at the goal, and at rest [rad/s]; 0 is none',
    )
    path = {name: JointTolerance(_constraint(read, name, 'trajectory', 0.0)) for name in joints}
    goal = {
        name: JointTolerance(_constraint(read, name, 'goal', default), stopped)
        for name, default in zip(joints, _goal_tolerances(joints, limits), strict=True)
    }
    rules = GoalRules(
        partial=read.flag(
            'allow_partial_joints_goal', 'accept goals for some of the joints', default=False
        ),
        end_velocity=read.flag(
            'allow_nonzero_velocity_at_trajectory_end',
            'accept a velocity at the last point; the arm comes to rest behind it',
            default=False,
        ),
    )
    goal_time = read.number(
        'constraints.goal_time',
        GOAL_TIME,
        (0.0, 3600.0),
        'time to come within the tolerances of the goal [s]; 0 waits without end',
    )
    return TrajectoryParameters(
        ExecutionSettings(rules, path, goal, goal_time),
        read.number('action_monitor_rate', 20.0, RATE_RANGE, "rate of the action's feedback [Hz]"),
        read.number('state_publish_rate', 50.0, RATE_RANGE, 'rate of ~/controller_state [Hz]'),
        read.number(
            'speed_scaling.initial_scaling_factor', 1.0, (0.0, 1.0), 'speed at the start, 0 to 1'
        ),
        declare_check(read, default=checks),
        stopped or math.inf,
    )


def _goal_tolerances(joints: Sequence[str], limits: JointLimits | None) -> Sequence[float]:
    if limits is None:
        return [GOAL_TOLERANCE] * len(joints)
    ranges = limits.upper - limits.lower
    return [min(GOAL_TOLERANCE, float(GOAL_RANGE_SHARE * each)) for each in ranges]


def declare_check(read: ParameterReader, *, default: bool = True) -> bool:
    """Declare whether to refuse motions whose path has a collision."""
    return read.flag(
        'check_self_collision',
        'refuse trajectories and displacements on whose way links of the arm collide',
        default=default,
    )


def _constraint(read: ParameterReader, joint: str, kind: str, default: float) -> float:
    where = 'on the way' if kind == 'trajectory' else 'at the goal'
    meaning = f'tolerance {where} [rad]; 0 is none'
    return read.number(f'constraints.{joint}.{kind}', default, (0.0, 100.0), meaning)


def _declare_interfaces(read: ParameterReader) -> None:
    """Declare ros2_control's interface parameters, and refuse unsupported values."""
    wanted = read.texts('command_interfaces', ['position'], 'position is what is commanded')
    if set(wanted) - {'position', 'velocity'} or 'position' not in wanted:
        raise ModelError(f'command_interfaces {wanted}: positions are commanded, use [position]')
    read.texts('state_interfaces', ['position', 'velocity'], 'what is measured')
    method = read.text(
        'interpolation_method', 'splines', 'splines: linear, cubic or quintic by what points say'
    )
    if method != 'splines':
        raise ModelError(f'interpolation_method {method!r}: only splines have limited jerk')


def goal_of_trajectory(
    message: Any,  # noqa: ANN401  # message classes have no type
    now: float,  # ROS time in [s]
) -> TrajectoryGoal:
    """Convert a JointTrajectory to a goal.

    Raises:
        GoalError: The message contains efforts, which are not supported.
    """
    stamp = seconds(message.header.stamp)
    if any(len(point.effort) for point in message.points):
        raise GoalError(GoalCode.INVALID_GOAL, 'points have efforts; only positions are followed')
    return TrajectoryGoal(
        list(message.joint_names),
        [
            GoalPoint(
                seconds(point.time_from_start),
                list(point.positions),
                list(point.velocities),
                list(point.accelerations),
            )
            for point in message.points
        ],
        age=now - stamp if stamp else 0.0,
    )


def goal_of_action(
    request: Any,  # noqa: ANN401
    now: float,  # ROS time in [s]
) -> TrajectoryGoal:
    """Convert a FollowJointTrajectory goal message to a goal.

    Raises:
        GoalError: The message contains fields that are not supported.
    """
    if request.multi_dof_trajectory.points or request.multi_dof_trajectory.joint_names:
        raise GoalError(GoalCode.INVALID_JOINTS, 'multi_dof_trajectory: the arm has none')
    if request.component_path_tolerance or request.component_goal_tolerance:
        raise GoalError(GoalCode.INVALID_GOAL, 'component tolerances are for multi-DOF joints')
    path, end = (
        {each.name: JointTolerance(each.position, each.velocity) for each in tolerances}
        for tolerances in (request.path_tolerance, request.goal_tolerance)
    )
    return replace(
        goal_of_trajectory(request.trajectory, now),
        path_tolerance=path,
        goal_tolerance=end,
        goal_time=seconds(request.goal_time_tolerance),
    )


def point_of(state: RobotState, time: float = 0.0) -> JointTrajectoryPoint:
    """Convert a state to a trajectory point."""
    point = JointTrajectoryPoint(
        positions=state.position.tolist(),
        velocities=state.velocity.tolist(),
        accelerations=state.acceleration.tolist(),
    )
    fields = duration_fields(time)
    point.time_from_start.sec, point.time_from_start.nanosec = fields['sec'], fields['nanosec']
    return point


def difference(limits: JointLimits, wanted: RobotState, actual: RobotState) -> RobotState:
    """Return wanted minus actual; accelerations, which are not measured, are zero."""
    return RobotState(
        limits.error(wanted.position, actual.position),
        wanted.velocity - actual.velocity,
        0.0 * wanted.acceleration,
    )
