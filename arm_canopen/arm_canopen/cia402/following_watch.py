# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Whether an axis goes where its set-points lead it, as its own positions show."""

from __future__ import annotations

from collections import deque

WINDOW = 0.5  # [s] of set-points among which the position has to be
MARGIN_TIME = 0.1  # [s] of the profile velocity by which it may be beside them


class FollowingWatch:
    """Compares the position of an axis with the set-points of the last half second.

    A drive that has lost its RPDOs goes on to report that it follows: it compares itself with the
    last set-point that reached it. Its position is then left behind by the set-points, and would
    jump to them when the RPDOs arrive again.
    """

    def __init__(self) -> None:
        """Begin without set-points."""
        self._setpoints: deque[tuple[float, float]] = deque()

    def clear(self) -> None:
        """Forget the set-points: the axis is not led by them any more."""
        self._setpoints.clear()

    def follows(self, now: float, setpoint: float, position: float, velocity: float) -> bool:
        """Take the set-point of this cycle and tell whether the axis follows.

        Args:
            now: Steady time in [s].
            setpoint: Position commanded last in user units.
            position: Actual position in user units.
            velocity: Profile velocity of the axis in user units per second.
        """
        setpoints = self._setpoints
        setpoints.append((now, setpoint))
        while setpoints[0][0] < now - WINDOW:
            setpoints.popleft()
        margin = MARGIN_TIME * velocity
        if abs(position - setpoint) <= margin:
            return True
        low = min(value for _, value in setpoints)
        high = max(value for _, value in setpoints)
        return low - margin <= position <= high + margin
