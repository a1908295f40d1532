# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Single targets are looked at beside the cycle before they move the arm."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures import TimeoutError as FutureTimeoutError
import math
from typing import TypeVar

from ..exceptions import NotReadyError
from .desk import Desk

T = TypeVar('T')

PATIENCE = 1.0
"""Time in which the cycle must answer in [s]."""

MOST = 50
"""Displacements that may wait."""


class Aimer:
    """Carries out displacements of joints one after another, each checked for collisions."""

    def __init__(self, desk: Desk) -> None:
        """Prepare; the thread begins with the first displacement.

        Args:
            desk: The core's desk.
        """
        self._desk = desk
        self._worker = ThreadPoolExecutor(1, thread_name_prefix='target check')
        self._waiting: deque[Future[None]] = deque()

    def nudge(self, displacements: Mapping[str, float], fastest: float = math.inf) -> Future[None]:
        """Have joints moved on; for one thread.

        Args:
            displacements: How far in [rad] by joint.
            fastest: Greatest speed of a joint in [rad/s].

        Returns:
            Nothing once the motion began, or why it is refused.
        """
        while self._waiting and self._waiting[0].done():
            self._waiting.popleft()
        if len(self._waiting) >= MOST:
            refused: Future[None] = Future()
            refused.set_exception(
                NotReadyError(f'{MOST} displacements wait already; send them more slowly')
            )
            return refused
        future = self._worker.submit(self._carry_out, displacements, fastest)
        self._waiting.append(future)
        return future

    def cancel(self) -> None:
        """Drop what waits: something else moves the arm, or it is to stop; for the same thread."""
        while self._waiting:
            self._waiting.popleft().cancel()

    def _carry_out(self, displacements: Mapping[str, float], fastest: float) -> None:
        way = _answer(self._desk.submit(lambda core, _now: core.way_by(displacements, fastest)))
        self._desk.check(way)
        _answer(self._desk.submit(lambda core, _now: core.go(way)))


def _answer(order: Future[T]) -> T:
    try:
        return order.result(PATIENCE)
    except FutureTimeoutError as error:
        order.cancel()
        raise NotReadyError('the cycle does not run; is the bus up?') from error
