# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Analytic kinematics of a roll-pitch-pitch leg, in closed form.

With the foot at (x, y, z) from the hip point and d its offset to the side, the leg's plane is
rolled by ``atan2(z, y) - atan2(depth, d)``, ``depth = -sqrt(y^2 + z^2 - d^2)``; inside it the law
of cosines gives the knee and the angle to the target gives the thigh. Plain floats, no arrays:
this runs for four legs in every step.
"""

from __future__ import annotations

from dataclasses import dataclass
import math

from ..rotations import Quaternion, Vector
from .leg import LegGeometry


@dataclass(frozen=True, slots=True)
class LegSolution:
    """Joint positions for a foot."""

    angles: Vector  # hip, thigh, calf in [rad], always within the limits
    reachable: bool  # whether they bring the foot to where it was requested
    # distance of the foot from the edge of the reach in [m], negative outside; joint limits are
    # not counted
    margin: float


def solve(leg: LegGeometry, foot: Vector) -> LegSolution:
    """Return the joint positions for a foot, the nearest ones when it is out of reach.

    Args:
        foot: Centre of the foot in the body's frame in [m].
    """
    hip, one, two = leg.hip, leg.thigh_length, leg.calf_length
    x = foot[0] - hip[0] - leg.thigh_x
    y, z = foot[1] - hip[1], foot[2] - hip[2]
    side = math.hypot(y, z)
    depth = -math.sqrt(max(side * side - leg.offset_y * leg.offset_y, 0.0))
    roll = wrapped(math.atan2(z, y) - math.atan2(depth, leg.offset_y))
    z = depth - leg.thigh_z
    reach = math.hypot(x, z)
    margin = min(one + two - reach, reach - abs(one - two), side - abs(leg.offset_y))
    cosine = (reach * reach - one * one - two * two) / (2.0 * one * two)
    knee = leg.knee_sign * math.acos(min(max(cosine, -1.0), 1.0))
    thigh = math.atan2(-x, -z) - math.atan2(two * math.sin(knee), one + two * math.cos(knee))
    wanted = (
        leg.signs[0] * roll,
        leg.signs[1] * wrapped(thigh - leg.thigh_pitch),
        leg.signs[2] * wrapped(knee + leg.thigh_pitch - leg.calf_pitch),
    )
    limits = leg.limits
    angles = (
        limits[0].clamp(wanted[0]),
        limits[1].clamp(wanted[1]),
        limits[2].clamp(wanted[2]),
    )
    return LegSolution(angles, margin >= 0.0 and angles == wanted, margin)


def foot_position(leg: LegGeometry, angles: Vector) -> Vector:
    """Return the centre of the foot in the body's frame in [m].

    Args:
        angles: Hip, thigh, calf in [rad].
    """
    roll = leg.signs[0] * angles[0]
    thigh = leg.signs[1] * angles[1]
    upper = thigh + leg.thigh_pitch
    lower = thigh + leg.signs[2] * angles[2] + leg.calf_pitch
    x = leg.thigh_x - leg.thigh_length * math.sin(upper) - leg.calf_length * math.sin(lower)
    z = leg.thigh_z - leg.thigh_length * math.cos(upper) - leg.calf_length * math.cos(lower)
    y, sine, cosine = leg.offset_y, math.sin(roll), math.cos(roll)
    return (leg.hip[0] + x, leg.hip[1] + y * cosine - z * sine, leg.hip[2] + y * sine + z * cosine)


def calf_rotation(leg: LegGeometry, angles: Vector) -> Quaternion:
    """Return how calf and foot are turned against the zero pose, in the body's frame.

    Args:
        angles: Hip, thigh, calf in [rad].
    """
    roll = leg.signs[0] * angles[0] / 2
    pitch = (leg.signs[1] * angles[1] + leg.signs[2] * angles[2]) / 2
    sr, cr, sp, cp = math.sin(roll), math.cos(roll), math.sin(pitch), math.cos(pitch)
    return sr * cp, cr * sp, sr * sp, cr * cp


def jacobian(leg: LegGeometry, angles: Vector) -> tuple[Vector, Vector, Vector]:
    """Return the derivative of the foot's position by each joint, one column after another.

    Args:
        angles: Hip, thigh, calf in [rad].
    """
    roll = leg.signs[0] * angles[0]
    thigh = leg.signs[1] * angles[1]
    upper = thigh + leg.thigh_pitch
    lower = thigh + leg.signs[2] * angles[2] + leg.calf_pitch
    sine, cosine = math.sin(roll), math.cos(roll)
    lower_x = -leg.calf_length * math.cos(lower)
    lower_z = leg.calf_length * math.sin(lower)
    both_x = lower_x - leg.thigh_length * math.cos(upper)
    both_z = lower_z + leg.thigh_length * math.sin(upper)
    _, y, z = foot_position(leg, angles)
    hip, pitch, knee = leg.signs
    return (
        (0.0, -hip * (z - leg.hip[2]), hip * (y - leg.hip[1])),
        (pitch * both_x, -pitch * both_z * sine, pitch * both_z * cosine),
        (knee * lower_x, -knee * lower_z * sine, knee * lower_z * cosine),
    )


def wrapped(angle: float) -> float:
    """Return the same direction within -pi to pi [rad]."""
    return math.remainder(angle, math.tau)
