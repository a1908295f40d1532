# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How far a training is: lines of text, and the time that it has."""

from __future__ import annotations

import math
import time

INTERVAL = 10.0  # [s] between two lines of figures


class Progress:
    """The time of a training, and what it prints."""

    def __init__(self, minutes: float) -> None:
        """Start the time: how long it takes in [min]."""
        self._minutes, self._start = minutes, time.monotonic()
        self._printed = -math.inf

    @property
    def minutes(self) -> float:
        """How much time has passed in [min]."""
        return (time.monotonic() - self._start) / 60.0

    @property
    def share(self) -> float:
        """How much of the time has passed: 0 to 1, and more when it is over."""
        return self.minutes / self._minutes

    def figures(self, text: str) -> None:
        """Print figures, now and then."""
        if time.monotonic() - self._printed >= INTERVAL:
            self._printed = time.monotonic()
            self.say(f'{self.minutes:5.1f} of {self._minutes:g} min  {text}')

    def say(self, text: str) -> None:
        """Print a line."""
        print(text, flush=True)  # noqa: T201  # what the program is for
