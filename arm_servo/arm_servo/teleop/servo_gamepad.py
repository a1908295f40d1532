# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_servo servo_gamepad``: jog an arm with a gamepad, while the deadman is held."""

from __future__ import annotations

import difflib
import select
import threading
import time

from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from operator_input import CommandStream
from operator_input.command_stream import RESTS
from operator_input.devices import InputDevices, KernelDevices
from operator_input.gamepad import AUTO, Button, Deadman, Gamepad

from ..nodes.declare import Declarations
from .exceptions import SettingError
from .gamepad_teleop import GamepadTeleop
from .jog import rest_of
from .program import refuse_misspelt, run
from .servo_link import ServoLink

LONGEST_WAIT = 0.1  # [s] for which answers of services and a signal may wait
NO_BUTTON = 'none'


class ServoGamepad(Node):
    """The node, with what its parameters say.

    Attributes:
        teleop: Decides what to publish.
        link: The servo.
        gamepad: What is read.
    """

    def __init__(self, devices: InputDevices | None = None) -> None:
        """Declare the parameters and advertise the topics.

        Args:
            devices: Where gamepads are; those of this machine when it is None.

        Raises:
            SettingError: A parameter is misspelt or makes no sense.
            PresetError: There is no preset of that name.
        """
        super().__init__('servo_gamepad')
        declare = Declarations(self)
        rate = declare.number('rate', 50.0, 'commands per second [Hz]', (10.0, 500.0))
        self.teleop = GamepadTeleop(
            declare.number('speed', 0.3, "share of the servo's full speed", (0.01, 1.0)),
            declare.number('turbo_speed', 1.0, 'the same with the turbo button', (0.01, 1.0)),
            Deadman(
                enable=_button(declare, 'enable_button', Button.LEFT_SHOULDER, 'held to move'),
                turbo=_button(declare, 'turbo_button', Button.RIGHT_SHOULDER, 'held to move fast'),
            ),
            CommandStream(1.0 / rate, rest_of),
        )
        servo = declare.text('servo', '/servo_node', 'name of the servo node')
        base = declare.text('base_frame', '', "base frame; empty takes the arm's base link")
        tool = declare.text('tool_frame', '', "tool frame; empty takes the arm's tip link")
        preset = declare.text('preset', AUTO, 'auto, xbox, ps or generic')
        device = declare.text('device', '', 'path, or expression for the name; empty for any')
        dead_zone = declare.number('deadzone', 0.08, 'share of the way that is rest', (0.0, 0.9))
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


def _button(declare: Declarations, name: str, default: Button, meaning: str) -> Button | None:
    names = {button.value: button for button in Button}
    value = declare.text(name, default.value, f'{meaning}; {", ".join(names)} or {NO_BUTTON}')
    if value == NO_BUTTON:
        return None
    if value not in names:
        close = difflib.get_close_matches(value, names, n=1)
        wanted = f'did you mean {close[0]!r}?' if close else f'there are {", ".join(names)}'
        raise SettingError(f'{name} is {value!r}, which is no button; {wanted}')
    return names[value]


def main() -> None:
    """Entry point."""
    run(lambda stop: Session(ServoGamepad(), stop).run())


if __name__ == '__main__':
    main()
