# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Kinematic model of a quadruped: legs, joint order, limits and weight.

All legs are of the type roll - pitch - pitch: in the zero pose, the hip turns about the body's x
axis, thigh and calf about its y axis. Link shapes and zero positions are arbitrary; two lengths,
two angles and a lateral offset, measured in the zero pose, describe the leg.

The kinematics of a leg are in closed form. With the foot at (x, y, z) from the hip point and d
its lateral offset, the leg's plane is rolled by ``atan2(z, y) - atan2(depth, d)``,
``depth = -sqrt(y^2 + z^2 - d^2)``; inside it the law of cosines gives the knee and the angle to
the target gives the thigh. Plain floats, no arrays: this runs for four legs in every step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math
from typing import Final, NamedTuple

from urdf_reader import (
    centre_of_mass,
    DescriptionError,
    JointKind,
    KinematicTree,
    link_poses,
    NO_ROTATION,
    Quaternion,
    read_urdf,
    rotate,
    Vector,
)

from .presets import JointLimits, LEGS, limits_of, movable_joints

FEET: Final = tuple(f'{leg}_foot' for leg in LEGS)
"""Links of the feet, in the order of the legs."""

BASE: Final = 'base_link'  # link of the body; else the root of the URDF is
SPELLINGS: Final = {
    'fl': ('fl', 'lf'),
    'fr': ('fr', 'rf'),
    'bl': ('bl', 'rl', 'hl', 'lh'),
    'br': ('br', 'rr', 'hr', 'rh'),
}
"""How the legs are called in other URDFs, in small or large letters."""
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


def body_link(tree: KinematicTree) -> str:
    """Return the name of the body link."""
    return BASE if BASE in tree.links else tree.root


def foot_link(tree: KinematicTree, leg: str) -> str:
    """Return the name of a foot link: ``fl_foot``, or in other notations ``FL_foot``, ``LF_FOOT``.

    Raises:
        DescriptionError: No link or several links match.
    """
    names = [f'{each}_foot' for each in SPELLINGS[leg]]
    found = [link for link in tree.links if link.lower() in names]
    if len(found) != 1:
        raise DescriptionError(
            f'the foot of leg {leg} is one link named {" or ".join(names)}, in small or large '
            f'letters; the URDF has {" and ".join(found) or "none"}: rename its links'
        )
    return found[0]


def leg_geometry(tree: KinematicTree, leg: str) -> LegGeometry:
    """Derive the geometry of a leg from the joints between the body and its foot.

    Raises:
        DescriptionError: The leg does not have exactly three revolute joints, an axis has another
            direction, or a length is zero.
    """
    body, end = body_link(tree), foot_link(tree, leg)
    joints = [each for each in tree.chain(body, end) if each.kind is not JointKind.FIXED]
    names = tuple(joint.name for joint in joints)
    for joint in joints:
        if joint.kind not in _TURNING or joint.mimic is not None:
            raise DescriptionError(
                f'{joint.name} is in a leg and is not a turning joint of its own'
            )
    if len(joints) != len(_EXPECTED):
        raise DescriptionError(
            f'{len(joints)} joints move {end} ({", ".join(names)}); a leg has hip, thigh and calf'
        )
    poses = link_poses(tree, {}, body)
    signs = [
        _sign(rotate(poses[joint.child].rotation, joint.axis), unit, joint.name)
        for joint, unit in zip(joints, _EXPECTED, strict=True)
    ]
    hip, thigh, calf = (poses[joint.child].translation for joint in joints)
    foot = poses[end].translation
    thigh_length, thigh_pitch = _in_plane(thigh, calf)
    calf_length, calf_pitch = _in_plane(calf, foot)
    if min(thigh_length, calf_length) < AXIS_TOLERANCE:
        raise DescriptionError(f'leg {leg}: thigh or calf has no length')
    limits = [limits_of(joint) for joint in joints]
    knee = limits[2].lower + limits[2].upper  # of a joint without ends, not a number
    middle = calf_pitch - thigh_pitch + signs[2] * (knee / 2 if math.isfinite(knee) else 0.0)
    return LegGeometry(
        joints=(names[0], names[1], names[2]),
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
        limits=(limits[0], limits[1], limits[2]),
    )


def _sign(axis: Vector, unit: Vector, name: str) -> float:
    along = sum(a * b for a, b in zip(axis, unit, strict=True))
    if abs(abs(along) - 1.0) > AXIS_TOLERANCE:
        raise DescriptionError(
            f'{name} turns about {[round(part, 3) for part in axis]} of the body; hips must turn '
            'about x, thighs and calves about y'
        )
    return math.copysign(1.0, along)


def _in_plane(upper: Vector, lower: Vector) -> tuple[float, float]:
    """Return length and pitch of a link in side view."""
    x, z = lower[0] - upper[0], lower[2] - upper[2]
    return math.hypot(x, z), math.atan2(-x, -z)


@dataclass(frozen=True, slots=True)
class LegSolution:
    """Inverse kinematics solution for a foot."""

    angles: Vector  # hip, thigh, calf in [rad], always within the limits
    reachable: bool  # whether they bring the foot to where it was requested
    # distance of the foot from the edge of the reach in [m], negative outside; joint limits are
    # not counted
    margin: float


def solve(leg: LegGeometry, foot: Vector) -> LegSolution:
    """Solve the inverse kinematics for a foot in the body's frame [m]; clamp to the reach."""
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
    """Return the foot's centre in the body's frame [m] for hip, thigh and calf angles."""
    roll, upper, lower = _pitches(leg, angles)
    x = leg.thigh_x - leg.thigh_length * math.sin(upper) - leg.calf_length * math.sin(lower)
    z = leg.thigh_z - leg.thigh_length * math.cos(upper) - leg.calf_length * math.cos(lower)
    y, sine, cosine = leg.offset_y, math.sin(roll), math.cos(roll)
    return (leg.hip[0] + x, leg.hip[1] + y * cosine - z * sine, leg.hip[2] + y * sine + z * cosine)


def calf_rotation(leg: LegGeometry, angles: Vector) -> Quaternion:
    """Return the rotation of calf and foot from the zero pose, in the body's frame."""
    roll = leg.signs[0] * angles[0] / 2
    pitch = (leg.signs[1] * angles[1] + leg.signs[2] * angles[2]) / 2
    sr, cr, sp, cp = math.sin(roll), math.cos(roll), math.sin(pitch), math.cos(pitch)
    return sr * cp, cr * sp, sr * sp, cr * cp


def jacobian(leg: LegGeometry, angles: Vector) -> tuple[Vector, Vector, Vector]:
    """Return the derivatives of the foot position [m] by each joint [rad], as columns."""
    roll, upper, lower = _pitches(leg, angles)
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


def _pitches(leg: LegGeometry, angles: Vector) -> Vector:
    """Return the roll of the leg's plane, and the pitches of thigh and calf within it."""
    hip, thigh, calf = (sign * angle for sign, angle in zip(leg.signs, angles, strict=True))
    return hip, thigh + leg.thigh_pitch, thigh + calf + leg.calf_pitch


def wrapped(angle: float) -> float:
    """Wrap an angle to -pi to pi [rad]."""
    return math.remainder(angle, math.tau)


MAX_GAP = 0.005  # [m] above the plane of the other three, of a foot that stands


def raised_feet(feet: Sequence[Vector]) -> tuple[str, ...]:
    """Return the names of the feet [m] in the air while the other three stand on any plane.

    With one foot or a diagonal pair lifted, the robot rocks, so both feet of the diagonal count.
    """
    raised = []
    for index, link in enumerate(FEET):
        a, b, c = (foot for other, foot in enumerate(feet) if other != index)
        (bx, by, bz), (cx, cy, cz), (x, y, z) = (
            (one[0] - a[0], one[1] - a[1], one[2] - a[2]) for one in (b, c, feet[index])
        )
        normal = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
        length = math.copysign(math.hypot(*normal), normal[2])  # up, in the body
        height = normal[0] * x + normal[1] * y + normal[2] * z
        if length and height / length > MAX_GAP:
            raised.append(link)
    return tuple(raised)


Targets = tuple[float, ...]
"""One position in [rad] or [m] for each commanded joint, in the order of the URDF."""

Feet = tuple[Vector, Vector, Vector, Vector]
"""Centres of the feet in the body's frame in [m], in the order of :data:`LEGS`."""

BALANCE_PASSES = 3  # the centre of mass moves with the legs; this many passes settle to 0.1 mm


class FootPose(NamedTuple):
    """Position and rotation of a foot."""

    position: Vector  # of its centre in [m]
    # how it is turned against the zero pose, in what the position is given in
    rotation: Quaternion


@dataclass(frozen=True, slots=True)
class Quadruped:
    """Kinematic model of a robot."""

    tree: KinematicTree  # what the URDF says
    names: tuple[str, ...]  # commanded joints in the order of the URDF
    limits: tuple[JointLimits, ...]  # their ranges, in the same order
    legs: tuple[LegGeometry, ...]  # the four legs in the order of :data:`LEGS`
    # for each leg the places of hip, thigh and calf in ``names``
    leg_indices: tuple[tuple[int, int, int], ...]
    mass: float  # weight of all links in [kg]
    foot_radius: float  # of the ball that a foot is in [m]; 0 where the URDF has none

    @property
    def hip_centre(self) -> Vector:
        """Mean of the hip points in the body's frame in [m]."""
        hips = [leg.hip for leg in self.legs]
        x, y, z = (sum(axis) / len(hips) for axis in zip(*hips, strict=True))
        return x, y, z

    @property
    def leg_length(self) -> float:
        """Thigh and calf of the first leg in [m]."""
        return self.legs[0].thigh_length + self.legs[0].calf_length

    @property
    def others(self) -> tuple[int, ...]:
        """Indices of the non-leg joints (those of an arm)."""
        taken = {index for indices in self.leg_indices for index in indices}
        return tuple(index for index in range(len(self.names)) if index not in taken)

    def rotation_of(self, link: str) -> Quaternion:
        """Return a link's rotation in the body at zero, (x, y, z, w); identity if unknown."""
        pose = link_poses(self.tree, {}, body_link(self.tree)).get(link)
        return NO_ROTATION if pose is None else pose.rotation

    def leg_angles(self, positions: Sequence[float]) -> list[Vector]:
        """Return the positions of each leg from those of all joints [rad]."""
        return [(positions[a], positions[b], positions[c]) for a, b, c in self.leg_indices]

    def feet(self, positions: Sequence[float]) -> Feet:
        """Return the foot positions for joint positions [rad]; non-leg joints may be omitted."""
        one, two, three, four = (
            foot_position(leg, angles)
            for leg, angles in zip(self.legs, self.leg_angles(positions), strict=True)
        )
        return one, two, three, four

    def foot_poses(self, positions: Sequence[float]) -> list[FootPose]:
        """Return the foot poses for joint positions; see :meth:`feet`."""
        pairs = zip(self.legs, self.leg_angles(positions), strict=True)
        return [FootPose(foot_position(*pair), calf_rotation(*pair)) for pair in pairs]

    def standing_height(self, positions: Sequence[float]) -> float:
        """Return the height of a level base_link above its lowest foot's contact point [m]."""
        return self.foot_radius - min(z for _, _, z in self.feet(positions))

    def solve(self, feet: Sequence[Vector]) -> list[LegSolution]:
        """Solve the inverse kinematics of all legs for foot positions."""
        return [solve(leg, foot) for leg, foot in zip(self.legs, feet, strict=True)]

    def place(self, solutions: Sequence[LegSolution], others: Sequence[float]) -> Targets:
        """Replace the leg positions among those of all joints; return the result."""
        return self.with_legs([solution.angles for solution in solutions], others)

    def with_legs(self, angles: Sequence[Vector], others: Sequence[float]) -> Targets:
        """Like :meth:`place`, with hip, thigh and calf positions of each leg [rad]."""
        targets = list(others)
        for (hip, thigh, calf), leg in zip(self.leg_indices, angles, strict=True):
            targets[hip], targets[thigh], targets[calf] = leg
        return tuple(targets)

    def clamp(self, positions: Sequence[float]) -> Targets:
        """Clamp positions to the joint limits."""
        return tuple(
            limits.clamp(position) for limits, position in zip(self.limits, positions, strict=True)
        )

    def footprint(self, height: float, positions: Sequence[float]) -> Feet:
        """Return the foot positions that put the centre of mass over their middle.

        Args:
            height: Height of the hip axes above the foot centres in [m].
            positions: Positions of all joints in [rad]; those of an arm shift the centre of mass.

        Raises:
            DescriptionError: The feet are out of reach.
        """
        placed: Sequence[float] = positions
        shift = 0.0
        for _ in range(BALANCE_PASSES):
            feet = self._feet_below(shift, height)
            solutions = self.solve(feet)
            if not all(solution.reachable for solution in solutions):
                raise DescriptionError(
                    f'the legs do not reach a height of {height:.3f} m; set nominal_height and '
                    f'lie_height between folded and straight legs ({self.leg_length:.3f} m)'
                )
            placed = self.place(solutions, placed)
            named = dict(zip(self.names, placed, strict=True))
            centre = centre_of_mass(
                self.tree.masses(), link_poses(self.tree, named, body_link(self.tree))
            )
            if centre is None:
                raise DescriptionError('the robot description has no masses (inertial/mass)')
            shift = centre[0] - self.hip_centre[0]
        return self._feet_below(shift, height)

    def _feet_below(self, shift: float, height: float) -> Feet:
        one, two, three, four = (
            (leg.hip[0] + shift, leg.hip[1] + leg.offset_y, leg.hip[2] - height)
            for leg in self.legs
        )
        return one, two, three, four


def quadruped(urdf: str) -> Quadruped:
    """Build the kinematic model of a robot from its URDF.

    Raises:
        DescriptionError: The URDF is not that of a quadruped with roll - pitch - pitch legs.
    """
    tree = read_urdf(urdf)
    joints = movable_joints(tree)
    names = tuple(joint.name for joint in joints)
    legs = tuple(leg_geometry(tree, leg) for leg in LEGS)
    shapes = (*tree.collisions(), *tree.visuals())
    foot = foot_link(tree, LEGS[0])
    feet = (each for each in shapes if each.link == foot and each.shape == 'sphere')
    return Quadruped(
        tree=tree,
        names=names,
        limits=tuple(joint.limits for joint in joints),
        legs=legs,
        leg_indices=tuple(_indices(names, leg) for leg in legs),
        mass=sum(point.mass for point in tree.masses()),
        foot_radius=next((foot.lengths('radius')[0] for foot in feet), 0.0),
    )


def _indices(names: Sequence[str], leg: LegGeometry) -> tuple[int, int, int]:
    hip, thigh, calf = (names.index(name) for name in leg.joints)
    return hip, thigh, calf
