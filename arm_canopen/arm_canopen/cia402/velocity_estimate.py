# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How fast an axis really goes: 0x606C is optional, and may be wrong."""

from __future__ import annotations

from collections import deque

WINDOW = 0.1  # [s] of positions that the estimate looks back on
FLICKER_INC = 1  # [inc] by which an encoder at rest may change


class VelocityEstimate:
    """The rate of 0x6064 over a short window."""

    def __init__(self, poll_period: float = 0.0) -> None:
        """``poll_period`` of positions that are read by SDO in [s]; 0 where a PDO carries them."""
        self.window = max(WINDOW, 2.5 * poll_period)  # its length in [s]
        self._positions: deque[tuple[float, float]] = deque()

    def note(self, now: float, position_inc: float, stamp: float | None = None) -> None:
        """Add a position in [inc] at a steady time in [s].

        One whose ``stamp`` has not changed for a window counts as still there.
        """
        positions = self._positions
        if stamp is not None:
            if not positions or stamp > positions[-1][0]:
                now = stamp
            elif now - positions[-1][0] <= self.window:
                return
        positions.append((now, position_inc))
        while len(positions) > 2 and positions[1][0] <= now - self.window:
            positions.popleft()

    def clear(self) -> None:
        """Forget all positions."""
        self._positions.clear()

    @property
    def known(self) -> bool:
        """Whether the positions span enough time to distinguish motion from rest."""
        if len(self._positions) < 2:
            return False
        return self._positions[-1][0] - self._positions[0][0] >= 0.5 * self.window

    @property
    def rate(self) -> float:
        """Rate in [inc/s]; 0 while there is nothing to compare."""
        if len(self._positions) < 2:
            return 0.0
        (begin, first), (end, last) = self._positions[0], self._positions[-1]
        if end <= begin or abs(last - first) <= FLICKER_INC:
            return 0.0
        return (last - first) / (end - begin)
