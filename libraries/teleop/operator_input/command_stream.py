# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""When to publish a command: steadily while active, a few rests at the end, and then nothing."""

from __future__ import annotations

from collections.abc import Callable
import math
from typing import Generic, TypeVar

T = TypeVar('T')

RESTS = 3  # commands to rest at the end of a motion: one might be lost, more would be a stream


class CommandStream(Generic[T]):
    """Turns what is wanted now into messages; pure, times are in [s].

    A change is published at once, an unchanged command once a period. A source that is idle is
    silent, so that it does not overrule others.
    """

    def __init__(self, period: float, rest: Callable[[T | None], T]) -> None:
        """Start idle.

        Args:
            period: Time between two messages of the same command.
            rest: Gives the command that ends a motion; it gets the last command of the motion, or
                None when there was none.

        Raises:
            ValueError: The period is not positive.
        """
        if not 0.0 < period < math.inf:
            raise ValueError(f'period is {period} s: it must be above 0')
        self._period = period
        self._rest = rest
        self._wanted: T | None = None
        self._moved: T | None = None
        self._rests = 0  # still to be published
        self._due = -math.inf  # time of the next message

    @property
    def is_idle(self) -> bool:
        """Whether there is nothing to publish until a command is wanted."""
        return self._wanted is None and self._rests == 0

    def is_rest(self, command: T) -> bool:
        """Return whether a command moves nothing."""
        return command == self._rest(command)

    def due(self) -> float:
        """Return when step() has to be called at the latest; infinite when idle."""
        return math.inf if self.is_idle else self._due

    def stop(self) -> None:
        """Publish rests even if nothing moves: a person requested a stop."""
        self._wanted, self._rests, self._due = None, RESTS, -math.inf

    def end(self) -> None:
        """Publish rests at the end of the program, if it ever moved anything."""
        if self._moved is not None:
            self.stop()

    def step(self, wanted: T | None, now: float) -> T | None:
        """Return what to publish now, None for nothing; None is wanted by an inactive source."""
        if wanted != self._wanted:
            if wanted is None:
                self._rests = RESTS
            self._wanted, self._due = wanted, now
        if self.is_idle or now < self._due:
            return None
        self._due = now + self._period
        if wanted is not None:
            self._rests, self._moved = 0, wanted
            return wanted
        self._rests -= 1
        return self._rest(self._moved)
