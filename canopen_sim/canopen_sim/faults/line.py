# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The line between a device and the bus, on which frames get lost or come late."""

from __future__ import annotations

from collections.abc import Callable
import heapq
import itertools
import random
import struct
from typing import NamedTuple

from arm_canopen.can.frame import Frame
from arm_canopen.standard.sdo import Abort

from ..fault import Fault, FaultInjection, Service
from ..timed import NEVER

Deliver = Callable[[Frame, float], None]

SDO_INITIATIONS = (1, 2, 5, 6)  # client command specifiers that name an object (CiA 301, 7.2.4.3)
FRAME_BYTES = 8  # [byte] of an SDO


class Traffic(NamedTuple):
    """What a frame is to its device.

    Attributes:
        service: Its kind.
        outgoing: The device sends it.
        number: Number of the PDO, from 1.
    """

    service: Service
    outgoing: bool
    number: int = 0


DELAYS = frozenset({Fault.SDO_DELAY, Fault.TPDO_DELAY, Fault.RPDO_DELAY})


class LineFault:
    """A fault of the line while it goes on.

    Attributes:
        injection: Its description.
        exhausted: It hit as many frames as it was to hit.
    """

    def __init__(self, injection: FaultInjection, node_id: int) -> None:
        """Begin; each device and fault has random numbers of its own."""
        self.injection = injection
        self._left = injection.count or None
        seed = f'{injection.seed}/{node_id}/{injection.fault.label}/{injection.pdo}'
        self._random = random.Random(seed)  # noqa: S311  # repeatable noise, no secret

    @property
    def exhausted(self) -> bool:
        """It hit as many frames as it was to hit."""
        return self._left == 0

    def hits(self, frame: Frame, traffic: Traffic) -> bool:
        """Return whether it strikes a frame, and count it."""
        if self.exhausted or not self._concerns(frame, traffic):
            return False
        probability = self.injection.probability
        if probability < 1.0 and self._random.random() >= probability:
            return False
        if self._left is not None:
            self._left -= 1
        return True

    def _concerns(self, frame: Frame, traffic: Traffic) -> bool:
        injection = self.injection
        if (traffic.service, traffic.outgoing) not in injection.fault.value.frames:
            return False
        if injection.fault is Fault.SDO_ABORT or injection.object is not None:
            named = sdo_object(frame.data)
            return named is not None and injection.object in (None, named)
        return injection.pdo in (0, traffic.number)


def sdo_object(data: bytes) -> tuple[int, int] | None:
    """Return the object that an SDO request names, None when it continues a transfer."""
    if len(data) < FRAME_BYTES or data[0] >> 5 not in SDO_INITIATIONS:
        return None
    index, subindex = struct.unpack_from('<xHB', data)
    return int(index), int(subindex)


class FaultLine:
    """Passes frames on, unless a fault prevents it.

    Attributes:
        faults: The faults of the line that go on.
        now: Steady time in [s] of what the device does at the moment; its owner keeps it.
    """

    def __init__(
        self,
        send: Callable[[Frame], None],
        abort: Callable[[Abort], None],
        identify: Callable[[Frame, bool], Traffic],
    ) -> None:
        """Begin as a good line.

        Args:
            send: Takes the frames that reach the bus.
            abort: Sends an SDO abort, on the line.
            identify: Returns what a frame is, given whether it is outgoing.
        """
        self.faults: list[LineFault] = []
        self.now = 0.0
        self._send = send
        self._abort = abort
        self._identify = identify
        self._late: list[tuple[float, int, Callable[[float], None]]] = []
        self._order = itertools.count()

    @property
    def deadline(self) -> float:
        """Steady time in [s] at which a late frame arrives."""
        return self._late[0][0] if self._late else NEVER

    def send(self, frame: Frame) -> None:
        """Take a frame of the device."""
        if not self.faults:
            self._send(frame)
            return
        delay = self._fate(frame, outgoing=True)
        if delay == 0.0:
            self._send(frame)
        elif delay is not None:
            self._postpone(delay, lambda _now: self._send(frame))

    def receive(self, frame: Frame, now: float, deliver: Deliver) -> None:
        """Take a frame for the device, and hand it over unless a fault is in the way."""
        self.now = now
        delay = self._fate(frame, outgoing=False)
        if delay == 0.0:
            deliver(frame, now)
        elif delay is not None:
            self._postpone(delay, lambda later: deliver(frame, later))

    def filtered(self, deliver: Deliver) -> Deliver:
        """Return a handler that passes through this line."""

        def handle(frame: Frame, now: float) -> None:
            self.receive(frame, now, deliver)

        return handle

    def clear(self) -> None:
        """Lose the frames that are late."""
        self._late.clear()

    def advance(self, now: float) -> None:
        """Let late frames arrive."""
        self.now = now
        while self._late and self._late[0][0] <= now:
            heapq.heappop(self._late)[2](now)

    def _fate(self, frame: Frame, *, outgoing: bool) -> float | None:
        """Return by how many [s] a frame is late, None when it does not arrive."""
        traffic = self._identify(frame, outgoing)
        delay = 0.0
        for fault in self.faults:
            if not fault.hits(frame, traffic):
                continue
            if fault.injection.fault in DELAYS:
                delay += fault.injection.delay
                continue
            if fault.injection.fault is Fault.SDO_ABORT:
                index, subindex = sdo_object(frame.data) or (0, 0)
                self._abort(Abort(index, subindex, fault.injection.abort))
            return None
        return delay

    def _postpone(self, delay: float, work: Callable[[float], None]) -> None:
        heapq.heappush(self._late, (self.now + delay, next(self._order), work))
