# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Closed-form inverse kinematics of arms with parallel joints 2, 3 and a spherical wrist.

M. Brandstoetter, A. Angerer, M. Hofbaur: "An Analytical Solution of the Inverse Kinematics Problem
of Industrial Serial Manipulators with an Ortho-parallel Basis and a Spherical Wrist", Proceedings
of the Austrian Robotics Workshop, 2014; the names are those of the paper.
"""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np

from arm_model import Array, Pose

PI = math.pi


@dataclass(frozen=True, slots=True)
class Opw:
    """Parameters of an arm."""

    a: tuple[float, float, float]  # offsets a1, a2 and b in [m]
    c: tuple[float, float, float, float]  # lengths c1 to c4 in [m]
    signs: tuple[int, ...]  # sense of each joint against the paper's
    # what the paper's angle is less by, theta = sign q - offset, in [rad]
    offsets: tuple[float, ...]


OPW = {
    'gp110': Opw(
        (0.320, -0.235, 0.0),
        (0.540, 0.870, 1.020, 0.200),
        (1, 1, -1, -1, -1, -1),
        (0.0, 0.0, -PI / 2, 0.0, 0.0, PI),
    ),
    'prbt': Opw((0.0, 0.0, 0.0), (0.2604, 0.350, 0.307, 0.084), (1, 1, -1, 1, -1, 1), (0.0,) * 6),
}


def inverse(arm: Opw, pose: Pose) -> list[Array]:
    """Return all solutions for a pose of the tip, up to 8, each within a turn of zero."""
    centre = pose.position - arm.c[3] * pose.rotation[:, 2]
    solutions = []
    for shoulder in _positions(arm, centre):
        for wrist in _wrists(pose.rotation, *shoulder):
            theta = np.array([*shoulder, *wrist])
            angles = (theta + np.array(arm.offsets)) * np.array(arm.signs)
            solutions.append(np.remainder(angles + PI, 2 * PI) - PI)
    return solutions


def _positions(arm: Opw, centre: Array) -> list[tuple[float, float, float]]:
    """Return the first three angles for a centre of the wrist."""
    (a1, a2, b), (c1, c2, c3, _) = arm.a, arm.c
    x, y, z = centre
    nx = math.sqrt(x * x + y * y - b * b) - a1
    k = math.hypot(a2, c3)
    first, beside = math.atan2(y, x), math.atan2(b, nx + a1)
    found = []
    for theta1, s, tilt in (
        (first - beside, math.hypot(nx, z - c1), math.atan2(nx, z - c1)),
        (first + beside - PI, math.hypot(nx + 2 * a1, z - c1), -math.atan2(nx + 2 * a1, z - c1)),
    ):
        reach = (s * s + c2 * c2 - k * k) / (2 * s * c2)
        bend = (s * s - c2 * c2 - k * k) / (2 * c2 * k)
        if abs(reach) > 1.0 or abs(bend) > 1.0:
            continue
        for sense in (1, -1):
            theta2 = tilt - sense * math.acos(reach)
            theta3 = sense * math.acos(bend) - math.atan2(a2, c3)
            found.append((theta1, theta2, theta3))
    return found


def _wrists(
    rotation: Array, theta1: float, theta2: float, theta3: float
) -> list[tuple[float, float, float]]:
    """Return the two last three angles for an orientation."""
    s1, c1 = math.sin(theta1), math.cos(theta1)
    s23, c23 = math.sin(theta2 + theta3), math.cos(theta2 + theta3)
    along = np.array([s23 * c1, s23 * s1, c23])  # axis 4 in the base
    e1, e2, e3 = rotation.T
    m = float(along @ e3)
    theta4 = math.atan2(e3[1] * c1 - e3[0] * s1, e3[0] * c23 * c1 + e3[1] * c23 * s1 - e3[2] * s23)
    theta5 = math.atan2(math.sqrt(max(1.0 - m * m, 0.0)), m)
    theta6 = math.atan2(float(along @ e2), -float(along @ e1))
    return [(theta4, theta5, theta6), (theta4 + PI, -theta5, theta6 - PI)]
