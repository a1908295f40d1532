# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_servo servo_gamepad``: jog an arm with a gamepad, while the deadman is held."""

from __future__ import annotations

import sys
import threading

from arm_model import ArmError
from node_runner import destroyed_when_refused, ParameterReader, refuse_misspelt
from operator_input import CommandStream
from operator_input.devices import InputDevices
from operator_input.gamepad import GamepadSession, GamepadState
from operator_input.ros import GamepadNode, run_gamepad

from .gamepad_teleop import GamepadTeleop
from .jog import Jog, rest_of
from .servo_link import declare_link, ServoLink


class ServoGamepad(GamepadNode):
    """The node, with what its parameters say.

    Attributes:
        teleop: Decides what to publish.
        link: The servo.
    """

    @destroyed_when_refused
    def __init__(self, devices: InputDevices | None = None) -> None:
        """Declare the parameters and advertise the topics.

        Args:
            devices: Where gamepads are; those of this machine when it is None.

        Raises:
            ParameterError: A parameter is misspelt or makes no sense.
            PresetError: There is no preset of that name.
            SettingError: Parameters make no sense together.
        """
        super().__init__('servo_gamepad', devices)
        settings = declare_link(self)
        read = ParameterReader(self)
        self.teleop = GamepadTeleop(
            read.number('speed', 0.3, (0.01, 1.0), "share of the servo's full speed"),
            read.number('turbo_speed', 1.0, (0.01, 1.0), 'the same with the turbo button'),
            self.deadman,
            CommandStream(settings.period, rest_of),
        )
        refuse_misspelt(self)
        self.link = ServoLink(self, settings, self.get_logger().info)


class Session(GamepadSession[Jog]):
    """One person with one gamepad, and the servo."""

    def __init__(self, node: ServoGamepad, stop: threading.Event) -> None:
        """Prepare.

        Args:
            node: The node.
            stop: Ends it.
        """
        super().__init__(node.gamepad, node.teleop, stop)
        self._node = node

    def publish(self, command: Jog) -> None:
        """Publish a motion."""
        self._node.link.publish(command)

    def take(self, state: GamepadState) -> None:
        """Say what the buttons chose."""
        if chosen := self._node.teleop.feed(state):
            self._node.get_logger().info(chosen)

    def warn(self, text: str) -> None:
        """Log a warning."""
        self._node.get_logger().warning(text)

    def attend(self, now: float) -> None:
        """Learn from the servo what is not known yet."""
        node = self._node
        node.link.serve(now)
        node.teleop.joints = len(node.link.names.joints) or None

    def flush(self) -> None:
        """See the last motions off."""
        self._node.link.flush()


def main() -> int:
    """Run until Ctrl-C; return the exit code."""
    return run_gamepad('servo_gamepad', ServoGamepad, Session, ArmError)


if __name__ == '__main__':
    sys.exit(main())
