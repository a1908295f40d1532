# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_servo servo_gamepad``: jog an arm with a gamepad, while the deadman is held."""

from __future__ import annotations

import sys

from arm_model import ArmError
from node_runner import destroyed_when_refused, ParameterReader, refuse_misspelt
from operator_input.devices import InputDevices
from operator_input.ros import declare_gamepad, run_teleop, TeleopNode

from .gamepad_teleop import GamepadTeleop
from .servo_link import ServoLink


class ServoGamepad(TeleopNode):
    """The node, with what its parameters say.

    Attributes:
        link: The servo.
    """

    @destroyed_when_refused
    def __init__(self, devices: InputDevices | None = None) -> None:
        """Declare the parameters, and connect.

        Args:
            devices: Where gamepads are; those of this machine when it is None.

        Raises:
            ParameterError: A parameter is misspelt or makes no sense.
            PresetError: There is no preset of that name.
            SettingError: Parameters make no sense together.
        """
        super().__init__('servo_gamepad')
        self.source, deadman = declare_gamepad(self, devices)
        self.link, read = ServoLink(self, self.get_logger().info), ParameterReader(self)
        speeds = (
            read.number('speed', 0.3, (0.01, 1.0), "share of the servo's full speed"),
            read.number('turbo_speed', 1.0, (0.01, 1.0), 'the same with the turbo button'),
        )
        warn = self.get_logger().warning
        self.mapping = GamepadTeleop(self.link, deadman, self.link.stream, speeds, warn)
        refuse_misspelt(self)


def main() -> int:
    """Run until Ctrl-C; return the exit code."""
    return run_teleop('servo_gamepad', ServoGamepad, ArmError, patient=False)


if __name__ == '__main__':
    sys.exit(main())
