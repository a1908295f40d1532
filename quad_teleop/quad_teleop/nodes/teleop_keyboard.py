# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run quad_teleop teleop_keyboard``: drive with the keys of a terminal."""

from __future__ import annotations

from collections.abc import Iterable
import os
import signal
import sys
import threading
import time

from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from node_runner import destroyed_when_refused, ParameterReader, refuse_misspelt, run_program
from operator_input import (
    AutoRepeat,
    HeldKeys,
    Keyboard,
    KeyEvent,
    OperatorInputError,
    StatusLine,
)

from ..command_stream import ZEROS
from ..exceptions import TeleopError
from ..key_map import HELP
from ..keyboard_teleop import KeyboardTeleop
from ..requests import ClearFault, ModeRequest, Note, PoseRequest, Quit, Request, Suspend
from ..speeds import Speeds
from .controller import Controller
from .outputs import Outputs
from .screen import hint, status, View
from .settings import declare_speeds, declare_steps, declare_stream

LONGEST_WAIT = 0.1  # [s] for which answers of services and a signal may wait


class TeleopKeyboard(Node):
    """Publishes velocities and body poses, and asks for modes.

    Attributes:
        teleop: Decides what to publish.
        outputs: Publishes it.
        kitty: Ask the terminal for releases.
        evdev: Ask this machine's keyboards for releases.
    """

    @destroyed_when_refused
    def __init__(self) -> None:
        """Declare the parameters and advertise the topics.

        Raises:
            ParameterError: A parameter is misspelt, of another kind or out of its range.
            SettingError: Parameters make no sense together.
        """
        super().__init__('teleop_keyboard')
        read = ParameterReader(self)
        first = read.number('first_timeout', 0.5, (0.05, 2.0), 'first time-out of a key [s]')
        repeat = read.number('repeat_timeout', 0.15, (0.05, 1.0), 'time-out of its repeats [s]')
        self.kitty = read.flag('kitty', 'ask the terminal for true key releases', default=True)
        self.evdev = read.flag('evdev', "ask this machine's keyboards for them", default=True)
        self.outputs = Outputs(self)
        self.teleop = KeyboardTeleop(
            declare_speeds(self, '', Speeds()),
            declare_steps(self),
            HeldKeys(AutoRepeat(max(first, repeat), repeat)),
            declare_stream(self),
        )
        refuse_misspelt(self)


class Session:
    """One person at one terminal: reads, publishes, shows."""

    def __init__(self, node: TeleopKeyboard, keyboard: Keyboard, stop: threading.Event) -> None:
        """Prepare.

        Args:
            node: The node.
            keyboard: Open keyboard.
            stop: Ends it.
        """
        self._node = node
        self._keyboard = keyboard
        self._stop = stop
        self._line: StatusLine = keyboard.status_line()
        self._controller = Controller(node, self._line.say)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(node)
        self._colour = not os.environ.get('NO_COLOR')
        self._hint = ''

    def run(self) -> None:
        """Serve until the person quits or the event is set.

        Raises:
            TerminalError: The window was closed.
        """
        self._line.say(HELP)
        try:
            while not self._stop.is_set():
                self._serve()
        finally:
            self._end()
            self._executor.shutdown()

    def _serve(self) -> None:
        now = time.monotonic()
        wait = min(self._node.teleop.due(now) - now, LONGEST_WAIT)
        self._take(self._keyboard.wait(wait))
        now = time.monotonic()
        self._publish(now)
        self._executor.spin_once(timeout_sec=0)
        self._controller.check(now)
        self._show(now)

    def _take(self, events: Iterable[KeyEvent]) -> None:
        for event in events:
            requests = self._node.teleop.feed(event)
            # at once: of a press and a release in one reading, both are published
            self._publish(event.time)
            for request in requests:
                self._obey(request)

    def _obey(self, request: Request) -> None:
        match request:
            case ModeRequest(mode):
                self._controller.ask_mode(mode, time.monotonic())
            case ClearFault():
                self._controller.clear_fault(time.monotonic())
            case PoseRequest(pose):
                self._node.outputs.publish_pose(pose)
            case Note(text):
                self._line.say(text)
            case Quit():
                self._stop.set()
            case Suspend():
                self._suspend()

    def _publish(self, now: float) -> None:
        velocity = self._node.teleop.step(now)
        if velocity is not None:
            self._node.outputs.publish(velocity)

    def _show(self, now: float) -> None:
        teleop = self._node.teleop
        view = View(
            self._controller.mode,
            self._controller.report(now),
            teleop.speeds,
            teleop.wanted(now),
            teleop.pose,
            self._keyboard.release_source,
            self._node.outputs.is_heard,
        )
        text = hint(view)
        if text and text != self._hint:
            self._line.say(text)
        if text or view.velocity:  # said once for each reason, and again after the next motion
            self._hint = text
        self._line.show(status(view, self._colour))

    def _suspend(self) -> None:
        self._end()
        with self._keyboard.paused():
            os.killpg(0, signal.SIGTSTP)  # goes on here after the shell's fg
        self._line.say('going on')

    def _end(self) -> None:
        """Publish the last zeros, and see them off."""
        self._node.teleop.end()
        for _ in range(ZEROS):
            now = time.monotonic()
            self._publish(now)
            pause = self._node.teleop.due(now) - now
            if 0.0 < pause < LONGEST_WAIT:
                time.sleep(pause)
        self._node.outputs.flush()
        self._show(time.monotonic())
        self._line.end()


def main() -> int:
    """Run until Ctrl-C; return the exit code."""
    errors = TeleopError, OperatorInputError
    # a second Ctrl-C must not leave the terminal as the program has it
    return run_program('teleop_keyboard', _serve, *errors, patient=True)


def _serve(stop: threading.Event) -> None:
    node = TeleopKeyboard()
    with Keyboard(kitty=node.kitty, evdev=node.evdev) as keyboard:
        Session(node, keyboard, stop).run()
    node.destroy_node()


if __name__ == '__main__':
    sys.exit(main())
