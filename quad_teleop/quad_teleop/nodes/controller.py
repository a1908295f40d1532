# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The controller as teleop programs see it: requests to it, and its reports."""

from __future__ import annotations

from collections.abc import Callable
import math
import time

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.node import Node
from std_srvs.srv import Trigger

from quad_msgs.srv import SetMode

from ..controller_report import ControllerReport, read_report
from ..modes import Mode
from .command_client import CommandClient, KEY_REPEAT_TIME


class Controller:
    """Client of ``set_mode``, ``stop`` and ``controller_node/clear_fault``; reads /diagnostics.

    Attributes:
        mode: The mode that was granted last; None before.
    """

    def __init__(self, node: Node, show: Callable[[str], None]) -> None:
        """Make the clients.

        Args:
            node: The node; somebody has to spin it for answers to arrive.
            show: Receives the answers, and why there is none.
        """
        self.mode: Mode | None = None
        self._report: ControllerReport | None = None
        self._show = show
        self._shown, self._shown_at = '', -math.inf
        self._modes = CommandClient(node, SetMode, 'set_mode', self._show_once, self._granted)
        self._faults = CommandClient(node, Trigger, 'controller_node/clear_fault', self._show_once)
        self._stops = CommandClient(
            node, Trigger, 'stop', self._show_once, self._stopped, drops_repeats=False
        )
        node.create_subscription(DiagnosticArray, 'diagnostics', self._take, 10)

    def ask_mode(self, mode: Mode, now: float) -> None:
        """Request a mode.

        Args:
            mode: Which.
            now: Time [s].
        """
        self._modes.request(mode.value, SetMode.Request(mode=mode.value), now)

    def clear_fault(self, now: float) -> None:
        """Ask to forget the latched faults.

        Args:
            now: Time [s].
        """
        self._faults.request('clear fault', Trigger.Request(), now)

    def stop(self, now: float) -> None:
        """Stop the whole robot, each time; a mode that was requested before is not any more.

        Args:
            now: Time [s].
        """
        self._modes.cancel()
        self._stops.request('stop', Trigger.Request(), now)

    def report(self, now: float) -> ControllerReport | None:
        """Return what the controller said last; None when that is long ago.

        Args:
            now: Time [s].
        """
        report = self._report
        return report if report is not None and report.is_fresh(now) else None

    def check(self, now: float) -> None:
        """Send and give up what is due.

        Args:
            now: Time [s].
        """
        self._modes.check(now)
        self._faults.check(now)
        self._stops.check(now)

    def _show_once(self, text: str) -> None:
        """Show an answer, but not again for each repetition of a key that is held."""
        now = time.monotonic()
        if text != self._shown or now - self._shown_at >= KEY_REPEAT_TIME:
            self._show(text)
        self._shown, self._shown_at = text, now

    def _stopped(self, _: str) -> None:
        self.mode = None  # the controller knows

    def _granted(self, mode: str) -> None:
        self.mode = Mode(mode)

    def _take(self, message: DiagnosticArray) -> None:
        for status in message.status:
            values = {entry.key: entry.value for entry in status.values}
            level = int.from_bytes(status.level, 'little')
            report = read_report(status.name, level, status.message, values, time.monotonic())
            self._report = report or self._report
