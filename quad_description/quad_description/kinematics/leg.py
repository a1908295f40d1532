# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A leg of three joints: its geometry, derived from the URDF.

The family of legs is roll - pitch - pitch: the hip turns about the body's x axis, thigh and calf
about its y axis, at the zero pose. Link shapes may be bent and zeros may be anywhere; what matters
are two lengths, two angles and an offset to the side, all measured in the zero pose.
"""

from __future__ import annotations

from dataclasses import dataclass
import math
from typing import Final

from ..exceptions import DescriptionError
from ..rotations import rotate, Vector
from ..urdf import Description, Joint, JointKind, JointLimits
from .tree import BASE, link_poses

LEGS: Final = ('fl', 'fr', 'bl', 'br')
"""Front left, front right, back left, back right: the order of the legs everywhere."""
FEET: Final = tuple(f'{leg}_foot' for leg in LEGS)
"""Links of the feet, in the order of the legs."""

AXIS_TOLERANCE = 1e-6
_TURNING = (JointKind.REVOLUTE, JointKind.CONTINUOUS)
_EXPECTED: tuple[Vector, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 1.0, 0.0))


@dataclass(frozen=True, slots=True)
class LegGeometry:
    """Lengths in [m], angles in [rad]; "pitch" is the angle of a link from straight down.

    A positive pitch turns the link's lower end backward (right-hand rule about y).
    """

    joints: tuple[str, str, str]  # names of the hip, thigh and calf joints
    # point on the hip axis that is beside the thigh joint's origin, in the body's frame
    hip: Vector
    thigh_x: float  # thigh axis ahead of the hip point
    thigh_z: float  # thigh axis above the hip axis
    offset_y: float  # plane of the foot beside the hip axis, positive to the left
    thigh_length: float  # thigh axis to calf axis
    calf_length: float  # calf axis to the foot's centre
    thigh_pitch: float  # pitch of the thigh at zero
    calf_pitch: float  # pitch of the line from calf axis to foot at zero
    signs: Vector  # sense of the three joints: 1 when positive is right-handed about +x, +y, +y
    knee_sign: float  # 1 when the knee bends so that the calf pitches backward, else -1
    limits: tuple[JointLimits, JointLimits, JointLimits]  # ranges of the three joints


def leg_geometry(description: Description, leg: str) -> LegGeometry:
    """Derive the geometry of a leg from the joints between base_link and its foot.

    Args:
        leg: One of :data:`LEGS`; its foot is the link ``<leg>_foot``.

    Raises:
        DescriptionError: Other than three turning joints move the foot, an axis points
            elsewhere, or a length is zero.
    """
    joints = _chain(description, f'{leg}_foot')
    poses = link_poses(description, {})
    signs = [
        _sign(rotate(poses[joint.child].rotation, joint.axis), unit, joint.name)
        for joint, unit in zip(joints, _EXPECTED, strict=True)
    ]
    hip, thigh, calf = (poses[joint.child].position for joint in joints)
    foot = poses[f'{leg}_foot'].position
    thigh_length, thigh_pitch = _in_plane(thigh, calf)
    calf_length, calf_pitch = _in_plane(calf, foot)
    if min(thigh_length, calf_length) < AXIS_TOLERANCE:
        raise DescriptionError(f'leg {leg}: thigh or calf has no length')
    limits = (joints[0].limits, joints[1].limits, joints[2].limits)
    middle = calf_pitch - thigh_pitch + signs[2] * _middle(limits[2])
    return LegGeometry(
        joints=(joints[0].name, joints[1].name, joints[2].name),
        hip=hip,
        thigh_x=thigh[0] - hip[0],
        thigh_z=thigh[2] - hip[2],
        offset_y=foot[1] - hip[1],
        thigh_length=thigh_length,
        calf_length=calf_length,
        thigh_pitch=thigh_pitch,
        calf_pitch=calf_pitch,
        signs=(signs[0], signs[1], signs[2]),
        knee_sign=math.copysign(1.0, middle),
        limits=limits,
    )


def _chain(description: Description, foot: str) -> list[Joint]:
    """Return the turning joints from the body to a foot."""
    above = {joint.child: joint for joint in description.joints}
    chain: list[Joint] = []
    link = foot
    while link != BASE:
        if link not in above:
            raise DescriptionError(
                f'the robot description has no chain from {BASE} to {foot}: nothing moves {link}'
            )
        joint = above.pop(link)
        if joint.kind is not JointKind.FIXED:
            chain.insert(0, joint)
        link = joint.parent
    for joint in chain:
        if joint.kind not in _TURNING or joint.mimics:
            raise DescriptionError(
                f'{joint.name} is in a leg and is not a turning joint of its own'
            )
    if len(chain) != len(_EXPECTED):
        raise DescriptionError(
            f'{len(chain)} joints move {foot} ({", ".join(joint.name for joint in chain)}); a leg '
            'has hip, thigh and calf'
        )
    return chain


def _sign(axis: Vector, unit: Vector, name: str) -> float:
    along = sum(a * b for a, b in zip(axis, unit, strict=True))
    if abs(abs(along) - 1.0) > AXIS_TOLERANCE:
        raise DescriptionError(
            f'{name} turns about {[round(part, 3) for part in axis]} of the body; hips must turn '
            'about x, thighs and calves about y'
        )
    return math.copysign(1.0, along)


def _in_plane(upper: Vector, lower: Vector) -> tuple[float, float]:
    """Return length and pitch of a link, seen from the side."""
    x, z = lower[0] - upper[0], lower[2] - upper[2]
    return math.hypot(x, z), math.atan2(-x, -z)


def _middle(limits: JointLimits) -> float:
    if math.isinf(limits.lower) or math.isinf(limits.upper):
        return 0.0
    return (limits.lower + limits.upper) / 2
