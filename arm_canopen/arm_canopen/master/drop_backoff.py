# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How long a device that leaves Operational by itself is left alone before it is booted again."""

from __future__ import annotations

FIRST_PAUSE = 0.5  # [s]
LONGEST_PAUSE = 30.0  # [s]
STABLE_TIME = 10.0  # [s] in operation after which a drop is the first one again


class DropBackoff:
    """Doubles the pause with each drop that follows soon on the one before."""

    def __init__(self) -> None:
        self.drops = 0  # drops in a row
        self._booted_at = 0.0

    def booted(self, now: float) -> None:
        """The device came into operation at a time in [s]."""
        self._booted_at = now

    def dropped(self, now: float) -> float:
        """Return how long to wait after a drop at a time in [s], in [s]."""
        if now - self._booted_at > STABLE_TIME:
            self.drops = 0
        self.drops += 1
        return float(min(FIRST_PAUSE * 2 ** (self.drops - 1), LONGEST_PAUSE))
