# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_servo servo_keyboard_input``: jog an arm with the keys of a terminal."""

from __future__ import annotations

import sys
import threading

from arm_model import ArmError
from node_runner import destroyed_when_refused, ParameterReader, refuse_misspelt
from operator_input import CommandStream, Keyboard, KeyboardSession
from operator_input.ros import KeyboardNode, run_keyboard

from .jog import Jog, rest_of
from .key_map import HELP
from .keyboard_teleop import KeyboardTeleop
from .requests import Request, StopRobot, SwitchType, TogglePause
from .scales import Steps
from .screen import status, View
from .servo_link import declare_link, ServoLink


class ServoKeyboardInput(KeyboardNode):
    """The node, with what its parameters say.

    Attributes:
        teleop: Decides what to publish.
        link: Whom it jogs.
    """

    @destroyed_when_refused
    def __init__(self) -> None:
        """Declare the parameters.

        Raises:
            ParameterError: A parameter is misspelt or makes no sense.
        """
        super().__init__('servo_keyboard_input')
        self.link = declare_link(self)
        read = ParameterReader(self)
        speed = read.number('speed', 0.5, (0.01, 1.0), "share of the servo's full speed")
        steps = Steps(
            read.number('linear_step', 1e-3, (1e-5, 0.1), 'single step of the tool [m]'),
            read.number('angular_step', 0.01745, (1e-4, 0.5), 'single step [rad]'),
        )
        held, stream = self.keyboard.held_keys(), CommandStream(self.link.period, rest_of)
        self.teleop = KeyboardTeleop(speed, steps, held, stream)
        refuse_misspelt(self)


class Session(KeyboardSession[Jog, Request]):
    """One person at one terminal, and the servo."""

    def __init__(
        self, node: ServoKeyboardInput, keyboard: Keyboard, stop: threading.Event
    ) -> None:
        """Prepare.

        Args:
            node: The node.
            keyboard: Open keyboard.
            stop: Ends it.
        """
        super().__init__(keyboard, node.teleop, HELP, stop)
        self._teleop = node.teleop
        self._link = ServoLink(node, node.link, self.line.message)

    def publish(self, command: Jog) -> None:
        """Publish a motion."""
        self._link.publish(command)

    def handle(self, request: Request) -> None:
        """Ask the servo."""
        match request:
            case SwitchType(command_type):
                self._link.switch(command_type)
            case TogglePause():
                self._link.toggle_pause()
            case StopRobot():
                self._link.stop_robot()

    def attend(self, now: float) -> None:
        """Learn from the servo what is not known yet."""
        self._link.serve(now)
        self._teleop.scales = self._link.scales
        self._teleop.joints = len(self._link.names.joints) or None

    def show(self, now: float) -> None:
        """Show how it is."""
        teleop, link = self._teleop, self._link
        view = View(
            link.status(now),
            link.names,
            link.scales,
            teleop.speed,
            teleop.frame,
            teleop.sign,
            teleop.stepping,
            link.paused,
            teleop.wanted(now),
            self.keyboard.release_source,
            link.has_subscriber,
        )
        self.line.show(status(view, self.colour))

    def flush(self) -> None:
        """See the last motions off."""
        self._link.flush()


def main() -> int:
    """Run until Ctrl-C; return the exit code."""
    return run_keyboard('servo_keyboard_input', ServoKeyboardInput, Session, ArmError)


if __name__ == '__main__':
    sys.exit(main())
