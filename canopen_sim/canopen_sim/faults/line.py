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

from arm_canopen.can import Frame
from arm_canopen.standard.sdo import Abort

from ..fault import Fault, FaultInjection, Service
from ..timed import NEVER

Deliver = Callable[[Frame, float], None]

SDO_INITIATIONS = (1, 2, 5, 6)  # client command specifiers that name an object (CiA 301, 7.2.4.3)
SDO_ANSWERS = (2, 3, 4, 5, 6)  # server command specifiers that do
BLOCK_TRANSFERS = (5, 6)  # client command specifiers of block transfers
FRAME_BYTES = 8  # [byte] of an SDO
MULTIPLEXER_BYTES = 4  # [byte] command and object, of an SDO that carries nothing else
GARBAGE = b'\xa5'  # what stands in the bytes that a deviating server does not mean
OTHER_DEVICE_DELAY = 0.0005  # [s] by which another device of the same node id answers later


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


def _with_command(command: int, data: bytes) -> bytes:
    """Return an expedited answer to a read with another command byte, and with garbage behind."""
    if data[0] & 0xE2 != 0x42:
        return data
    size = FRAME_BYTES - (data[0] >> 2 & 0x03)
    return bytes((command,)) + data[1:size] + GARBAGE * (FRAME_BYTES - size)


def _shortened(data: bytes) -> bytes:
    """Return an answer without the bytes that carry nothing."""
    match data[0] >> 5:
        case 0:
            return data[: FRAME_BYTES - (data[0] >> 1 & 0x07)]
        case 1:
            return data[:1]
        case 2 if data[0] & 0x02:
            return data[: FRAME_BYTES - (data[0] >> 2 & 0x03)]
        case 3:
            return data[:MULTIPLEXER_BYTES]
    return data


def _with_other_crc(data: bytes) -> bytes:
    """Return the frame that ends a block transfer with another CRC; it has 5 reserved bytes."""
    ends = data[0] & 0xE3 == 0xC1 and not any(data[3:])
    return data[:1] + bytes(byte ^ 0xFF for byte in data[1:3]) + data[3:] if ends else data


REWRITES: dict[Fault, Callable[[bytes], bytes]] = {
    Fault.SDO_FOUR_BYTES: partial(_with_command, 0x43),
    Fault.SDO_NO_SIZE: partial(_with_command, 0x42),
    Fault.SDO_SHORT: _shortened,
    Fault.BLOCK_CRC: _with_other_crc,
}
"""What deviating servers make of their frames."""


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
        if injection.fault in (Fault.BLOCK_ABORT, Fault.BLOCK_SILENCE):
            return frame.data[0] >> 5 in BLOCK_TRANSFERS if frame.data else False
        if injection.fault is Fault.SDO_ABORT or injection.object is not None:
            named = sdo_object(frame.data, SDO_ANSWERS if traffic.outgoing else SDO_INITIATIONS)
            return named is not None and injection.object in (None, named)
        return injection.pdo in (0, traffic.number)


def sdo_object(data: bytes, specifiers: tuple[int, ...]) -> tuple[int, int] | None:
    """Return the object that an SDO names, None when it continues a transfer.

    Args:
        data: Its bytes.
        specifiers: Command specifiers that name one, in its direction.
    """
    if len(data) < FRAME_BYTES or data[0] >> 5 not in specifiers:
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
        frame, delay = self._fate(frame, outgoing=True)
        if delay == 0.0:
            self._send(frame)
        elif delay is not None:
            self._postpone(delay, partial(self._send_at, frame))

    def receive(self, frame: Frame, now: float, deliver: Deliver) -> None:
        """Take a frame for the device, and hand it over unless a fault is in the way."""
        self.now = now
        frame, delay = self._fate(frame, outgoing=False)
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

    def _fate(self, frame: Frame, *, outgoing: bool) -> tuple[Frame, float | None]:
        """Return what becomes of a frame, and how late it is in [s]: None when it gets lost."""
        traffic = self._identify(frame, outgoing)
        delay = 0.0
        for fault in self.faults:
            if not fault.hits(frame, traffic):
                continue
            kind = fault.injection.fault
            if kind in DELAYS:
                delay += fault.injection.delay
            elif kind in REWRITES:
                frame = frame._replace(data=frame.data and REWRITES[kind](frame.data))
            elif kind is Fault.NODE_ID_CONFLICT:
                self._postpone(OTHER_DEVICE_DELAY, partial(self._send_at, frame))
            else:
                if kind in (Fault.SDO_ABORT, Fault.BLOCK_ABORT):
                    index, subindex = sdo_object(frame.data, SDO_INITIATIONS) or (0, 0)
                    self._abort(Abort(index, subindex, fault.injection.abort))
                return frame, None
        return frame, delay

    def _send_at(self, frame: Frame, _now: float) -> None:
        self._send(frame)

    def _postpone(self, delay: float, work: Callable[[float], None]) -> None:
        heapq.heappush(self._late, (self.now + delay, next(self._order), work))
