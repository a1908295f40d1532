# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters of the gripper controller, under gripper_controllers' names."""

from __future__ import annotations

from dataclasses import dataclass

from rclpy.node import Node

from node_runner import ParameterReader


@dataclass(frozen=True, slots=True)
class GripperParameters:
    """How the gripper controller behaves."""

    goal_tolerance: float  # how far a joint may be off at the goal in [rad] or [m]
    stall_velocity: float  # speed below which a joint does not move in [rad/s] or [m/s]
    # time without motion in front of the goal after which it is stalled in [s]
    stall_timeout: float
    allow_stalling: bool  # whether a goal that ends stalled succeeds: something is held


def declare_gripper(node: Node) -> GripperParameters:
    """Declare the parameters of the gripper controller."""
    read = ParameterReader(node)
    return GripperParameters(
        read.number(
            'goal_tolerance', 0.002, (0.0, 10.0), 'how far a joint may be off [rad] or [m]'
        ),
        read.number(
            'stall_velocity_threshold',
            0.001,
            (0.0, 10.0),
            'speed below which a joint does not move [rad/s] or [m/s]',
        ),
        read.number('stall_timeout', 1.0, (0.05, 60.0), 'time without motion that is a stall [s]'),
        read.flag('allow_stalling', 'a goal that ends stalled succeeds', default=False),
    )
