# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run quad_teleop teleop_gamepad``: drive with a gamepad, while the deadman is held."""

from __future__ import annotations

import sys

from node_runner import destroyed_when_refused, refuse_misspelt
from operator_input.devices import InputDevices
from operator_input.ros import declare_gamepad, run_teleop, TeleopNode

from ..exceptions import TeleopError
from ..gamepad_teleop import GamepadTeleop
from ..motion import Speeds
from .robot_link import declare_speeds, declare_steps, declare_stream, RobotLink

SPEEDS = {'': Speeds(0.15, 0.6), 'turbo_': Speeds(0.3, 1.2)}


class TeleopGamepad(TeleopNode):
    """Publishes velocities and body poses, and requests modes.

    Attributes:
        robot: What it publishes to.
    """

    @destroyed_when_refused
    def __init__(self, devices: InputDevices | None = None) -> None:
        """Declare the parameters and advertise the topics.

        Args:
            devices: Where gamepads are; those of this machine when it is None.

        Raises:
            ParameterError: A parameter is misspelt, of another kind or out of its range.
            SettingError: Parameters make no sense together.
            PresetError: There is no preset of that name.
        """
        super().__init__('teleop_gamepad')
        self.source, deadman = declare_gamepad(self, devices)
        self.robot = RobotLink(self, self.get_logger().info)
        normal, turbo = declare_speeds(self, SPEEDS)
        self.mapping = GamepadTeleop(
            self.robot,
            deadman,
            declare_stream(self),
            normal,
            turbo,
            steps=declare_steps(self),
            warn=self.get_logger().warning,
        )
        refuse_misspelt(self)


def main() -> int:
    """Run until Ctrl-C; return the exit code."""
    return run_teleop('teleop_gamepad', TeleopGamepad, TeleopError, patient=False)


if __name__ == '__main__':
    sys.exit(main())
