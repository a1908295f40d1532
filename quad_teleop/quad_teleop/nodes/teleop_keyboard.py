# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run quad_teleop teleop_keyboard``: drive with the keys of a terminal."""

from __future__ import annotations

import sys

from node_runner import destroyed_when_refused, refuse_misspelt
from operator_input.ros import declare_keyboard, run_teleop, TeleopNode

from ..exceptions import TeleopError
from ..keyboard_teleop import KeyboardTeleop
from ..motion import Speeds
from .robot_link import declare_speeds, declare_steps, declare_stream, RobotLink


class TeleopKeyboard(TeleopNode):
    """Publishes velocities and body poses, and requests modes."""

    @destroyed_when_refused
    def __init__(self) -> None:
        """Declare the parameters and advertise the topics.

        Raises:
            ParameterError: A parameter is misspelt, of another kind or out of its range.
            SettingError: Parameters make no sense together.
        """
        super().__init__('teleop_keyboard')
        self.source, held = declare_keyboard(self)
        robot = RobotLink(self, self.get_logger().info)
        (speeds,) = declare_speeds(self, {'': Speeds()})
        steps = declare_steps(self)
        self.mapping = KeyboardTeleop(robot, held, declare_stream(self), speeds, steps)
        refuse_misspelt(self)


def main() -> int:
    """Run until Ctrl-C; return the exit code."""
    return run_teleop('teleop_keyboard', TeleopKeyboard, TeleopError, patient=True)


if __name__ == '__main__':
    sys.exit(main())
