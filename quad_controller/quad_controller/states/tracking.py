# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Sees joints that stand still while their targets move: frozen sensors, servos without power.

Messages that keep coming with the same values have no age that would show it.
"""

from __future__ import annotations

from collections.abc import Sequence

from quad_description import JointSample, Targets

AGREEMENT = 0.05  # [rad] two samples of a robot that is not moved differ by less


class UnseenJoints:
    """Compares joints with their targets when they are known again.

    A robot that was started anew lies; one without its cable may be bent by hand. What was held
    before would move it unasked.

    Within a band they are as they were, or gave way to their load. Beyond it they were moved,
    if a second sample has the same: one may be damaged.
    """

    def __init__(self, band: float) -> None:
        """Begin without having seen them.

        Args:
            band: How far a joint may be off its target in [rad].
        """
        self._band = band
        self._is_unseen = True
        self._first: JointSample | None = None
        self._last: JointSample | None = None

    @property
    def is_pending(self) -> bool:
        """Whether a first sample is beyond the band, and a second one is to agree."""
        return self._first is not None

    def lose(self) -> None:
        """Compare anew with the next samples."""
        self._is_unseen, self._first = True, None

    def see(self) -> None:
        """Compare nothing until they are lost again."""
        self._is_unseen, self._first = False, None

    def moved(self, joints: JointSample, targets: Targets) -> bool:
        """Whether something else has moved them; once, after they were lost.

        Args:
            targets: Where they were to be in [rad].
        """
        if joints is self._last:  # nothing new was received
            return False
        self._last = joints
        if not self._is_unseen:
            return False
        if _apart(joints.positions, targets) <= self._band:
            self.see()
            return False
        first, self._first = self._first, joints
        if first is None or _apart(joints.positions, first.positions) > AGREEMENT:
            return False
        self.see()
        return True


def _apart(one: Targets, other: Targets) -> float:
    return max(abs(a - b) for a, b in zip(one, other, strict=True))


WINDOW = 1.0  # [s] longer than a period of every gait
MIN_TRAVEL = 0.15  # [rad] that a target must have gone to be of interest
MIN_RATIO = 0.1  # of that way, that its joint must have gone; soft servos go a third


class TrackingMonitor:
    """Compares how far targets and joints went."""

    def __init__(self, names: Sequence[str]) -> None:
        """Begin with a new window."""
        self._names = tuple(names)
        self._targets: list[Sequence[float]] = []
        self._measured: list[Sequence[float]] = []
        self._time = 0.0
        self.text = ''  # which joints did not follow in the last window; empty when all did

    def step(self, targets: Sequence[float], measured: Sequence[float], dt: float) -> None:
        """Record what was sent and measured in a step.

        Args:
            targets: Of all joints in [rad].
            measured: Where they are in [rad].
        """
        self._targets.append(targets)
        self._measured.append(measured)
        self._time += dt
        if self._time < WINDOW:
            return
        wanted, gone = _travel(self._targets), _travel(self._measured)
        stuck = [
            name
            for name, way, went in zip(self._names, wanted, gone, strict=True)
            if way > MIN_TRAVEL and went < MIN_RATIO * way
        ]
        moving = sum(way > MIN_TRAVEL for way in wanted)
        which = 'all that move' if len(stuck) == moving > 1 else ', '.join(stuck)
        self.text = (
            f'do not follow their targets: {which}; are the servos on, and their angles alive?'
            if stuck
            else ''
        )
        self._targets, self._measured, self._time = [], [], 0.0


def _travel(rows: Sequence[Sequence[float]]) -> list[float]:
    return [max(column) - min(column) for column in zip(*rows, strict=True)]
