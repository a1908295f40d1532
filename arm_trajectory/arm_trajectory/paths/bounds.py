# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Where a path leaves a range of positions, between its points too."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from arm_model import Array

from .path import Path

ROUNDING_TOLERANCE = 1e-6  # rounding that is let pass in [rad]


@dataclass(frozen=True, slots=True)
class Excess:
    """A place beyond a range."""

    joint: int  # number of the joint
    position: float  # where it is in [rad]
    time: float  # when on the path in [s]


def farthest_beyond(path: Path, lower: Array, upper: Array) -> Excess | None:
    """Return the place where a path is farthest beyond a range; None where it keeps within."""
    scaled = path.coefficients * (path.durations[:, None] ** np.arange(6.0))[:, :, None]
    control = path.control_values
    too_low = (control < lower - ROUNDING_TOLERANCE).any(axis=1)
    too_high = (control > upper + ROUNDING_TOLERANCE).any(axis=1)
    outside = too_low | too_high
    worst, most = None, ROUNDING_TOLERANCE
    for place, joint in np.argwhere(outside).tolist():
        for share, position in _extremes(scaled[place, :, joint]):
            beyond = max(lower[joint] - position, position - upper[joint])
            if beyond > most:
                most = beyond
                time = path.starts[place] + share * path.durations[place]
                worst = Excess(joint, position, float(time))
    return worst


def _extremes(coefficients: Array) -> list[tuple[float, float]]:
    """Return the ends and turning points of a polynomial on 0..1, and its values there."""
    slopes = coefficients[1:] * np.arange(1.0, 6.0)
    turning = np.roots(slopes[::-1])
    inner = turning.real[
        (np.abs(turning.imag) < ROUNDING_TOLERANCE) & (turning.real > 0) & (turning.real < 1)
    ]
    shares = [0.0, *inner.tolist(), 1.0]
    return [(share, float(np.polyval(coefficients[::-1], share))) for share in shares]
