# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters that the keyboard and the gamepad have in common.

All raise ParameterError for a value of another kind or out of its range, and SettingError for
values that make no sense together.
"""

from __future__ import annotations

from collections.abc import Mapping

from rclpy.node import Node

from node_runner import ParameterReader
from operator_input import CommandStream

from ..motion import MIN_SPEED, PoseSteps, rest_of, Speeds, Velocity

SPEEDS = (MIN_SPEED, 3.0)  # [m/s] of any legged robot that people drive by hand
TURNS = (MIN_SPEED, 10.0)  # [rad/s]


def declare_speeds(node: Node, defaults: Mapping[str, Speeds]) -> list[Speeds]:
    """Declare ``speed`` and ``turn`` for each prefix of their names, and the limits of all."""
    read, limits = ParameterReader(node), Speeds()
    speed_limit = read.number('speed_limit', limits.linear_limit, SPEEDS, 'Highest speed [m/s]')
    turn_limit = read.number('turn_limit', limits.angular_limit, TURNS, 'Highest turn [rad/s]')
    return [
        Speeds(
            read.number(f'{prefix}speed', default.linear, SPEEDS, 'Speed of walking [m/s]'),
            read.number(f'{prefix}turn', default.angular, TURNS, 'of turning [rad/s]'),
            speed_limit,
            turn_limit,
        )
        for prefix, default in defaults.items()
    ]


def declare_steps(node: Node) -> PoseSteps:
    """Declare how far a stroke tilts and lifts the body."""
    read, default = ParameterReader(node), PoseSteps()
    return PoseSteps(
        read.number('height_step', default.height_step, (0.0005, 0.1), 'Lift of a stroke [m]'),
        read.number('height_limit', default.height_limit, (0.0005, 0.3), 'Highest lift [m]'),
        read.number('angle_step', default.angle_step, (0.001, 0.5), 'Tilt of a stroke [rad]'),
        read.number('angle_limit', default.angle_limit, (0.001, 0.8), 'Largest tilt [rad]'),
    )


def declare_stream(node: Node) -> CommandStream[Velocity]:
    """Declare how often to publish."""
    read = ParameterReader(node)
    rate = read.number('repeat_rate', 20.0, (4.0, 200.0), 'Messages while active [Hz]')
    return CommandStream(1.0 / rate, rest_of)
