# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The way of all frames of the master to the bus."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

from canopen_core import BusError
from canopen_core.can import Frame

from .events import Event, EventKind, Report, Severity

Send: TypeAlias = Callable[[Frame], BusError | None]
"""Hands a frame to the bus; returns why the bus has not taken it, None when it has."""


class BusSender:
    """Sends frames; a bus that refuses them is reported once, until it works again."""

    def __init__(self, send: Callable[[Frame], None], report: Report) -> None:
        """``send`` may raise BusError."""
        self._send = send
        self._report = report
        self._failed = False

    def send(self, frame: Frame) -> BusError | None:
        """Send a frame; return why the bus has not taken it."""
        try:
            self._send(frame)
        except BusError as error:
            if not self._failed:
                self._failed = True
                self._report(Event(EventKind.BUS, Severity.ERROR, '', str(error)))
            return error
        if self._failed:
            self._failed = False
            self._report(Event(EventKind.BUS, Severity.INFO, '', 'the bus takes frames again'))
        return None
