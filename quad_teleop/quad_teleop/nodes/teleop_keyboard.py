# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run quad_teleop teleop_keyboard``: drive with the keys of a terminal."""

from __future__ import annotations

import sys
import threading
import time

from node_runner import destroyed_when_refused, refuse_misspelt
from operator_input import Keyboard, KeyboardSession
from operator_input.ros import KeyboardNode, run_keyboard

from ..exceptions import TeleopError
from ..key_map import HELP
from ..keyboard_teleop import KeyboardTeleop
from ..requests import ClearFault, ModeRequest, PoseRequest, Request, StopRobot
from ..speeds import Speeds
from ..velocity import Velocity
from .controller import Controller
from .outputs import Outputs
from .screen import hint, status, View
from .settings import declare_speeds, declare_steps, declare_stream


class TeleopKeyboard(KeyboardNode):
    """Publishes velocities and body poses, and requests modes.

    Attributes:
        teleop: Decides what to publish.
        outputs: Publishes it.
    """

    @destroyed_when_refused
    def __init__(self) -> None:
        """Declare the parameters and advertise the topics.

        Raises:
            ParameterError: A parameter is misspelt, of another kind or out of its range.
            SettingError: Parameters make no sense together.
        """
        super().__init__('teleop_keyboard')
        self.outputs = Outputs(self)
        self.teleop = KeyboardTeleop(
            declare_speeds(self, '', Speeds()),
            declare_steps(self),
            self.keyboard.held_keys(),
            declare_stream(self),
        )
        refuse_misspelt(self)


class Session(KeyboardSession[Velocity, Request]):
    """One person at one terminal, and the controller."""

    def __init__(self, node: TeleopKeyboard, keyboard: Keyboard, stop: threading.Event) -> None:
        """Prepare.

        Args:
            node: The node.
            keyboard: Open keyboard.
            stop: Ends it.
        """
        super().__init__(keyboard, node.teleop, HELP, stop)
        self._node = node
        self._controller = Controller(node, self.line.message)
        self._hint = ''

    def publish(self, command: Velocity) -> None:
        """Publish a velocity."""
        self._node.outputs.publish(command)

    def handle(self, request: Request) -> None:
        """Ask the controller."""
        match request:
            case ModeRequest(mode):
                self._controller.ask_mode(mode, time.monotonic())
            case StopRobot():
                self._controller.stop(time.monotonic())
            case ClearFault():
                self._controller.clear_fault(time.monotonic())
            case PoseRequest(pose):
                self._node.outputs.publish_pose(pose)

    def attend(self, now: float) -> None:
        """Take answers of the controller."""
        self._controller.check(now)

    def show(self, now: float) -> None:
        """Show how it is, and say what keeps the robot from moving."""
        teleop = self._node.teleop
        view = View(
            self._controller.mode,
            self._controller.report(now),
            teleop.speeds,
            teleop.wanted(now),
            teleop.pose,
            self.keyboard.release_source,
            self._node.outputs.has_subscriber,
        )
        text = hint(view)
        if text and text != self._hint:
            self.line.message(text)
        if text or view.velocity:  # said once for each reason, and again after the next motion
            self._hint = text
        self.line.show(status(view, self.colour))

    def flush(self) -> None:
        """See the last velocities off."""
        self._node.outputs.flush()


def main() -> int:
    """Run until Ctrl-C; return the exit code."""
    return run_keyboard('teleop_keyboard', TeleopKeyboard, Session, TeleopError)


if __name__ == '__main__':
    sys.exit(main())
