# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A leg of three joints: its geometry, derived from the URDF.

The family of legs is roll - pitch - pitch: the hip turns about the body's x axis, thigh and calf
about its y axis, at the zero pose. Link shapes may be bent and zeros may be anywhere; what matters
are two lengths, two angles and an offset to the side, all measured in the zero pose.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
import math

import numpy as np

from ..exceptions import DescriptionError
from .tree import link_poses, Matrix
from .urdf import Description, Limits, Vector

AXIS_TOLERANCE = 1e-6


class Leg(Enum):
    """The legs in the order of the description; the value is the prefix of its names."""

    FRONT_LEFT = 'fl'
    FRONT_RIGHT = 'fr'
    BACK_LEFT = 'bl'
    BACK_RIGHT = 'br'

    @property
    def joint_names(self) -> tuple[str, str, str]:
        """Names of its joints, from the body to the foot."""
        return f'{self.value}_hip_joint', f'{self.value}_thigh_joint', f'{self.value}_calf_joint'

    @property
    def foot_link(self) -> str:
        """Name of the link at its end."""
        return f'{self.value}_foot'


@dataclass(frozen=True, slots=True)
class LegGeometry:
    """Lengths in [m], angles in [rad]; "pitch" is the angle of a link from straight down.

    A positive pitch turns the link's lower end backward (right-hand rule about y).

    Attributes:
        hip: Point on the hip axis that is beside the thigh joint's origin, in the body's frame.
        thigh_x: Thigh axis ahead of the hip point.
        thigh_z: Thigh axis above the hip axis.
        offset_y: Plane of the foot beside the hip axis, positive to the left.
        thigh_length: Thigh axis to calf axis.
        calf_length: Calf axis to the foot's centre.
        thigh_pitch: Pitch of the thigh at zero.
        calf_pitch: Pitch of the line from calf axis to foot at zero.
        signs: Sense of the three joints: 1 when positive is right-handed about +x, +y, +y.
        knee_sign: 1 when the knee bends so that the calf pitches backward, else -1.
        limits: Ranges of the three joints.
    """

    hip: Vector
    thigh_x: float
    thigh_z: float
    offset_y: float
    thigh_length: float
    calf_length: float
    thigh_pitch: float
    calf_pitch: float
    signs: Vector
    knee_sign: float
    limits: tuple[Limits, Limits, Limits]


def leg_geometry(description: Description, leg: Leg, base: str = 'base_link') -> LegGeometry:
    """Derive the geometry of a leg.

    Args:
        description: The robot.
        leg: Which leg.
        base: Link of the body.

    Raises:
        DescriptionError: A joint is missing, an axis points elsewhere, or a length is zero.
    """
    joints = [description.joint(name) for name in leg.joint_names]
    poses = link_poses(description, {}, base)
    if leg.foot_link not in poses:
        raise DescriptionError(f'the robot description has no link {leg.foot_link!r} below {base}')
    axes = [poses[joint.child][:3, :3] @ joint.axis for joint in joints]
    expected = np.eye(3)[[0, 1, 1]]
    signs = [
        _sign(axis, unit, name)
        for axis, unit, name in zip(axes, expected, leg.joint_names, strict=True)
    ]
    hip, thigh, calf = (poses[joint.child][:3, 3] for joint in joints)
    foot = poses[leg.foot_link][:3, 3]
    thigh_vector, calf_vector = calf - thigh, foot - calf
    thigh_pitch, calf_pitch = _pitch(thigh_vector), _pitch(calf_vector)
    lengths = [math.hypot(vector[0], vector[2]) for vector in (thigh_vector, calf_vector)]
    if min(lengths) < AXIS_TOLERANCE:
        raise DescriptionError(f'leg {leg.value}: thigh or calf has no length')
    limits = (joints[0].limits, joints[1].limits, joints[2].limits)
    middle = calf_pitch - thigh_pitch + signs[2] * _middle(limits[2])
    return LegGeometry(
        hip=(float(hip[0]), float(hip[1]), float(hip[2])),
        thigh_x=float(thigh[0] - hip[0]),
        thigh_z=float(thigh[2] - hip[2]),
        offset_y=float(foot[1] - hip[1]),
        thigh_length=lengths[0],
        calf_length=lengths[1],
        thigh_pitch=thigh_pitch,
        calf_pitch=calf_pitch,
        signs=(signs[0], signs[1], signs[2]),
        knee_sign=math.copysign(1.0, middle),
        limits=limits,
    )


def _sign(axis: Matrix, unit: Matrix, name: str) -> float:
    along = float(axis @ unit)
    if abs(abs(along) - 1.0) > AXIS_TOLERANCE:
        raise DescriptionError(
            f'{name} turns about {np.round(axis, 3).tolist()} of the body; hips must turn about '
            'x, thighs and calves about y'
        )
    return math.copysign(1.0, along)


def _pitch(vector: Matrix) -> float:
    return math.atan2(-float(vector[0]), -float(vector[2]))


def _middle(limits: Limits) -> float:
    if math.isinf(limits.lower) or math.isinf(limits.upper):
        return 0.0
    return (limits.lower + limits.upper) / 2
