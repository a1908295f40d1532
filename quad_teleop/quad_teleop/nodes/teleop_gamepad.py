# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run quad_teleop teleop_gamepad``: drive with a gamepad, while the deadman is held."""

from __future__ import annotations

import select
import sys
import threading
import time

from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from node_runner import destroyed_when_refused, ParameterReader, refuse_misspelt, run_program
from operator_input import OperatorInputError
from operator_input.devices import InputDevices, KernelDevices
from operator_input.gamepad import AUTO, Deadman, DEADMAN_BUTTONS, Gamepad

from ..command_stream import ZEROS
from ..exceptions import TeleopError
from ..gamepad_teleop import GamepadTeleop
from ..requests import ModeRequest, PoseRequest, Request
from ..speeds import Speeds
from .controller import Controller
from .outputs import Outputs
from .settings import declare_speeds, declare_steps, declare_stream

LONGEST_WAIT = 0.1  # [s] for which answers of services and a signal may wait
NORMAL, TURBO = Speeds(0.15, 0.6), Speeds(0.3, 1.2)


class TeleopGamepad(Node):
    """Publishes velocities and body poses, and asks for modes.

    Attributes:
        teleop: Decides what to publish.
        outputs: Publishes it.
        gamepad: What is read.
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
        read = ParameterReader(self)
        self.outputs = Outputs(self)
        self.teleop = GamepadTeleop(
            declare_speeds(self, '', NORMAL),
            declare_speeds(self, 'turbo_', TURBO),
            Deadman(
                enable=read.choice(
                    'enable_button', 'left_shoulder', DEADMAN_BUTTONS, 'held to move'
                ),
                turbo=read.choice(
                    'turbo_button', 'right_shoulder', DEADMAN_BUTTONS, 'held to move fast'
                ),
            ),
            declare_steps(self),
            declare_stream(self),
        )
        preset = read.text('preset', AUTO, 'auto, xbox, ps or generic')
        device = read.text('device', '', 'path, or expression for the name; empty for any')
        dead_zone = read.number('deadzone', 0.08, (0.0, 0.9), 'share of the way that is rest')
        refuse_misspelt(self)
        say = self.get_logger().info
        self.gamepad = Gamepad(
            devices or KernelDevices(), preset=preset, device=device, dead_zone=dead_zone, say=say
        )


class Session:
    """Reads, publishes, asks."""

    def __init__(self, node: TeleopGamepad, stop: threading.Event) -> None:
        """Prepare.

        Args:
            node: The node.
            stop: Ends it.
        """
        self._node = node
        self._stop = stop
        self._controller = Controller(node, node.get_logger().info)
        self._executor = SingleThreadedExecutor()
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
            for request in node.teleop.feed(state):
                self._obey(request)
            self._publish()
        self._publish()
        self._executor.spin_once(timeout_sec=0)
        self._controller.check(time.monotonic())

    def _obey(self, request: Request) -> None:
        match request:
            case ModeRequest(mode):
                self._controller.ask_mode(mode, time.monotonic())
            case PoseRequest(pose):
                self._node.outputs.publish_pose(pose)
            case _:
                self._node.get_logger().warning(f'{request} is nothing that a gamepad can do')

    def _publish(self) -> None:
        velocity = self._node.teleop.step(time.monotonic())
        if velocity is not None:
            self._node.outputs.publish(velocity)

    def _end(self) -> None:
        """Publish the last zeros, and see them off."""
        self._node.teleop.end()
        for _ in range(ZEROS):
            self._publish()
            pause = self._node.teleop.due() - time.monotonic()
            if 0.0 < pause < LONGEST_WAIT:
                time.sleep(pause)
        self._node.outputs.flush()


def main() -> int:
    """Run until Ctrl-C; return the exit code."""
    return run_program('teleop_gamepad', _serve, TeleopError, OperatorInputError)


def _serve(stop: threading.Event) -> None:
    node = TeleopGamepad()
    Session(node, stop).run()
    node.destroy_node()


if __name__ == '__main__':
    sys.exit(main())
