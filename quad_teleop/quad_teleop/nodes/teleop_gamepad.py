# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run quad_teleop teleop_gamepad``: drive with a gamepad, while the deadman is held."""

from __future__ import annotations

import sys
import threading
import time

from node_runner import destroyed_when_refused, refuse_misspelt
from operator_input.devices import InputDevices
from operator_input.gamepad import GamepadSession, GamepadState
from operator_input.ros import GamepadNode, run_gamepad

from ..exceptions import TeleopError
from ..gamepad_teleop import GamepadTeleop
from ..requests import ClearFault, ModeRequest, PoseRequest, Request
from ..speeds import Speeds
from ..velocity import Velocity
from .controller import Controller
from .outputs import Outputs
from .settings import declare_speeds, declare_steps, declare_stream

NORMAL, TURBO = Speeds(0.15, 0.6), Speeds(0.3, 1.2)


class TeleopGamepad(GamepadNode):
    """Publishes velocities and body poses, and requests modes.

    Attributes:
        teleop: Decides what to publish.
        outputs: Publishes it.
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
        super().__init__('teleop_gamepad', devices)
        self.outputs = Outputs(self)
        self.teleop = GamepadTeleop(
            declare_speeds(self, '', NORMAL),
            declare_speeds(self, 'turbo_', TURBO),
            self.deadman,
            declare_steps(self),
            declare_stream(self),
        )
        refuse_misspelt(self)


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

    def publish(self, command: Velocity) -> None:
        """Publish a velocity."""
        self._node.outputs.publish(command)

    def take(self, state: GamepadState) -> None:
        """Do what the buttons request."""
        for request in self._node.teleop.feed(state):
            self._handle(request)

    def warn(self, text: str) -> None:
        """Log a warning."""
        self._node.get_logger().warning(text)

    def attend(self, now: float) -> None:
        """Take answers of the controller."""
        self._controller.check(now)

    def flush(self) -> None:
        """See the last velocities off."""
        self._node.outputs.flush()

    def _handle(self, request: Request) -> None:
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
    return run_gamepad('teleop_gamepad', TeleopGamepad, Session, TeleopError)


if __name__ == '__main__':
    sys.exit(main())
