# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the master sends periodically beside PDOs: SYNC, its heartbeat and TIME."""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime, timezone
from typing import TypeAlias

from ..can.frame import Frame
from ..standard.cob_id import CobId
from ..standard.nmt import NmtState
from ..standard.time_of_day import encode_time_of_day
from .bus_sender import Send

WallClock: TypeAlias = Callable[[], datetime]


def utc_now() -> datetime:
    """Return the time of day."""
    return datetime.now(timezone.utc)


class Periodic:
    """Returns when something periodic is due; after a pause the series begins anew.

    So nothing is made up for, and nothing crowds.
    """

    def __init__(self, period: float) -> None:
        """Take the period in [s]; 0 for never."""
        self._period = period
        self._next = 0.0

    def is_due(self, now: float) -> bool:
        """Return whether it is time; then the next time is a period later."""
        if self._period <= 0.0 or now < self._next:
            return False
        due = self._next + self._period
        self._next = due if due > now else now + self._period
        return True


class HeartbeatProducer:
    """The master's heartbeat, sent with the set-points, so that it ends when they do."""

    def __init__(self, node_id: int, period: float, send: Send) -> None:
        """Take node id, period in [s] and the way to the bus."""
        self._can_id = CobId.HEARTBEAT + node_id
        self._periodic = Periodic(period)
        self._send = send

    def advance(self, now: float, state: NmtState) -> None:
        """Send it when it is due."""
        if self._periodic.is_due(now):
            self._send(Frame(self._can_id, bytes((state,))))


class TimeProducer:
    """TIME, the time of day for all devices (CiA 301, 7.2.6)."""

    def __init__(self, can_id: int, period: float, wall_clock: WallClock, send: Send) -> None:
        """The ``period`` is in [s], 0 for none; ``wall_clock`` returns a time with its zone."""
        self._can_id = can_id
        self._periodic = Periodic(period)
        self._wall_clock = wall_clock
        self._send = send

    def advance(self, now: float) -> None:
        """Send it when it is due, at a steady time in [s]."""
        if self._periodic.is_due(now):
            self._send(Frame(self._can_id, encode_time_of_day(self._wall_clock())))


class SyncCounter:
    """The counter in SYNC (CiA 301, 7.2.5.2.2)."""

    def __init__(self, overflow: int) -> None:
        """Take the highest value; 0 for a SYNC without counter."""
        self._overflow = overflow
        self._value = 0

    def next(self) -> bytes:
        """Return the data of the next SYNC."""
        if not self._overflow:
            return b''
        self._value = self._value % self._overflow + 1
        return bytes((self._value,))
