# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The one way to the cycle: orders from any thread, and the order in which they count."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
import math

from robot_primitives import StreamGate, StreamRules

from ..controllers.controller import MOTIONS, Source
from ..exceptions import NotReadyError
from .snapshot import MAX_CYCLE_AGE

BEGINS = 'the arm has just begun to follow'

TOGETHER = 1.0
"""Trajectories of a topic that follow each other within so many [s] are a stream; so long it has
to be silent before it can be let in again."""

GONE_AFTER = 10.0  # silence after which who had to let go has done so in [s]

RULES = {
    Source.JOG: StreamRules(
        'a jog that was held before moves nothing: release and jog again, with a command of zero'
        f' between (silence counts after {GONE_AFTER:g} s only), or call ~/start_servo',
        gone_after=GONE_AFTER,
    ),
    Source.TRAJECTORY: StreamRules(
        'a stream of trajectories does not go on after that: send none for'
        f' {TOGETHER:g} s, then an empty one, or none for {GONE_AFTER:g} s',
        together=TOGETHER,
        let_go=GONE_AFTER,
        gone_after=GONE_AFTER,
        begin_margin=5.0,  # in which drives are got back
    ),
}
"""Clients that send streams: those that jog, and the topic of trajectories."""


@dataclass(frozen=True, slots=True, eq=False)
class Cycle:
    """What an order sees of its cycle."""

    now: float  # steady time in [s]
    period: float  # time to the next cycle in [s]
    blocked: str  # why the arm takes no commands; empty when it does


Order = Callable[[Cycle], bool]  # carried out in a cycle; False for again in the next one


class Mailbox:
    """Orders from any thread, carried out by the thread of the cycle.

    Attributes:
        gate: Refuses what a stop or a newer command has made void.
        refused: When a motion was refused last, as the arm did not follow, in [s].
    """

    def __init__(self) -> None:
        self._orders: deque[Order] = deque()
        self.post = self._orders.append
        self.gate = StreamGate[Source](MOTIONS, RULES)
        self.refused = -math.inf

    def __len__(self) -> int:
        """Return how many orders wait."""
        return len(self._orders)

    def carry_out(self, cycle: Cycle) -> None:
        """Carry out what was there at the begin of the cycle."""
        for _ in range(len(self._orders)):
            order = self._orders.popleft()
            if not order(cycle):
                self._orders.append(order)

    def check(self, source: Source, number: int) -> None:
        """Refuse what another command or a stop has made void.

        Raises:
            NotReadyError: It is void.
        """
        if reason := self.gate.refusal(source, number):
            raise NotReadyError(reason)

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
