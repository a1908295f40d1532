# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Says how far a training is: in a terminal on one line that is written over, else on lines."""

from __future__ import annotations

from collections.abc import Callable
import sys
from typing import TextIO

BAR = 30  # characters
INTERVAL = 1.0  # [s] between two lines in a terminal
LOG_INTERVAL = 15.0  # [s] between two lines elsewhere


class Progress:
    """Shows the share of the time that has passed, and figures."""

    def __init__(
        self, minutes: float, clock: Callable[[], float], stream: TextIO | None = None
    ) -> None:
        """Start the time.

        Args:
            minutes: How long it takes.
            clock: A monotonic clock in [s].
            stream: Where to; standard output for None.
        """
        self._minutes, self._clock = minutes, clock
        self._stream = sys.stdout if stream is None else stream
        self._start = clock()
        self._next = 0.0
        self._open = False

    @property
    def minutes(self) -> float:
        """How much time has passed in [min]."""
        return (self._clock() - self._start) / 60.0

    @property
    def share(self) -> float:
        """How much of the time has passed: 0 to 1, and more when it is over."""
        return self.minutes / self._minutes

    def figures(self, text: str) -> None:
        """Show figures, not more often than people read them."""
        if self._clock() < self._next:
            return
        terminal = self._stream.isatty()
        self._next = self._clock() + (INTERVAL if terminal else LOG_INTERVAL)
        full = round(BAR * min(self.share, 1.0))
        line = (
            f'[{"=" * full}{" " * (BAR - full)}] {self.minutes:5.1f}/{self._minutes:g} min  {text}'
        )
        self._stream.write(f'\r{line}\x1b[K' if terminal else f'{line}\n')
        self._stream.flush()
        self._open = terminal

    def say(self, text: str) -> None:
        """Write a line that stays."""
        self._stream.write('\n' if self._open else '')
        self._stream.write(f'{text}\n')
        self._stream.flush()
        self._open = False
