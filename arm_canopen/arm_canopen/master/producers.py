# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the master sends periodically beside SYNC and PDOs: its heartbeat and TIME."""

from __future__ import annotations

from collections.abc import Callable

from canopen_core.can import Frame

from .bus_sender import Send


class PeriodicFrame:
    """A frame that is sent periodically; after a pause the series begins anew.

    So nothing is made up for, and nothing crowds.
    """

    def __init__(self, can_id: int, period: float, data: Callable[[], bytes], send: Send) -> None:
        """Send ``data`` with an identifier every ``period`` in [s]; 0 for never."""
        self._can_id = can_id
        self._period = period
        self._data = data
        self._send = send
        self._next = 0.0

    def advance(self, now: float) -> None:
        """Send it when it is due."""
        if self._period <= 0.0 or now < self._next:
            return
        due = self._next + self._period
        self._next = due if due > now else now + self._period
        self._send(Frame(self._can_id, self._data()))
