# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A bus from outside of all processes under test.

Objects of drives by SDO, a recorder, and a cable that can lose, hold up and double what passes.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
import random
import threading
import time
from typing import TYPE_CHECKING

from arm_canopen import DriveState
from canopen_core.can import Bus, Frame, open_bus
from canopen_core.standard import CobId, drive_state

if TYPE_CHECKING:
    from typing_extensions import Self


STATUSWORD, POSITION = 0x6041, 0x6064
TIMEOUT = 2.0
"""Longest time in [s] for an answer."""


def read(bus: Bus, node_id: int, index: int) -> int:
    """Read a signed number.

    Raises:
        AssertionError: There is no answer.
    """
    request = bytes([0x40, index & 0xFF, index >> 8, 0, 0, 0, 0, 0])
    bus.send(Frame(CobId.SDO_REQUEST + node_id, request))
    answer = CobId.SDO_RESPONSE + node_id
    deadline = time.monotonic() + TIMEOUT
    while time.monotonic() < deadline:
        for frame in bus.receive(0.1):
            if frame.can_id == answer and frame.data[1:3] == index.to_bytes(2, 'little'):
                size = 4 - ((frame.data[0] >> 2) & 3)
                return int.from_bytes(frame.data[4 : 4 + size], 'little', signed=True)
    raise AssertionError(f'node {node_id} does not answer')


def read_position(bus: Bus, node_id: int) -> int:
    """Return where a drive is, in its increments."""
    return read(bus, node_id, POSITION)


def is_enabled(bus: Bus, node_id: int) -> bool:
    """Return whether a drive is in Operation enabled."""
    return drive_state(read(bus, node_id, STATUSWORD)) is DriveState.OPERATION_ENABLED


class BusRecorder:
    """Keeps every frame from its start on."""

    def __init__(self, bus: str) -> None:
        self.frames: list[Frame] = []
        self._bus = open_bus(bus)
        self._stopping = False
        self._thread = threading.Thread(target=self._record, daemon=True)
        self._thread.start()

    def first_after(self, time: float, can_id: int, data: bytes, at: int = 0) -> Frame | None:
        """Return the first frame after a steady time with some bytes at a place of its data."""
        return next(
            (
                frame
                for frame in self.frames
                if frame.timestamp >= time
                and frame.can_id == can_id
                and frame.data[at : at + len(data)] == data
            ),
            None,
        )

    def last_before(self, time: float, first_id: int, last_id: int) -> Frame | None:
        """Return the last frame before a steady time with an identifier of a range."""
        for frame in reversed(self.frames):
            if frame.timestamp < time and first_id <= frame.can_id <= last_id:
                return frame
        return None

    def pause(self) -> None:
        """Stop to listen; what was recorded stays."""
        self._stopping = True
        self._bus.wake()
        self._thread.join()

    def last_states(self) -> dict[int, str]:
        """Return the state in the last TPDO1 of each node, by node id."""
        states = {}
        for frame in list(self.frames):
            node_id = frame.can_id - CobId.TPDO1
            if 1 <= node_id <= 127:
                states[node_id] = drive_state(int.from_bytes(frame.data[:2], 'little')).title
        return states

    def __enter__(self) -> Self:
        """Use it in a with statement."""
        return self

    def __exit__(self, *_: object) -> None:
        """Stop to listen."""
        self.pause()
        self._bus.close()

    def _record(self) -> None:
        while not self._stopping:
            self.frames += self._bus.receive(0.5)


POLL = 0.2
"""Longest time in [s] after which the cable looks whether it is pulled."""
RETRY = 0.001
"""Time in [s] to the next look at a frame that is held up."""


@dataclass(frozen=True)
class LineQuality:
    """What happens to frames on their way."""

    loss: float = 0.0  # share of the frames that get lost
    doubling: float = 0.0  # share of the frames that come twice
    delay: float = 0.0  # longest time in [s] that a frame is held up; no frame overtakes another


PERFECT = LineQuality()


class BusTap:
    """Sits between the master's bus and the devices' bus."""

    def __init__(
        self,
        master_bus: str,
        device_bus: str,
        seed: int,
        listeners: tuple[Callable[[Frame], None], Callable[[Frame], None]],
    ) -> None:
        """Connect the buses.

        Args:
            master_bus: Name of the bus that the master is on.
            device_bus: Name of the bus that the devices are on.
            seed: Of the frames that are hit.
            listeners: Get each frame that the master sends and each that a device sends, as it was
                sent.
        """
        self.quality = PERFECT  # of both directions, from the next frame on
        self._closing = threading.Event()
        self._buses = [open_bus(master_bus), open_bus(device_bus)]
        ways = [self._buses, self._buses[::-1]]
        self._threads = [
            threading.Thread(target=self._pass_on, args=(*way, listener, seed + number))
            for number, (way, listener) in enumerate(zip(ways, listeners, strict=True))
        ]
        for thread in self._threads:
            thread.start()

    def __enter__(self) -> Self:
        """Use it in a with statement."""
        return self

    def __exit__(self, *_: object) -> None:
        """Pull the cable."""
        self._closing.set()
        for bus in self._buses:
            bus.wake()
        for thread in self._threads:
            thread.join()
        for bus in self._buses:
            bus.close()

    def _pass_on(
        self, source: Bus, target: Bus, listener: Callable[[Frame], None], seed: int
    ) -> None:
        chance = random.Random(seed)
        waiting: deque[tuple[float, Frame]] = deque()  # due time on the steady clock, frame
        while not self._closing.is_set():
            for frame in source.receive(RETRY if waiting else POLL):
                listener(frame)
                waiting += self._fate(frame, waiting, chance)
            while waiting and waiting[0][0] <= time.monotonic():
                target.send(waiting.popleft()[1])

    def _fate(
        self, frame: Frame, waiting: deque[tuple[float, Frame]], chance: random.Random
    ) -> list[tuple[float, Frame]]:
        """Return when the frame leaves: never, once or twice."""
        quality = self.quality
        if chance.random() < quality.loss:
            return []
        due = time.monotonic() + quality.delay * chance.random()
        if waiting:
            due = max(due, waiting[-1][0])
        return [(due, frame)] * (2 if chance.random() < quality.doubling else 1)
