# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""When to publish a velocity: steadily while active, a few zeros at the end, and then nothing."""

from __future__ import annotations

import math

from .exceptions import SettingError
from .velocity import Velocity, ZERO

ZEROS = 3
"""Zeros at the end of a motion: one might be lost, more would be a stream."""


class CommandStream:
    """Turns what is wanted now into messages; pure, time is handed in.

    A change is published at once, an unchanged velocity once a period. A source that is idle is
    silent, so that it does not overrule others.
    """

    def __init__(self, period: float) -> None:
        """Start idle.

        Args:
            period: Time between two messages of the same velocity [s].

        Raises:
            SettingError: The period is not positive.
        """
        if not 0.0 < period < math.inf:
            raise SettingError(f'period is {period} s: it must be above 0')
        self._period = period
        self._last: Velocity | None = None
        self._zeros = 0  # still to be published
        self._due = -math.inf  # [s] of the next message
        self._has_moved = False

    @property
    def is_idle(self) -> bool:
        """Whether there is nothing to publish until a velocity is wanted."""
        return self._last is None and self._zeros == 0

    def due(self) -> float:
        """Return when step() has to be called at the latest [s]; infinite when idle."""
        return math.inf if self.is_idle else self._due

    def stop(self) -> None:
        """Publish zeros even if nothing moves: a person asked for a stop."""
        self._last, self._zeros, self._due = None, ZEROS, -math.inf

    def end(self) -> None:
        """Publish zeros at the end of the program, if it ever moved anything."""
        if self._has_moved:
            self.stop()

    def step(self, wanted: Velocity | None, now: float) -> Velocity | None:
        """Say what to publish now.

        Args:
            wanted: Velocity; None when the source is not active.
            now: Time [s].

        Returns:
            None for nothing.
        """
        if wanted != self._last:
            if wanted is None:
                self._zeros = ZEROS
            self._last, self._due = wanted, now
        if self.is_idle or now < self._due:
            return None
        self._due = now + self._period
        if wanted is not None:
            self._zeros, self._has_moved = 0, True
            return wanted
        self._zeros -= 1
        return ZERO
