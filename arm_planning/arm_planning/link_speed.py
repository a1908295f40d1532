# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Paths whose link is not faster than a request allows: MoveIt's max_cartesian_speed."""

from __future__ import annotations

import math

import numpy as np

from arm_model import Array
from arm_trajectory import Path

from .exceptions import PlanningCode, PlanningError
from .ik.link_kinematics import LinkKinematics

SAMPLES = 200
"""Places at which the speed is looked at, and again between the two beside the greatest."""

MARGIN = 1.001  # factor of the time, for what is between two places


def speed_limited(path: Path, link: LinkKinematics, most: float) -> tuple[Path, tuple[str, ...]]:
    """Return a path that takes longer if its link were too fast, and a note that says so.

    The places of the path stay the same.

    Args:
        most: Its greatest speed in [m/s]; 0 for no limit.

    Raises:
        PlanningError: The speed is negative, or no finite number.
    """
    if not 0.0 <= most < math.inf:
        raise PlanningError(
            PlanningCode.INVALID_GOAL_CONSTRAINTS,
            f'max_cartesian_speed is {most:g} m/s; it must be positive, or 0 for no limit',
        )
    factor = MARGIN * _greatest_speed(path, link) / most if most else 0.0
    if factor <= MARGIN:
        return path, ()
    limited = slower(path, factor)
    note = (
        f'takes {limited.duration:.3f} s instead of {path.duration:.3f} s, for link'
        f' {link.link} may move at {most:g} m/s'
    )
    return limited, (note,)


def slower(path: Path, factor: float) -> Path:
    """Return the same path with more time everywhere."""
    powers = (factor ** -np.arange(6.0))[:, None]
    return Path.of(path.durations * factor, path.coefficients * powers)


def _greatest_speed(path: Path, link: LinkKinematics) -> float:
    times = np.linspace(0.0, path.duration, SAMPLES)
    fastest = int(_speeds(path, link, times).argmax())
    beside = times[max(fastest - 1, 0)], times[min(fastest + 1, SAMPLES - 1)]
    return float(_speeds(path, link, np.linspace(*beside, SAMPLES)).max())


def _speeds(path: Path, link: LinkKinematics, times: Array) -> Array:
    speeds = []
    for time in times.tolist():
        point = path.at(time)
        _, jacobian = link.pose_and_jacobian(point.position)
        speeds.append(np.linalg.norm(jacobian[:3] @ point.velocity))
    return np.array(speeds)
