# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run quad_teleop teleop_gamepad``: drive with a gamepad, while the deadman is held."""

from __future__ import annotations

import sys
import threading
import time

from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from node_runner import destroyed_when_refused, ParameterReader, refuse_misspelt, run_program
from operator_input import OperatorInputError
from operator_input.devices import InputDevices, KernelDevices
from operator_input.gamepad import (
    AUTO,
    Deadman,
    DEADMAN_BUTTONS,
    Gamepad,
    GamepadSession,
    GamepadState,
)

from ..exceptions import TeleopError
from ..gamepad_teleop import GamepadTeleop
from ..requests import ClearFault, ModeRequest, PoseRequest, Request
from ..speeds import Speeds
from ..velocity import Velocity
from .controller import Controller
from .outputs import Outputs
from .settings import declare_speeds, declare_steps, declare_stream

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
                timeout=read.number(
                    'deadman_timeout', 3.0, (0.5, 3600.0), 'without any change of the gamepad [s]'
                ),
                full_deflection_timeout=read.number(
                    'deadman_full_deflection_timeout',
                    10.0,
                    (0.5, 3600.0),
                    'the same, what is deflected at its end [s]',
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


class Session(GamepadSession[Velocity]):
    """One person with one gamepad, and the controller."""

    def __init__(self, node: TeleopGamepad, stop: threading.Event) -> None:
        """Prepare.

        Args:
            node: The node.
            stop: Ends it.
        """
        super().__init__(node.gamepad, node.teleop, stop)
        self._node = node
        self._controller = Controller(node, node.get_logger().info)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(node)

    def publish(self, command: Velocity) -> None:
        """Publish a velocity."""
        self._node.outputs.publish(command)

    def take(self, state: GamepadState) -> None:
        """Do what the buttons ask for."""
        for request in self._node.teleop.feed(state):
            self._obey(request)

    def warn(self, text: str) -> None:
        """Log a warning."""
        self._node.get_logger().warning(text)

    def attend(self, now: float) -> None:
        """Take answers of the controller."""
        self._executor.spin_once(timeout_sec=0)
        self._controller.check(now)

    def flush(self) -> None:
        """See the last velocities off."""
        self._node.outputs.flush()

    def close(self) -> None:
        """Serve the node no more."""
        self._executor.shutdown()

    def _obey(self, request: Request) -> None:
        match request:
            case ModeRequest(mode):
                self._controller.ask_mode(mode, time.monotonic())
            case PoseRequest(pose):
                self._node.outputs.publish_pose(pose)
            case ClearFault():
                self._controller.clear_fault(time.monotonic())
            case _:
                self.warn(f'{request} is nothing that a gamepad can do')


def main() -> int:
    """Run until Ctrl-C; return the exit code."""
    return run_program('teleop_gamepad', _serve, TeleopError, OperatorInputError)


def _serve(stop: threading.Event) -> None:
    node = TeleopGamepad()
    Session(node, stop).run()
    node.destroy_node()


if __name__ == '__main__':
    sys.exit(main())
