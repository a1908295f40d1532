# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""PTP: all joints straight to the goal, in phase.

Each joint keeps its own limits: the profile is that of the joint that needs longest, and the
others have shares of it. Pilz' planner gives every joint the strictest limits of all, which is
never quicker, and keeps no limit better.
"""

from __future__ import annotations

import numpy as np

from arm_model import Array, JointLimits
from arm_trajectory import brakeable, Path

from .timing import FullSpeedPath

STANDSTILL = 1e-3  # how long a motion takes that has no way in [s]
NEGLIGIBLE = 1e-12  # share of the longest way that a joint counts to have at least
NO_WAY = 1e-9  # greatest way of a joint that counts as none in [rad]


def ptp_path(start: Array, goal: Array, limits: JointLimits) -> FullSpeedPath:
    """Return the path at full speed."""
    way = goal - start
    size = np.abs(way)
    if size.max() < NO_WAY:
        return standstill(goal)
    sizes = np.maximum(size, NEGLIGIBLE * size.max())
    speed, acceleration, jerk = (  # of the share of the way
        float((limit / sizes).min())
        for limit in (limits.velocity, limits.acceleration, limits.jerk)
    )
    # a short way ends before the full speed
    peak = float(brakeable(np.array(0.5), np.array(acceleration), np.array(jerk)))
    speed = min(speed, peak)
    coefficients = np.zeros((6, len(way)))
    coefficients[0], coefficients[1] = start, way * speed
    path = Path.of(np.array([1.0 / speed]), coefficients[None])
    return FullSpeedPath(path, acceleration / speed, jerk / speed, straight=True)


def standstill(positions: Array) -> FullSpeedPath:
    """Return a path that stays where it is."""
    coefficients = np.zeros((6, len(positions)))
    coefficients[0] = positions
    return FullSpeedPath(
        Path.of(np.array([STANDSTILL]), coefficients[None]), 1.0 / STANDSTILL, 1.0 / STANDSTILL**2
    )
