# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""NMT commands one after another, as far apart as the inhibit time demands (CiA 301, 0x102A)."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import TypeAlias

from canopen_core import BusError
from canopen_core.can import Frame
from canopen_core.standard import ALL_NODES, CobId, nmt_frame, NmtCommand

from .bus_sender import Send
from .scheduler import Promise, Scheduler

SendNmt: TypeAlias = Callable[[NmtCommand, int], Promise[None]]
"""Sends a command to a node id, or to all with 0; the promise is resolved when it has left,
rejected with a BusError when the bus has not taken it."""
REPEAT_AFTER = 0.01  # [s] before a command that the bus refused is sent again
REFUSAL_TIMEOUT = 0.5  # [s] in which the bus has to take a command; it would come too late then


class NmtSender:
    """Sends NMT commands; with an inhibit time those that come too early wait in order.

    A command counts as sent when the bus has taken its frame. One whose promise was abandoned
    meanwhile does not leave any more.
    """

    def __init__(
        self,
        scheduler: Scheduler,
        send: Send,
        inhibit_time: float,
        on_sent: Callable[[NmtCommand, int], None],
    ) -> None:
        """``inhibit_time`` is the shortest time between two commands in [s], 0 for none.

        ``on_sent`` gets each command and its node id when it leaves.
        """
        self._scheduler = scheduler
        self._send = send
        self._inhibit_time = inhibit_time
        self._on_sent = on_sent
        self._waiting: deque[tuple[NmtCommand, int, Promise[None]]] = deque()
        self._busy = False

    def send(self, command: NmtCommand, node_id: int) -> Promise[None]:
        """Send a command to one device, or to all with id 0; done when it has left."""
        sent: Promise[None] = Promise()
        self._waiting.append((command, node_id, sent))
        if not self._busy:
            self._scheduler.background(self._empty())
        return sent

    async def _empty(self) -> None:
        self._busy = True
        refused_since: float | None = None
        try:
            while self._waiting:
                command, node_id, sent = self._waiting.popleft()
                if sent.done:
                    continue  # withdrawn
                refusal = self._send(Frame(CobId.NMT, nmt_frame(command, node_id)))
                if refusal is None:
                    refused_since = None
                    self._on_sent(command, node_id)
                    sent.resolve(None)
                    if self._inhibit_time > 0.0:
                        await self._scheduler.timer(self._inhibit_time)
                    continue
                refused_since = refused_since or self._scheduler.now
                if self._scheduler.now - refused_since < REFUSAL_TIMEOUT:
                    self._waiting.appendleft((command, node_id, sent))
                    await self._scheduler.timer(REPEAT_AFTER)
                    continue
                where = 'all nodes' if node_id == ALL_NODES else f'node {node_id}'
                sent.reject(BusError(f'NMT {command.name} to {where} was not sent: {refusal}'))
        finally:
            self._busy = False
