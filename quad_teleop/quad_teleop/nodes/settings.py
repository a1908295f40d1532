# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters that the keyboard and the gamepad have in common."""

from __future__ import annotations

from rclpy.node import Node

from ..body_pose import PoseSteps
from ..command_stream import CommandStream
from ..speeds import SLOWEST, Speeds
from .parameters import number

FASTEST, FASTEST_TURN = 3.0, 10.0  # [m/s], [rad/s] of any legged robot that people drive by hand


def declare_speeds(node: Node, prefix: str, default: Speeds) -> Speeds:
    """Declare ``speed``, ``turn`` and their limits.

    Args:
        node: The node.
        prefix: What stands before the names, such as ``turbo_``.
        default: The default values.

    Raises:
        SettingError: A value makes no sense.
    """
    low = SLOWEST
    return Speeds(
        number(node, f'{prefix}speed', default.linear, (low, FASTEST), 'Speed of walking [m/s]'),
        number(node, f'{prefix}turn', default.angular, (low, FASTEST_TURN), 'of turning [rad/s]'),
        _limit(node, 'speed_limit', default.linear_limit, FASTEST, 'Highest speed [m/s]'),
        _limit(node, 'turn_limit', default.angular_limit, FASTEST_TURN, 'Highest turn [rad/s]'),
    )


def declare_steps(node: Node) -> PoseSteps:
    """Declare how far a key tilts and lifts the body.

    Args:
        node: The node.

    Raises:
        SettingError: A value makes no sense.
    """
    default = PoseSteps()
    return PoseSteps(
        number(node, 'height_step', default.height_step, (0.0005, 0.1), 'Lift of a stroke [m]'),
        number(node, 'height_limit', default.height_limit, (0.0005, 0.3), 'Highest lift [m]'),
        number(node, 'angle_step', default.angle_step, (0.001, 0.5), 'Tilt of a stroke [rad]'),
        number(node, 'angle_limit', default.angle_limit, (0.001, 0.8), 'Largest tilt [rad]'),
    )


def declare_stream(node: Node) -> CommandStream:
    """Declare how often to publish.

    Args:
        node: The node.

    Raises:
        SettingError: A value makes no sense.
    """
    rate = number(node, 'repeat_rate', 20.0, (4.0, 200.0), 'Messages while active [Hz]')
    return CommandStream(1.0 / rate)


def _limit(node: Node, name: str, default: float, high: float, meaning: str) -> float:
    if node.has_parameter(name):  # one limit for normal and turbo
        return float(node.get_parameter(name).value)
    return number(node, name, default, (SLOWEST, high), meaning)
