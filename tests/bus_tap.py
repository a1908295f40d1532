# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A CAN cable with a listener, which can lose, hold up and double what passes."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
import random
import threading
import time
from typing import TYPE_CHECKING

from canopen_core.can import Bus, Frame, open_bus

if TYPE_CHECKING:
    from types import TracebackType

    from typing_extensions import Self

POLL = 0.2
"""Longest time in [s] after which the cable looks whether it is pulled."""
RETRY = 0.001
"""Time in [s] to the next look at a frame that is held up."""


@dataclass(frozen=True)
class LineQuality:
    """What happens to frames on their way.

    Attributes:
        loss: Share of the frames that get lost.
        doubling: Share of the frames that come twice.
        delay: Longest time in [s] that a frame is held up; no frame overtakes another.
    """

    loss: float = 0.0
    doubling: float = 0.0
    delay: float = 0.0


PERFECT = LineQuality()


class BusTap:
    """Sits between the master's bus and the devices' bus.

    Attributes:
        quality: Of both directions, from the next frame on.
    """

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
        self.quality = PERFECT
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

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
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
