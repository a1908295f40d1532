# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Trajectories of the demo: straight lines in joint space, at rest at both ends."""

from __future__ import annotations

import numpy as np

from arm_model import Array, JointLimits

# peaks of a quintic from rest to rest over unit way and unit time
PEAK_VELOCITY, PEAK_ACCELERATION, PEAK_JERK = 1.875, 5.7735, 60.0
SHARE = 0.6
"""Share of the limits of acceleration and jerk that is used."""
SPEED_SHARE = 0.35
"""Share of the limits of speed: a drive that waits for a busy computer must not lose its path."""
SHORTEST = 1.5
"""Shortest motion in [s]: there must be time to interfere."""


def duration(begin: Array, end: Array, limits: JointLimits) -> float:
    """Return the time of a quintic from rest to rest that keeps all limits in [s].

    Args:
        begin: Positions in [rad].
        end: Positions in [rad].
        limits: Limits of the joints.
    """
    way = np.abs(end - begin)
    needed = (
        PEAK_VELOCITY * way / (SPEED_SHARE * limits.velocity),
        np.sqrt(PEAK_ACCELERATION * way / (SHARE * limits.acceleration)),
        np.cbrt(PEAK_JERK * way / (SHARE * limits.jerk)),
    )
    return float(max(SHORTEST, *(each.max() for each in needed)))


def beside(start: Array, limits: JointLimits, way: float) -> Array:
    """Return positions beside others, in the direction in which each joint has more room.

    Args:
        start: Positions in [rad].
        limits: Limits of the joints.
        way: How far each joint goes, where it can, in [rad].
    """
    up = limits.upper - start
    down = start - limits.lower
    room = np.minimum(way, 0.5 * np.maximum(up, down))
    return start + np.where(up >= down, room, -room)
