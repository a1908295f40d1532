# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_servo servo_gamepad``: jog an arm with a gamepad, while the deadman is held."""

from __future__ import annotations

import select
import sys
import threading
import time

from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from node_runner import destroyed_when_refused, ParameterReader, refuse_misspelt, run_program
from operator_input import CommandStream, OperatorInputError
from operator_input.command_stream import RESTS
from operator_input.devices import InputDevices, KernelDevices
from operator_input.gamepad import AUTO, Deadman, DEADMAN_BUTTONS, Gamepad

from ..exceptions import ServoError
from .gamepad_teleop import GamepadTeleop
from .jog import rest_of
from .servo_link import ServoLink

LONGEST_WAIT = 0.1  # [s] for which answers of services and a signal may wait


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
        """
        super().__init__('servo_gamepad')
        read = ParameterReader(self)
        rate = read.number('rate', 50.0, (10.0, 500.0), 'commands per second [Hz]')
        self.teleop = GamepadTeleop(
            read.number('speed', 0.3, (0.01, 1.0), "share of the servo's full speed"),
            read.number('turbo_speed', 1.0, (0.01, 1.0), 'the same with the turbo button'),
            Deadman(
                enable=read.choice(
                    'enable_button', 'left_shoulder', DEADMAN_BUTTONS, 'held to move'
                ),
                turbo=read.choice(
                    'turbo_button', 'right_shoulder', DEADMAN_BUTTONS, 'held to move fast'
                ),
            ),
            CommandStream(1.0 / rate, rest_of),
        )
        servo = read.text('servo', '/servo_node', 'name of the servo node')
        base = read.text('base_frame', '', "base frame; empty takes the arm's base link")
        tool = read.text('tool_frame', '', "tool frame; empty takes the arm's tip link")
        preset = read.text('preset', AUTO, 'auto, xbox, ps or generic')
        device = read.text('device', '', 'path, or expression for the name; empty for any')
        dead_zone = read.number('deadzone', 0.08, (0.0, 0.9), 'share of the way that is rest')
        refuse_misspelt(self)
        say = self.get_logger().info
        self.link = ServoLink(self, servo, say, base, tool)
        self.gamepad = Gamepad(
            devices or KernelDevices(), preset=preset, device=device, dead_zone=dead_zone, say=say
        )


class Session:
    """Reads and publishes."""

    def __init__(self, node: ServoGamepad, stop: threading.Event) -> None:
        """Prepare.

        Args:
            node: The node.
            stop: Ends it.
        """
        self._node = node
        self._stop = stop
        self._executor = SingleThreadedExecutor(context=node.context)
        self._executor.add_node(node)

    def run(self) -> None:
        """Serve until the event is set."""
        node = self._node
        node.gamepad.scan(time.monotonic())
        if not node.gamepad.is_connected:
            problem = KernelDevices().problem() or 'plug one in, or switch it on'
            node.get_logger().warning(f'no gamepad yet: {problem}')
        try:
            while not self._stop.is_set():
                self._serve()
        finally:
            node.gamepad.close()
            self._end()
            self._executor.shutdown()

    def _serve(self) -> None:
        node, now = self._node, time.monotonic()
        node.gamepad.scan(now)
        wait = min(max(node.teleop.due() - now, 0.0), LONGEST_WAIT)
        select.select(node.gamepad.filenos(), [], [], wait)
        for state in node.gamepad.read():
            if chosen := node.teleop.feed(state):
                node.get_logger().info(chosen)
            self._publish()
        self._publish()
        self._executor.spin_once(timeout_sec=0)
        node.link.serve(time.monotonic())
        node.teleop.joints = len(node.link.names.joints) or None

    def _publish(self) -> None:
        jog = self._node.teleop.step(time.monotonic())
        if jog is not None:
            self._node.link.publish(jog)

    def _end(self) -> None:
        """Publish the last rests, and see them off."""
        teleop = self._node.teleop
        teleop.end()
        for _ in range(RESTS):
            self._publish()
            pause = teleop.due() - time.monotonic()
            if 0.0 < pause < LONGEST_WAIT:
                time.sleep(pause)
        self._node.link.flush()


def main() -> int:
    """Run until Ctrl-C; return the exit code."""
    return run_program('servo_gamepad', _serve, ServoError, OperatorInputError)


def _serve(stop: threading.Event) -> None:
    node = ServoGamepad()
    Session(node, stop).run()
    node.destroy_node()


if __name__ == '__main__':
    sys.exit(main())
