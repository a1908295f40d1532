# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Steps at a fixed rate that fall, where they can, on the arrival of feedback.

The schedule is one of absolute times. As long as feedback comes, a step waits for it a little
beyond its time, and the schedule is drawn towards the arrivals: so the newest feedback is used
within a moment. Without feedback the steps are where the schedule has them. Either way the rate
stays the nominal one, within a few per cent of a feedback that is faster or slower.
"""

from __future__ import annotations

WINDOW = 0.08  # periods before and after its time in which feedback makes a step
GAIN = 0.2  # share of its distance from the schedule that an arrival draws the schedule by


class Pacer:
    """Says when the next step is due; times are those of a monotonic clock in [s].

    Attributes:
        overruns: Steps that were left out because the one before came too late.
    """

    def __init__(self, period: float, now: float) -> None:
        """Make the first step due now."""
        self._period = period
        self._window = WINDOW * period
        self._due = now
        self._locked = False
        self.overruns = 0

    def deadline(self, fresh: bool) -> float:
        """Return when a step is due at the latest.

        Args:
            fresh: Whether feedback is there that no step has used.
        """
        if fresh:
            return self._due
        return self._due + self._window if self._locked else self._due

    def takes(self, now: float) -> bool:
        """Return whether feedback that arrives now makes a step at once."""
        return now >= self._due - self._window

    def stepped(self, now: float, arrival: float | None) -> None:
        """Schedule the next step.

        Args:
            arrival: When the feedback arrived that it used, None without.
        """
        error = 0.0 if arrival is None else arrival - self._due
        error = min(max(error, -self._window), self._window)
        self._due += self._period + GAIN * error
        self._locked = arrival is not None
        late = now - self._due
        if late >= 0.0:
            skipped = int(late / self._period) + 1
            self.overruns += skipped
            self._due += skipped * self._period
