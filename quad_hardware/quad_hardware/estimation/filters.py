# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Rates from differences: of attitudes, and of joint positions, through a low-pass."""

from __future__ import annotations

from collections.abc import Mapping
import math

from quad_description.rotations import conjugate, multiply, Quaternion, rotation_vector, Vector

MAX_GAP = 0.2  # [s] a difference over more says nothing about now
ZERO: Vector = (0.0, 0.0, 0.0)


def low_pass_share(cutoff: float, elapsed: float) -> float:
    """Return the weight of the newest value in a first-order low-pass.

    Args:
        cutoff: Frequency at which the amplitude is 0.7 [Hz]; infinite lets everything through.
        elapsed: Since the value before [s].
    """
    return 1.0 - math.exp(-2.0 * math.pi * cutoff * elapsed)


class AttitudeRate:
    """Angular velocity from the difference of attitudes, in the frame of the body.

    By quaternions, so that a yaw that wraps is no jump. There is no raw gyro in protocol v2.
    """

    def __init__(self, cutoff: float) -> None:
        """Begin at rest.

        Args:
            cutoff: Of the low-pass [Hz].
        """
        self._cutoff = cutoff
        self._last: tuple[float, Quaternion] | None = None
        self._rate = ZERO

    def update(self, time: float, attitude: Quaternion) -> Vector:
        """Take an attitude; return the rate [rad/s]. After a gap it begins at zero again."""
        last, self._last = self._last, (time, attitude)
        if last is None or not 0.0 < time - last[0] <= MAX_GAP:
            self._rate = ZERO
            return ZERO
        elapsed = time - last[0]
        turned = rotation_vector(multiply(conjugate(last[1]), attitude))
        share = low_pass_share(self._cutoff, elapsed)
        x, y, z = (
            rate + share * (angle / elapsed - rate)
            for rate, angle in zip(self._rate, turned, strict=True)
        )
        self._rate = x, y, z
        return self._rate


class JointRate:
    """Joint velocities from differences, for the protocol that does not report them."""

    def __init__(self, cutoff: float) -> None:
        """Begin at rest.

        Args:
            cutoff: Of the low-pass [Hz].
        """
        self._cutoff = cutoff
        self._time = -math.inf
        self._last: dict[str, float] = {}
        self._rates: dict[str, float] = {}

    def update(self, time: float, positions: Mapping[str, float]) -> dict[str, float]:
        """Take positions [rad]; return velocities [rad/s] of the same joints."""
        elapsed, last = time - self._time, self._last
        self._time, self._last = time, dict(positions)
        if last.keys() != positions.keys() or not 0.0 < elapsed <= MAX_GAP:
            self._rates = dict.fromkeys(positions, 0.0)
        else:
            share = low_pass_share(self._cutoff, elapsed)
            for name, position in positions.items():
                rate = self._rates[name]
                self._rates[name] = rate + share * ((position - last[name]) / elapsed - rate)
        return dict(self._rates)
