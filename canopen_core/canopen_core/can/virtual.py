# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A CAN bus inside one process: reliable, and in the same order for everybody."""

from __future__ import annotations

from collections import deque
from threading import Condition, Lock, TIMEOUT_MAX
from time import monotonic
from weakref import WeakValueDictionary

from ..exceptions import BusError
from .bus import Bus
from .frame import checked, Frame

QUEUE_FRAMES = 100_000  # a bus object that nobody reads must not eat up the memory


class VirtualWire:
    """What the buses of one name are connected to."""

    def __init__(self) -> None:
        self.lock = Lock()
        self.taps: list[VirtualBus] = []


class VirtualBus(Bus):
    """A connection to a wire in this process."""

    def __init__(self, name: str, wire: VirtualWire) -> None:
        super().__init__(name)
        self._wire = wire
        self._arrived = Condition()
        self._queue: deque[Frame] = deque()
        self._woken = False
        self._closed = False
        with wire.lock:
            wire.taps.append(self)

    def send(self, frame: Frame) -> None:
        """Hand the frame to all others on the wire.

        Raises:
            BusError: The bus was closed.
        """
        if self._closed:
            raise BusError(f'{self.name} is closed')
        arriving = checked(frame)._replace(timestamp=monotonic())
        with self._wire.lock:
            for tap in self._wire.taps:
                if tap is not self:
                    tap._put(arriving)  # noqa: SLF001  another object of this class
            self.counters.sent += 1

    def _put(self, frame: Frame) -> None:
        with self._arrived:
            if len(self._queue) < QUEUE_FRAMES:
                self._queue.append(frame)
                self._arrived.notify()
            else:
                self.counters.lost += 1

    def receive(self, timeout: float) -> list[Frame]:
        """Wait for frames; see :meth:`Bus.receive`."""
        with self._arrived:
            self._arrived.wait_for(
                lambda: self._queue or self._woken or self._closed,
                min(max(0.0, timeout), TIMEOUT_MAX),
            )
            if self._closed:
                raise BusError(f'{self.name} is closed')
            self._woken = False
            frames = list(self._queue)
            self._queue.clear()
        self.counters.received += len(frames)
        return frames

    def wake(self) -> None:
        """Wake a waiting :meth:`receive`."""
        with self._arrived:
            self._woken = True
            self._arrived.notify()

    def close(self) -> None:
        """Leave the wire; a waiting :meth:`receive` ends in a BusError."""
        with self._wire.lock:
            if self in self._wire.taps:
                self._wire.taps.remove(self)
        with self._arrived:
            self._closed = True
            self._arrived.notify()


_wires = WeakValueDictionary[str, VirtualWire]()  # the name is the meeting point
_wires_lock = Lock()


def open_virtual(name: str, channel: str) -> VirtualBus:
    """Connect to the wire of a channel; it lives as long as a bus on it."""
    with _wires_lock:
        wire = _wires.get(channel)
        if wire is None:
            wire = _wires[channel] = VirtualWire()
        return VirtualBus(name, wire)
