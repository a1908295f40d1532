# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_servo servo_gamepad``: jog an arm with a gamepad, while the deadman is held."""

from __future__ import annotations

import sys
import threading

from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from arm_model import ArmError
from node_runner import destroyed_when_refused, ParameterReader, refuse_misspelt
from operator_input import CommandStream
from operator_input.devices import InputDevices
from operator_input.gamepad import GamepadSession, GamepadState
from operator_input.ros import declare_deadman, declare_gamepad, run_gamepad

from .gamepad_teleop import GamepadTeleop
from .jog import Jog, rest_of
from .servo_link import ServoLink


class ServoGamepad(Node):
    """The node, with what its parameters say.

    Attributes:
        teleop: Decides what to publish.
        link: The servo.
        gamepad: What is read.
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
        super().__init__('servo_gamepad')
        read = ParameterReader(self)
        rate = read.number('rate', 50.0, (10.0, 500.0), 'commands per second [Hz]')
        self.teleop = GamepadTeleop(
            read.number('speed', 0.3, (0.01, 1.0), "share of the servo's full speed"),
            read.number('turbo_speed', 1.0, (0.01, 1.0), 'the same with the turbo button'),
            declare_deadman(self),
            CommandStream(1.0 / rate, rest_of),
        )
        servo = read.text('servo', 'servo_node', 'name of the servo node')
        base = read.text('base_frame', '', "base frame; empty takes the arm's base link")
        tool = read.text('tool_frame', '', "tool frame; empty takes the arm's tip link")
        self.gamepad = declare_gamepad(self, devices)
        refuse_misspelt(self)
        self.link = ServoLink(self, servo, self.get_logger().info, base, tool)


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
        self._executor = SingleThreadedExecutor(context=node.context)
        self._executor.add_node(node)

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
        self._executor.spin_once(timeout_sec=0)
        node.link.serve(now)
        node.teleop.joints = len(node.link.names.joints) or None

    def flush(self) -> None:
        """See the last motions off."""
        self._node.link.flush()

    def close(self) -> None:
        """Serve the node no more."""
        self._executor.shutdown()


def main() -> int:
    """Run until Ctrl-C; return the exit code."""
    return run_gamepad('servo_gamepad', ServoGamepad, Session, ArmError)


if __name__ == '__main__':
    sys.exit(main())
