# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Filters of the estimator: low-passed rates from differences, gravity, battery."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
import math
from statistics import median

from quad_description.rotations import (
    angle_between,
    conjugate,
    down_in_body,
    multiply,
    Quaternion,
    rotation_vector,
    Vector,
)

STANDARD_GRAVITY = 9.80665  # [m/s²]
TOLERANCE = 2.0  # [m/s²] beyond which the body is accelerating
REPORTS = 50  # that are looked at together: a second, in which the pushes of a gait cancel out


def gravity_from_acceleration(acceleration: Vector) -> Vector | None:
    """Return the unit vector of gravity in the body; None while it accelerates.

    An accelerometer at rest reads the opposite of gravity (REP 145).
    """
    length = math.hypot(*acceleration)
    if abs(length - STANDARD_GRAVITY) > TOLERANCE:
        return None
    x, y, z = acceleration
    return -x / length, -y / length, -z / length


class GravityCheck:
    """Compares mean gravity directions of attitude and accelerometer: gait steps disturb each.

    A difference of more than a few degrees means that the IMU axes are not those of the body.
    """

    def __init__(self) -> None:
        self._reports: deque[tuple[Quaternion, Vector]] = deque(maxlen=REPORTS)

    def take(self, attitude: Quaternion, acceleration: Vector | None) -> None:
        """Add an attitude and the specific force in the body [m/s²]; None without one."""
        if acceleration is not None:
            self._reports.append((attitude, acceleration))

    @property
    def error(self) -> float | None:
        """Angle between the mean directions [rad]; None in the first second and in motion."""
        reports = list(self._reports)  # another thread may take the next one
        if len(reports) < REPORTS:
            return None
        down = _mean([down_in_body(attitude) for attitude, _ in reports])
        felt = gravity_from_acceleration(_mean([felt for _, felt in reports]))
        return None if felt is None or not any(down) else angle_between(down, felt)


def _mean(vectors: Sequence[Vector]) -> Vector:
    x, y, z = (sum(values) / len(vectors) for values in zip(*vectors, strict=True))
    return x, y, z


CHARGE_REPORTS = 25  # that the median is taken of: half a second
FULL = 100.0  # [%]


class MedianFilter:
    """Median of the last battery values."""

    def __init__(self) -> None:
        self._values: deque[float] = deque(maxlen=CHARGE_REPORTS)

    def take(self, value: float | None, highest: float = math.inf) -> float | None:
        """Add a value, unless it is missing or out of range; return the median."""
        if value is not None and 0.0 <= value <= highest:
            self._values.append(value)
        return median(self._values) if self._values else None


MAX_GAP = 0.2  # [s] a difference over more says nothing about now
ZERO: Vector = (0.0, 0.0, 0.0)


def low_pass_share(cutoff: float, elapsed: float) -> float:
    """Return the weight of the newest value in a first-order low-pass filter.

    Args:
        cutoff: -3 dB frequency [Hz]; infinity disables the filter.
        elapsed: Time since the previous value [s].
    """
    return 1.0 - math.exp(-2.0 * math.pi * cutoff * elapsed)


class AttitudeRate:
    """Angular velocity in the body frame, from attitude differences.

    It uses quaternions, so a wrapping yaw causes no jump. Protocol v2 has no raw gyro.
    """

    def __init__(self, cutoff: float) -> None:
        """Start at rest; the cutoff of the low-pass is in [Hz]."""
        self._cutoff = cutoff
        self._last: tuple[float, Quaternion] | None = None
        self._rate = ZERO

    def update(self, time: float, attitude: Quaternion) -> Vector:
        """Add an attitude; return the rate [rad/s]. After a gap it restarts at zero."""
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


SLOPE_SHARE = 0.75
"""How much of a parabola's slope counts beside that of a line: found on a trot over protocol v1.

The line lags by half a period; the parabola does not, and makes more of the rounding of bytes.
"""
ERROR_SHARE = 0.02  # weight of the newest report in the mean square of the error
TROT_ERROR = 0.5  # [rad/s] rms, by bytes of protocol v1, 50 times a second or oftener, in a trot
NOMINAL_PERIOD = 0.02  # [s] from which on it grows with the period, to the power of 1.5


class JointRate:
    """Joint velocities from the last three positions, for robots that do not report them.

    It estimates its error by comparison with the slope between the neighbouring reports, known one
    report later. That slope includes the rounding of positions, so the estimate is no smaller than
    the true error while reports are frequent.
    """

    def __init__(self, cutoff: float) -> None:
        """Start at rest; the cutoff of the low-pass is in [Hz]."""
        self._error = 0.0  # as reports show it, rms [rad/s]
        self._period = NOMINAL_PERIOD  # between reports, in the mean [s]
        self._cutoff = cutoff
        self._time = -math.inf
        self._elapsed = 0.0  # between the last two reports [s]
        self._last: dict[str, float] = {}
        self._slopes: dict[str, float] = {}  # between the last two reports
        self._rates: dict[str, float] = {}

    @property
    def error(self) -> float:
        """Error of the velocities [rad/s] rms: as observed, or at least that of a trot.

        A standing robot shows only rounding errors, but may walk soon.
        """
        slower = max(self._period / NOMINAL_PERIOD, 1.0)
        return max(self._error, TROT_ERROR * math.pow(slower, 1.5))

    def update(self, time: float, positions: Mapping[str, float]) -> dict[str, float]:
        """Add positions [rad]; return the velocities [rad/s] of the same joints."""
        elapsed, last = time - self._time, self._last
        if elapsed <= 0.0 and last.keys() == positions.keys():
            return dict(self._rates)  # the same report
        self._time, self._last = time, dict(positions)
        if last.keys() != positions.keys() or not 0.0 < elapsed <= MAX_GAP:
            self._rates = dict.fromkeys(positions, 0.0)
            self._slopes, self._elapsed = {}, 0.0
            return dict(self._rates)
        slopes = {name: (place - last[name]) / elapsed for name, place in positions.items()}
        before, span = self._slopes or slopes, elapsed + self._elapsed
        if self._slopes:
            errors = [
                (slopes[name] * elapsed + before[name] * self._elapsed) / span - rate
                for name, rate in self._rates.items()
            ]
            square = sum(error * error for error in errors) / len(errors)
            self._error = math.sqrt(self._error**2 + ERROR_SHARE * (square - self._error**2))
            self._period += ERROR_SHARE * (elapsed - self._period)
        share, bend = low_pass_share(self._cutoff, elapsed), SLOPE_SHARE * elapsed / span
        if not 0.5 < elapsed / (self._elapsed or elapsed) < 2.0:
            bend = 0.0  # a report was late: one of both slopes is that of another time
        for name, slope in slopes.items():
            newest = slope + bend * (slope - before[name])
            self._rates[name] += share * (newest - self._rates[name])
        self._slopes, self._elapsed = slopes, elapsed
        return dict(self._rates)
