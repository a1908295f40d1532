# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""NMT commands one after another, as far apart as the inhibit time says (CiA 301, 0x102A)."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from ..can.frame import Frame
from ..standard.cob_id import CobId
from ..standard.nmt import nmt_frame, NmtCommand
from .scheduler import Scheduler


class NmtSender:
    """Sends NMT commands; with an inhibit time those that come too early wait in order."""

    def __init__(
        self, scheduler: Scheduler, send: Callable[[Frame], None], inhibit_time: float
    ) -> None:
        """Begin with nothing sent.

        Args:
            scheduler: Time.
            send: Hands a frame to the bus.
            inhibit_time: Shortest time between two commands in [s]; 0 for none.
        """
        self._scheduler = scheduler
        self._send = send
        self._inhibit_time = inhibit_time
        self._waiting: deque[Frame] = deque()
        self._busy = False

    def send(self, command: NmtCommand, node_id: int) -> None:
        """Send a command to one device, or to all with id 0."""
        frame = Frame(CobId.NMT, nmt_frame(command, node_id))
        if self._inhibit_time <= 0.0:
            self._send(frame)
            return
        self._waiting.append(frame)
        if not self._busy:
            self._scheduler.background(self._empty())

    async def _empty(self) -> None:
        self._busy = True
        while self._waiting:
            self._send(self._waiting.popleft())
            await self._scheduler.timer(self._inhibit_time)
        self._busy = False
