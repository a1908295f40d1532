# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Training progress: log lines and the time budget."""

from __future__ import annotations

import math
import time

INTERVAL = 10.0  # [s] between two lines of figures


class Progress:
    """Tracks the time budget of a training run and prints its progress."""

    def __init__(self, minutes: float) -> None:
        """Start the timer; the training may take this long in [min]."""
        self._minutes, self._start = minutes, time.monotonic()
        self._printed = -math.inf

    @property
    def minutes(self) -> float:
        """Return the elapsed time in [min]."""
        return (time.monotonic() - self._start) / 60.0

    @property
    def share(self) -> float:
        """Return the elapsed share of the time budget: 0 to 1, above 1 when it is exceeded."""
        return self.minutes / self._minutes

    def figures(self, text: str) -> None:
        """Print training figures at intervals."""
        if time.monotonic() - self._printed >= INTERVAL:
            self._printed = time.monotonic()
            self.say(f'{self.minutes:5.1f} of {self._minutes:g} min  {text}')

    def say(self, text: str) -> None:
        """Print a line."""
        print(text, flush=True)  # noqa: T201  # what the program is for
