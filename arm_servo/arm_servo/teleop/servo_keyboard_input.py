# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_servo servo_keyboard_input``: jog an arm with the keys of a terminal."""

from __future__ import annotations

import sys

from arm_model import ArmError
from node_runner import destroyed_when_refused, ParameterReader, refuse_misspelt
from operator_input.ros import declare_keyboard, run_teleop, TeleopNode

from .jog import Steps
from .keyboard_teleop import KeyboardTeleop, MIN_SPEED
from .servo_link import ServoLink


class ServoKeyboardInput(TeleopNode):
    """Node that jogs with the keyboard, configured by its parameters."""

    @destroyed_when_refused
    def __init__(self) -> None:
        """Declare the parameters, and connect.

        Raises:
            ParameterError: A parameter is misspelt or invalid.
        """
        super().__init__('servo_keyboard_input')
        self.source, held = declare_keyboard(self)
        link, read = ServoLink(self, self.get_logger().info), ParameterReader(self)
        speed = read.number('speed', 0.5, (MIN_SPEED, 1.0), "share of the servo's full speed")
        steps = Steps(
            read.number('linear_step', 1e-3, (1e-5, 0.1), 'single step of the tool [m]'),
            read.number('angular_step', 0.01745, (1e-4, 0.5), 'single step [rad]'),
        )
        self.mapping = KeyboardTeleop(link, held, link.stream, speed, steps)
        refuse_misspelt(self)


def main() -> int:
    """Run until Ctrl-C; return the exit code."""
    return run_teleop('servo_keyboard_input', ServoKeyboardInput, ArmError, patient=True)


if __name__ == '__main__':
    sys.exit(main())
