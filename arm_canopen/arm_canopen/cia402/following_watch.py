# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Whether an axis goes where its set-points lead it, as its own positions show."""

from __future__ import annotations

from collections import deque
from enum import Enum

WINDOW = 0.5  # [s] of set-points among which the position has to be
MARGIN_TIME = 0.1  # [s] of the profile velocity by which it may be beside them
LASTING = 1.0  # [s] of a following error after which the axis is taken out of operation
MOVED_SHARE = 0.1  # share of the margin by which set-points have to move to count as a motion
FOLLOWED_SHARE = 0.5  # share of the motion of the set-points that an axis makes at least


class Following(Enum):
    """What the positions of the last half second show."""

    FOLLOWS = 'it follows'
    UNDECIDED = 'it is seen again, where it was before'
    LEFT_BEHIND = 'the set-points moved, and it did not'
    LASTING_ERROR = 'it has been beside its set-points for too long'


class FollowingWatch:
    """Compares the position of an axis with the set-points of the last half second.

    A drive that has lost its RPDOs goes on to report that it follows: it compares itself with the
    last set-point that reached it. Its position is then left behind by the set-points, and would
    jump to them when the RPDOs arrive again. An axis that a load pulls away from set-points that
    stand is another matter: a new set-point where it is would let the load pull it further.
    """

    def __init__(self) -> None:
        self._samples: deque[tuple[float, float, float]] = deque()
        self._beside_since: float | None = None
        self._unseen_from: float | None = None  # set-point when the axis was seen last
        self._received = 0  # positions, in the cycle in which it was seen again

    def clear(self) -> None:
        """Forget the set-points: the axis is not led by them any more."""
        self._samples.clear()
        self._beside_since = self._unseen_from = None

    def lose_sight(self) -> None:
        """The axis is led on, but its positions are too old to be judged.

        The first that comes again may be old, too. Where frames were lost, the axis stands there,
        and the set-point that is due would make it jump. Where they were late, several positions
        come in a cycle: the axis is led on, and a set-point at the first would make it jump back.
        Thus none leaves in the first cycle.
        """
        if self._samples:
            unseen_from = self._unseen_from  # of a sight that was too short to judge
            if unseen_from is None:
                unseen_from = self._samples[0][1]  # positions are too old after some time only
            self.clear()
            self._unseen_from = unseen_from

    def judge(
        self,
        now: float,
        setpoint: float,
        position: float,
        *,
        margin: float,
        window: float,
        error: bool,
        received: int,
    ) -> Following:
        """Judge by set-point and position of this cycle whether the axis follows.

        Args:
            now: Steady time in [s].
            setpoint: Position commanded last in user units.
            position: Actual position in user units.
            margin: How far an axis that has stopped to move may be beside its set-points in user
                units.
            window: How far one that moves, or is pulled by a load, may lastingly be beside them
                in user units; not below the margin.
            error: The drive itself shows a following error.
            received: Number of positions received from the axis so far.
        """
        samples = self._samples
        samples.append((now, setpoint, position))
        while samples[0][0] < now - WINDOW:
            samples.popleft()
        if not error and abs(position - setpoint) <= margin:
            self._beside_since = self._unseen_from = None
            return Following.FOLLOWS
        unseen_from, cycles = self._unseen_from, len(samples) - 1
        if unseen_from is not None and abs(setpoint - unseen_from) > MOVED_SHARE * margin:
            if not cycles:
                self._received = received
                return Following.UNDECIDED
            if received - self._received <= cycles:
                return Following.LEFT_BEHIND
        self._unseen_from = None
        setpoints = [sample[1] for sample in samples]
        low, high = min(setpoints), max(setpoints)
        beside = max(low - position, position - high)
        positions = [sample[2] for sample in samples]
        way = max(positions) - min(positions)
        left = high - low > MOVED_SHARE * margin and way < FOLLOWED_SHARE * (high - low)
        if left and (error or beside > margin):
            return Following.LEFT_BEHIND
        if not error and beside <= window:
            self._beside_since = None
            return Following.FOLLOWS
        if self._beside_since is None:
            self._beside_since = now
        lasting = now - self._beside_since > LASTING
        return Following.LASTING_ERROR if lasting else Following.FOLLOWS
