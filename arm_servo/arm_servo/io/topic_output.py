# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Set-points as messages to a controller elsewhere, as moveit_servo sends them, and their loop."""

from __future__ import annotations

from dataclasses import dataclass

from rclpy.node import Node
from std_msgs.msg import Float64MultiArray
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from arm_model import ModelError
from arm_model.ros import duration_fields
from node_runner import declare_thread_priority, ParameterReader

from ..controllers.controller import SetPoint
from .following import FollowingLimits

TRAJECTORY = 'trajectory_msgs/JointTrajectory'
ARRAY = 'std_msgs/Float64MultiArray'

THREAD_PRIORITY = 40
"""SCHED_FIFO priority of the loop, unless a parameter says another; that of moveit_servo."""


@dataclass(frozen=True, slots=True)
class OutputParameters:
    """What is published."""

    topic: str  # where to
    kind: str  # :data:`TRAJECTORY` or :data:`ARRAY`
    positions: bool  # positions are in it
    velocities: bool  # velocities are in it
    accelerations: bool  # accelerations are in it; only in trajectories


def declare_output(node: Node, prefix: str, topic: str, kind: str) -> OutputParameters:
    """Declare moveit_servo's parameters of the output.

    Args:
        prefix: Before each name, with its dot.

    Raises:
        ModelError: The type is unknown, or does not carry what is to be in it.
    """
    read = ParameterReader(node, prefix)
    parameters = OutputParameters(
        read.text('command_out_topic', topic, 'where set-points are published'),
        read.text('command_out_type', kind, f'{TRAJECTORY} or {ARRAY}'),
        read.flag('publish_joint_positions', 'positions are in it', default=True),
        read.flag('publish_joint_velocities', 'velocities are in it', default=kind == TRAJECTORY),
        read.flag('publish_joint_accelerations', 'accelerations are in it', default=False),
    )
    if parameters.kind not in {TRAJECTORY, ARRAY}:
        raise ModelError(
            f'{prefix}command_out_type is {parameters.kind!r}: {TRAJECTORY} or {ARRAY}'
        )
    chosen = parameters.positions + parameters.velocities + parameters.accelerations
    if not chosen or (parameters.kind == ARRAY and (chosen > 1 or parameters.accelerations)):
        raise ModelError(
            f'{prefix}publish_joint_...: an array has positions or velocities, a trajectory at'
            ' least one of them'
        )
    return parameters


@dataclass(frozen=True, slots=True)
class LoopParameters:
    """How the loop runs."""

    period: float  # its period in [s]
    joint_topic: str  # topic of the joint states
    joint_timeout: float  # age at which a joint state counts no more in [s]
    priority: int  # SCHED_FIFO priority of its thread; 0 is none
    following: FollowingLimits  # when the arm counts as not following


def declare_loop(node: Node, prefix: str) -> LoopParameters:
    """Declare how the loop runs.

    Args:
        prefix: Before each name, with its dot.
    """
    read = ParameterReader(node, prefix)
    return LoopParameters(
        read.number('publish_period', 0.01, (0.001, 0.1), 'period of the loop [s]'),
        read.text('joint_topic', 'joint_states', 'topic of the joint states'),
        read.number(
            'joint_state_timeout',
            0.5,
            (0.02, 10.0),
            'silence of a joint at which the arm comes to rest [s]',
        ),
        declare_thread_priority(read, THREAD_PRIORITY),
        FollowingLimits(
            read.number(
                'following_error_limit',
                0.2,
                (0.0, 10.0),
                'distance of a joint from where it was sent at which the arm comes to rest [rad];'
                ' 0 is any',
            ),
            read.number(
                'following_delay', 0.2, (0.0, 1.0), 'how late it may be where it was sent [s]'
            ),
        ),
    )


class TopicOutput:
    """Publishes set-points; for the thread of the cycle."""

    def __init__(
        self, node: Node, parameters: OutputParameters, joints: list[str], period: float
    ) -> None:
        kind = Float64MultiArray if parameters.kind == ARRAY else JointTrajectory
        self._publisher = node.create_publisher(kind, parameters.topic, 10)
        self._parameters, self._joints = parameters, joints
        self._duration = duration_fields(period)

    def __call__(self, point: SetPoint) -> None:
        """Publish a set-point."""
        wanted, state = self._parameters, point.state
        if wanted.kind == ARRAY:
            values = state.position if wanted.positions else state.velocity
            self._publisher.publish(Float64MultiArray(data=values.tolist()))
            return
        row = JointTrajectoryPoint()
        if wanted.positions:
            row.positions = state.position.tolist()
        if wanted.velocities:
            row.velocities = state.velocity.tolist()
        if wanted.accelerations:
            row.accelerations = state.acceleration.tolist()
        row.time_from_start.sec = self._duration['sec']
        row.time_from_start.nanosec = self._duration['nanosec']
        self._publisher.publish(JointTrajectory(joint_names=self._joints, points=[row]))
