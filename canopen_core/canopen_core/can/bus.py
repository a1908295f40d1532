# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The interface to a CAN bus, the clocks of its time stamps, and a bus inside one process."""

from __future__ import annotations

from abc import abstractmethod
from collections import deque
from contextlib import AbstractContextManager
from dataclasses import dataclass
from threading import Condition, Lock, TIMEOUT_MAX
from time import monotonic, monotonic_ns, time, time_ns
from weakref import WeakValueDictionary

from ..exceptions import BusError
from .frame import checked, Frame

_CLOCK_READINGS = 5


@dataclass(slots=True)
class BusCounters:
    """Counters of a bus object; they only increase."""

    sent: int = 0  # frames handed to the interface
    received: int = 0  # frames from others
    lost: int = 0  # frames that the kernel dropped because the receive buffer was full
    send_errors: int = 0  # frames that the interface refused
    malformed: int = 0  # received messages that are no classic CAN frame, and were dropped


class Bus(AbstractContextManager['Bus']):
    """A CAN bus. Send from any thread; receive from one thread only.

    An object never receives its own frames.
    """

    def __init__(self, name: str) -> None:
        # Name that it was opened by, e.g. ``vcan0`` or ``udp_multicast:239.74.163.2``.
        self.name = name
        self.counters = BusCounters()
        # frames of process data that :meth:`receive` may wait for within its time-out, unless
        # another frame comes; most interfaces return the first
        self.batch = 1

    @abstractmethod
    def send(self, frame: Frame) -> None:
        """Hand a frame to the interface, without waiting for the bus.

        Raises:
            BusError: The interface refuses the frame (down, transmit queue full).
        """

    def limit_queue(self, frames: int) -> None:  # most cannot do it
        """Limit the transmit queue to about this many frames, if the interface supports it.

        Further frames are refused. Frames queued while the cable is unplugged are sent afterwards.
        """

    @abstractmethod
    def receive(self, timeout: float) -> list[Frame]:
        """Wait for a frame, at most timeout [s]; return all available frames in order.

        The list is empty after the time-out or after :meth:`wake`.

        Raises:
            BusError: The interface disappeared.
        """

    @abstractmethod
    def wake(self) -> None:
        """Wake a :meth:`receive` that waits in another thread."""

    @abstractmethod
    def close(self) -> None:
        """Release the interface; closing twice is no error."""

    def __exit__(self, *_: object) -> None:
        self.close()


def wall_clock_offset() -> float:
    """Return wall clock minus steady clock in [s], from the quickest of several readings."""
    readings = []
    for _ in range(_CLOCK_READINGS):
        before, wall, after = monotonic(), time(), monotonic()
        readings.append((after - before, wall - before))
    return min(readings)[1]


class WallClock:
    """Offset of the wall clock to the steady clock, also while the wall clock is being set.

    Both run at one rate, so the known offset is clamped to the bounds of each new reading. A
    thread preempted between two readings gets wider bounds, not a wrong offset.
    """

    def __init__(self) -> None:
        self.offset = round(wall_clock_offset() * 1e9)  # [ns] wall clock minus steady clock

    def update(self) -> int:
        """Compare the clocks, and return the steady time in [ns]."""
        before, wall, now = monotonic_ns(), time_ns(), monotonic_ns()
        if self.offset > wall - before:
            self.offset = wall - before
        elif self.offset < wall - now:
            self.offset = wall - now
        return now


QUEUE_FRAMES = 100_000  # a bus object that is not read must not eat up the memory


class VirtualWire:
    """The medium that connects virtual buses of one name."""

    def __init__(self) -> None:
        self.lock = Lock()
        self.taps: list[VirtualBus] = []


class VirtualBus(Bus):
    """A bus inside this process: lossless, with the same frame order for all."""

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
        """Deliver the frame to all other buses on the wire.

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
        """Disconnect from the wire; a waiting :meth:`receive` raises a BusError."""
        with self._wire.lock:
            if self in self._wire.taps:
                self._wire.taps.remove(self)
        with self._arrived:
            self._closed = True
            self._arrived.notify()


_wires = WeakValueDictionary[str, VirtualWire]()  # the name is the meeting point
_wires_lock = Lock()


def open_virtual(name: str, channel: str) -> VirtualBus:
    """Connect to the wire of a channel, which exists as long as a bus uses it."""
    with _wires_lock:
        wire = _wires.get(channel)
        if wire is None:
            wire = _wires[channel] = VirtualWire()
        return VirtualBus(name, wire)
