# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters that the keyboard and the gamepad have in common."""

from __future__ import annotations

from rclpy.node import Node

from node_runner import ParameterReader
from operator_input import CommandStream

from ..body_pose import PoseSteps
from ..speeds import MIN_SPEED, Speeds
from ..velocity import rest_of, Velocity

MAX_SPEED = 3.0  # [m/s] of any legged robot that people drive by hand
MAX_TURN_SPEED = 10.0  # [rad/s]


def declare_speeds(node: Node, prefix: str, default: Speeds) -> Speeds:
    """Declare ``speed``, ``turn`` and their limits.

    Args:
        node: The node.
        prefix: What stands before the names, such as ``turbo_``.
        default: The default values.

    Raises:
        ParameterError: A value is of another kind or out of its range.
        SettingError: The values make no sense together.
    """
    read, low = ParameterReader(node), MIN_SPEED
    return Speeds(
        read.number(f'{prefix}speed', default.linear, (low, MAX_SPEED), 'Speed of walking [m/s]'),
        read.number(f'{prefix}turn', default.angular, (low, MAX_TURN_SPEED), 'of turning [rad/s]'),
        _limit(node, 'speed_limit', default.linear_limit, MAX_SPEED, 'Highest speed [m/s]'),
        _limit(node, 'turn_limit', default.angular_limit, MAX_TURN_SPEED, 'Highest turn [rad/s]'),
    )


def declare_steps(node: Node) -> PoseSteps:
    """Declare how far a key tilts and lifts the body.

    Args:
        node: The node.

    Raises:
        ParameterError: A value is of another kind or out of its range.
        SettingError: The values make no sense together.
    """
    read, default = ParameterReader(node), PoseSteps()
    return PoseSteps(
        read.number('height_step', default.height_step, (0.0005, 0.1), 'Lift of a stroke [m]'),
        read.number('height_limit', default.height_limit, (0.0005, 0.3), 'Highest lift [m]'),
        read.number('angle_step', default.angle_step, (0.001, 0.5), 'Tilt of a stroke [rad]'),
        read.number('angle_limit', default.angle_limit, (0.001, 0.8), 'Largest tilt [rad]'),
    )


def declare_stream(node: Node) -> CommandStream[Velocity]:
    """Declare how often to publish.

    Args:
        node: The node.

    Raises:
        ParameterError: A value is of another kind or out of its range.
    """
    rate = ParameterReader(node).number(
        'repeat_rate', 20.0, (4.0, 200.0), 'Messages while active [Hz]'
    )
    return CommandStream(1.0 / rate, rest_of)


def _limit(node: Node, name: str, default: float, high: float, meaning: str) -> float:
    if node.has_parameter(name):  # one limit for normal and turbo
        return float(node.get_parameter(name).value)
    return ParameterReader(node).number(name, default, (MIN_SPEED, high), meaning)
