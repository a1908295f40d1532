# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""LIN and CIRC: a link along a line or an arc, turning about one axis.

As in Pilz' planner one profile leads along the curve; translation and rotation begin and end
together, and neither is faster than its limit. Where a joint would be too fast, it gets slower
there, which Pilz' planner refuses.
"""

from __future__ import annotations

import numpy as np

from arm_model import Array, JointLimits
from arm_trajectory import brakeable

from ..curves import Curve
from ..ik.link_kinematics import LinkKinematics
from .limits import CartesianLimits, JERK_RATIO
from .ptp import standstill
from .timing import FullSpeedPath
from .tracing import trace

NEGLIGIBLE_SLOWDOWN = 1.01  # how many times slower joints may make a curve without a note
MIN_LENGTH = 1e-9  # way in [m] below which a curve is none


def curve_path(
    link: LinkKinematics,
    curve: Curve,
    start: Array,
    joints: JointLimits,
    limits: CartesianLimits,
    *,
    factors: tuple[float, float],
    name: str,
) -> FullSpeedPath:
    """Return the path of the joints at full speed along a curve.

    Args:
        curve: The curve; it begins where the link is.

    Raises:
        PlanningError: The curve cannot be followed; the message says where.
    """
    length = max(curve.length, curve.angle * limits.radius)
    if length < MIN_LENGTH:
        return standstill(start)
    velocity, acceleration = factors
    most = acceleration * limits.max_trans_acc
    # a short way ends before the full speed
    peak = float(brakeable(np.array(0.5 * length), np.array(most), np.array(JERK_RATIO * most)))
    speed = min(velocity * limits.max_trans_vel, peak)
    traced = trace(link, curve, start, joints, duration=length / speed, name=name)
    rate = most / speed
    notes = []
    if traced.slowdown > NEGLIGIBLE_SLOWDOWN:
        joint = joints.names[traced.joint]
        share = 1.0 / traced.slowdown
        notes.append(f'{name}: slowed to {share:.0%} where {joint} meets its limit of speed')
    return FullSpeedPath(traced.path, rate, rate * JERK_RATIO, notes=tuple(notes))
