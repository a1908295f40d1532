# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters of the trajectory controller, under joint_trajectory_controller's names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from rclpy.node import Node

from arm_model import JointLimits, ModelError
from arm_trajectory import GoalRules, JointTolerance
from node_runner import ParameterReader

from ...controllers.trajectory import ExecutionSettings

RATE_RANGE = (0.1, 1000.0)  # span of rates in [Hz]

GOAL_TOLERANCE = 0.05
"""Default tolerance at the goal in [rad]: an arm that has not arrived is no success."""

GOAL_RANGE_SHARE = 0.02
"""Share of the range of an arm's joint that the default is at most: 0.05 m is far on a slide."""

GOAL_TIME = 5.0
"""Default of the time to come within it in [s]: a client of a stuck arm gets a result."""


@dataclass(frozen=True, slots=True)
class TrajectoryParameters:
    """How the trajectory controller behaves."""

    execution: ExecutionSettings  # how trajectories are accepted and followed
    path: Mapping[str, JointTolerance]  # tolerances on the way by joint; 0 is none
    goal: Mapping[str, JointTolerance]  # tolerances at the end by joint; 0 is none
    monitor_rate: float  # rate of the action's feedback in [Hz]
    state_rate: float  # rate of ~/controller_state in [Hz]
    speed: float  # speed scaling at the start, 0 to 1
    check: bool  # whether motions on whose way links meet are refused


def declare_trajectory(
    node: Node, joints: Sequence[str], limits: JointLimits | None = None, *, checks: bool = True
) -> TrajectoryParameters:
    """Declare the parameters of the trajectory controller.

    Args:
        limits: Their limits; None for an end effector, whose joints may end at what they hold.
        checks: Default of whether motions on whose way links meet are refused.

    Raises:
        ModelError: The parameter ``joints`` names others, or an interface is asked for that there
            is not.
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
        'greatest speed of a joint at the goal [rad/s]; 0 is none',
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
        ExecutionSettings(rules=rules, goal=JointTolerance(0.0, stopped), goal_time=goal_time),
        path,
        goal,
        read.number('action_monitor_rate', 20.0, RATE_RANGE, "rate of the action's feedback [Hz]"),
        read.number('state_publish_rate', 50.0, RATE_RANGE, 'rate of ~/controller_state [Hz]'),
        read.number(
            'speed_scaling.initial_scaling_factor', 1.0, (0.0, 1.0), 'speed at the start, 0 to 1'
        ),
        declare_check(read, default=checks),
    )


def _goal_tolerances(joints: Sequence[str], limits: JointLimits | None) -> Sequence[float]:
    if limits is None:
        return [GOAL_TOLERANCE] * len(joints)
    ranges = limits.upper - limits.lower
    return [min(GOAL_TOLERANCE, float(GOAL_RANGE_SHARE * each)) for each in ranges]


def declare_check(read: ParameterReader, *, default: bool = True) -> bool:
    """Declare whether motions on whose way links meet are refused."""
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
    """Accept parameters of ros2_control's configurations, and refuse what is not offered."""
    wanted = read.texts('command_interfaces', ['position'], 'position is what is commanded')
    if set(wanted) - {'position', 'velocity'} or 'position' not in wanted:
        raise ModelError(f'command_interfaces {wanted}: positions are commanded, use [position]')
    read.texts('state_interfaces', ['position', 'velocity'], 'what is measured')
    method = read.text(
        'interpolation_method', 'splines', 'splines: linear, cubic or quintic by what points say'
    )
    if method != 'splines':
        raise ModelError(f'interpolation_method {method!r}: only splines have limited jerk')
