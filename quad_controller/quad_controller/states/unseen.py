# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Joints that were not known for a while: whether something else has moved them meanwhile.

A robot that was started anew lies; one without its cable may be bent by hand. What was held before
would move it unasked.
"""

from __future__ import annotations

from quad_description import JointSample, Targets

AGREEMENT = 0.05  # [rad] two samples of a robot that is not moved differ by less


class UnseenJoints:
    """Compares joints with their targets when they are known again.

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
