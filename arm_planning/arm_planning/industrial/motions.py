# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""PTP, LIN and CIRC at full speed.

PTP: all joints go straight to the goal, in phase. Each keeps its own limits: the profile is that
of the joint that needs longest, and the others have shares of it. Pilz' planner gives every joint
the strictest limits of all, which is never quicker, and keeps no limit better.

LIN and CIRC: a link goes along a line or an arc, and turns about one axis. As in Pilz' planner one
profile leads along the curve; translation and rotation begin and end together, and neither is
faster than its limit. Where a joint would be too fast, it gets slower there, which Pilz' planner
refuses.
"""

from __future__ import annotations

import numpy as np

from arm_model import Array, JointLimits
from arm_trajectory import brakeable, Path

from ..curves import Curve
from ..ik.link_kinematics import LinkKinematics
from ..retime import FullSpeedPath, NEGLIGIBLE_SLOWDOWN, standstill
from .limits import CartesianLimits, JERK_RATIO
from .tracing import trace

MIN_LENGTH = 1e-9  # way in [m] below which a curve is none
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
    peak = brakeable(0.5, acceleration, jerk)
    speed = min(speed, peak)
    coefficients = np.zeros((6, len(way)))
    coefficients[0], coefficients[1] = start, way * speed
    path = Path(np.array([1.0 / speed]), coefficients[None])
    return FullSpeedPath(path, acceleration / speed, jerk / speed, straight=True)


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
    peak = brakeable(0.5 * length, most, JERK_RATIO * most)
    speed = min(velocity * limits.max_trans_vel, peak)
    traced = trace(link, curve, start, joints, duration=length / speed, name=name)
    rate = most / speed
    notes = []
    if traced.slowdown > NEGLIGIBLE_SLOWDOWN:
        joint = joints.names[traced.joint]
        share = 1.0 / traced.slowdown
        notes.append(f'{name}: slowed to {share:.0%} where {joint} meets its limit of speed')
    return FullSpeedPath(traced.path, rate, rate * JERK_RATIO, notes=tuple(notes))
