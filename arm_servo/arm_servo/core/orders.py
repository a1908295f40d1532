# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What other threads leave for the cycle, and the order in which commands and stops count."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import count
import math
import threading

from ..exceptions import NotReadyError
from .set_point import MOTIONS, Source
from .snapshot import MAX_CYCLE_AGE


@dataclass(frozen=True, slots=True, eq=False)
class Cycle:
    """What an order sees of its cycle."""

    now: float  # steady time in [s]
    period: float  # time to the next cycle in [s]
    blocked: str  # why the arm takes no commands; empty when it does


Order = Callable[[Cycle], bool]  # carried out in a cycle; False for again in the next one


class OrderQueue:
    """Orders from any thread, carried out by the thread of the cycle."""

    def __init__(self) -> None:
        self._orders: deque[Order] = deque()
        self.append = self._orders.append

    def __len__(self) -> int:
        """Return how many wait."""
        return len(self._orders)

    def carry_out(self, cycle: Cycle) -> None:
        """Carry out what was there at the begin of the cycle."""
        for _ in range(len(self._orders)):
            order = self._orders.popleft()
            if not order(cycle):
                self._orders.append(order)


class CommandOrder:
    """Numbers commands and stops, and refuses what a later one has made void; for any thread.

    Attributes:
        refused: When a motion was refused last, as the arm did not follow, in [s].
    """

    def __init__(self) -> None:
        self.refused = -math.inf
        self._lock = threading.Lock()  # held for a few instructions only
        self._numbers = count(1)
        self._void_up_to: dict[Source, tuple[int, str]] = dict.fromkeys(MOTIONS, (0, ''))

    def number(self) -> int:
        """Return the number of a command that comes now."""
        with self._lock:
            return next(self._numbers)

    def void(self, sources: Iterable[Source], reason: str, number: int | None = None) -> None:
        """Refuse what was requested for some sources before a number.

        Args:
            number: The number; by default all that was requested so far is refused.
        """
        with self._lock:
            number = next(self._numbers) if number is None else number
            for source in sources:
                if self._void_up_to[source][0] < number:
                    self._void_up_to[source] = number, reason

    def check(self, source: Source, number: int) -> None:
        """Refuse what another command or a stop has made void.

        Raises:
            NotReadyError: It is void.
        """
        up_to, reason = self._void_up_to[source]
        if number < up_to:
            raise NotReadyError(f'stopped before it had begun: {reason}')

    def admit(self, source: Source, number: int, since: float, cycle: Cycle) -> None:
        """Refuse a motion that is void before it began, or that the arm cannot follow.

        Raises:
            NotReadyError: It is refused.
        """
        self.check(source, number)
        if cycle.blocked:
            self.refused = cycle.now
            raise NotReadyError(cycle.blocked)
        if (age := cycle.now - since) > MAX_CYCLE_AGE:
            raise NotReadyError(f'the cycle stood still for {age:.2f} s')
