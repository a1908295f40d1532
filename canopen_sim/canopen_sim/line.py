# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The line between a device and the bus, on which frames get lost or come late."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
import heapq
import itertools
import random
import struct
from typing import NamedTuple

from canopen_core.can import Frame
from canopen_core.standard import sdo

from .deviations import Effect, FaultInjection, FRAME_BYTES, Service
from .timed import NEVER

Deliver = Callable[[Frame, float], None]

SDO_INITIATIONS = (1, 2, 5, 6)  # client command specifiers that name an object (CiA 301, 7.2.4.3)
SDO_ANSWERS = (2, 3, 4, 5, 6)  # server command specifiers that do
BLOCK_TRANSFERS = (5, 6)  # client command specifiers of block transfers
OTHER_DEVICE_DELAY = 0.0005  # [s] by which another device of the same node id answers later


class Traffic(NamedTuple):
    """What a frame is to its device."""

    service: Service  # its kind
    outgoing: bool  # the device sends it
    number: int = 0  # number of the PDO, from 1


class ActiveFault:
    """A fault that goes on."""

    def __init__(self, injection: FaultInjection, node_id: int, end: float) -> None:
        """Begin; each device and fault has random numbers of its own."""
        self.injection = injection  # its description
        self.end = end  # steady time in [s] at which it ends
        self.exhausted = False  # it hit as many frames as it was to hit
        self._left = injection.count
        seed = f'{injection.seed}/{node_id}/{injection.fault.label}/{injection.pdo}'
        self._random = random.Random(seed)  # noqa: S311  # repeatable noise, no secret

    def hits(self, frame: Frame, traffic: Traffic) -> bool:
        """Return whether it strikes a frame, and count it."""
        if self.exhausted or not self._concerns(frame, traffic):
            return False
        probability = self.injection.probability
        if probability < 1.0 and self._random.random() >= probability:
            return False
        self._left -= 1
        self.exhausted = self._left == 0
        return True

    def _concerns(self, frame: Frame, traffic: Traffic) -> bool:
        injection, kind = self.injection, self.injection.fault.value
        if traffic.service not in kind.services or traffic.outgoing not in kind.directions:
            return False
        if kind.of_blocks:
            return frame.data[0] >> 5 in BLOCK_TRANSFERS if frame.data else False
        if kind.effect is Effect.ABORT or injection.object is not None:
            named = sdo_object(frame.data, SDO_ANSWERS if traffic.outgoing else SDO_INITIATIONS)
            return named is not None and injection.object in (None, named)
        return injection.pdo in (0, traffic.number)


def sdo_object(data: bytes, specifiers: tuple[int, ...]) -> tuple[int, int] | None:
    """Return the object that an SDO names, None when it continues a transfer.

    The command specifiers are those that name one, in its direction.
    """
    if len(data) < FRAME_BYTES or data[0] >> 5 not in specifiers:
        return None
    index, subindex = struct.unpack_from('<xHB', data)
    return int(index), int(subindex)


class FaultLine:
    """Passes frames on, unless a fault prevents it."""

    def __init__(
        self,
        send: Callable[[Frame], None],
        abort: Callable[[sdo.Abort], None],
        identify: Callable[[Frame, bool], Traffic],
    ) -> None:
        """Begin as a good line; ``identify`` gets whether a frame is outgoing."""
        self.faults: list[ActiveFault] = []  # the faults of the line that go on
        # steady time in [s] of what the device does at the moment; its owner keeps it
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
        """Pass on a frame of the device."""
        if self.faults:
            self._pass(frame, self._send_at, outgoing=True)
        else:
            self._send(frame)

    def receive(self, frame: Frame, now: float, deliver: Deliver) -> None:
        """Deliver a frame to the device unless a fault prevents it."""
        self.now = now
        self._pass(frame, deliver, outgoing=False)

    def filtered(self, deliver: Deliver) -> Deliver:
        """Return a handler that passes through this line."""
        return lambda frame, now: self.receive(frame, now, deliver)

    def clear(self) -> None:
        """Lose the frames that are late."""
        self._late.clear()

    def advance(self, now: float) -> None:
        """Deliver late frames."""
        self.now = now
        while self._late and self._late[0][0] <= now:
            heapq.heappop(self._late)[2](now)

    def _pass(self, frame: Frame, deliver: Deliver, *, outgoing: bool) -> None:
        """Deliver what the faults leave of a frame, now or late."""
        traffic = self._identify(frame, outgoing)
        delay = 0.0
        for fault in self.faults:
            if not fault.hits(frame, traffic):
                continue
            match fault.injection.fault.value.effect:
                case Effect.DELAY:
                    delay += fault.injection.delay
                case Effect.REPEAT:
                    self._postpone(OTHER_DEVICE_DELAY, partial(self._send_at, frame))
                case Effect.ABORT:
                    index, subindex = sdo_object(frame.data, SDO_INITIATIONS) or (0, 0)
                    self._abort(sdo.Abort(index, subindex, fault.injection.abort))
                    return
                case Effect.LOSE:
                    return
                case rewrite:
                    frame = frame._replace(data=rewrite(frame.data))
        if delay:
            self._postpone(delay, partial(deliver, frame))
        else:
            deliver(frame, self.now)

    def _send_at(self, frame: Frame, _now: float) -> None:
        self._send(frame)

    def _postpone(self, delay: float, work: Callable[[float], None]) -> None:
        heapq.heappush(self._late, (self.now + delay, next(self._order), work))
