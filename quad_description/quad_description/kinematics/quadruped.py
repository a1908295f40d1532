# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A quadruped: four legs, the order of its joints, its limits and its weight."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math
from typing import NamedTuple

from urdf_reader import (
    centre_of_mass,
    DescriptionError,
    KinematicTree,
    link_poses,
    Quaternion,
    read_urdf,
    Vector,
)

from ..urdf import JointLimits, movable_joints
from .leg import (
    body_link,
    calf_rotation,
    FEET,
    foot_link,
    foot_position,
    leg_geometry,
    LegGeometry,
    LEGS,
    LegSolution,
    solve,
)

MAX_GAP = 0.005  # [m] above the plane of the other three, of a foot that stands


def raised_feet(feet: Sequence[Vector]) -> tuple[str, ...]:
    """Return the feet that are in the air while the other three stand, whatever their plane.

    With one foot or a diagonal pair lifted, the robot rocks: both feet of the diagonal are raised.

    Args:
        feet: Their centres in the body, in the order of FEET [m].
    """
    raised = []
    for index, link in enumerate(FEET):
        a, b, c = (foot for other, foot in enumerate(feet) if other != index)
        normal = _cross(_difference(b, a), _difference(c, a))
        length = math.copysign(math.hypot(*normal), normal[2])  # up, in the body
        way = _difference(feet[index], a)
        height = sum(n * w for n, w in zip(normal, way, strict=True))
        if length and height / length > MAX_GAP:
            raised.append(link)
    return tuple(raised)


def _difference(one: Vector, other: Vector) -> Vector:
    return one[0] - other[0], one[1] - other[1], one[2] - other[2]


def _cross(one: Vector, other: Vector) -> Vector:
    return (
        one[1] * other[2] - one[2] * other[1],
        one[2] * other[0] - one[0] * other[2],
        one[0] * other[1] - one[1] * other[0],
    )


Targets = tuple[float, ...]
"""One position in [rad] or [m] for each commanded joint, in the order of the URDF."""

Feet = tuple[Vector, Vector, Vector, Vector]
"""Centres of the feet in the body's frame in [m], in the order of :data:`LEGS`."""

BALANCE_PASSES = 3  # the centre of mass moves with the legs; this many passes settle to 0.1 mm


class FootPose(NamedTuple):
    """Where a foot is."""

    position: Vector  # of its centre in [m]
    # how it is turned against the zero pose, in what the position is given in
    rotation: Quaternion


@dataclass(frozen=True, slots=True)
class Quadruped:
    """A robot."""

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
        """Places of the joints that belong to no leg (those of an arm)."""
        taken = {index for indices in self.leg_indices for index in indices}
        return tuple(index for index in range(len(self.names)) if index not in taken)

    def leg_angles(self, positions: Sequence[float]) -> list[Vector]:
        """Return the joint positions of each leg from those of all joints [rad]."""
        return [(positions[a], positions[b], positions[c]) for a, b, c in self.leg_indices]

    def feet(self, positions: Sequence[float]) -> Feet:
        """Return where the feet are for the positions of the joints [rad].

        Args:
            positions: In the order of ``names``; what comes behind the legs may be left out.
        """
        one, two, three, four = (
            foot_position(leg, angles)
            for leg, angles in zip(self.legs, self.leg_angles(positions), strict=True)
        )
        return one, two, three, four

    def foot_poses(self, positions: Sequence[float]) -> list[FootPose]:
        """Return where the feet are and how they are turned, as :meth:`feet`."""
        pairs = zip(self.legs, self.leg_angles(positions), strict=True)
        return [FootPose(foot_position(*pair), calf_rotation(*pair)) for pair in pairs]

    def standing_height(self, positions: Sequence[float]) -> float:
        """Return how high a level base_link is above ground that its lowest foot touches [m]."""
        return self.foot_radius - min(z for _, _, z in self.feet(positions))

    def solve(self, feet: Sequence[Vector]) -> list[LegSolution]:
        """Return the joint positions of each leg for where the feet shall be."""
        return [solve(leg, foot) for leg, foot in zip(self.legs, feet, strict=True)]

    def place(self, solutions: Sequence[LegSolution], others: Sequence[float]) -> Targets:
        """Put the legs' joint positions among those of all joints.

        Args:
            others: Positions of all joints; those of the legs in it are replaced.
        """
        return self.with_legs([solution.angles for solution in solutions], others)

    def with_legs(self, angles: Sequence[Vector], others: Sequence[float]) -> Targets:
        """Do as :meth:`place` with positions of hip, thigh and calf of each leg [rad]."""
        targets = list(others)
        for (hip, thigh, calf), leg in zip(self.leg_indices, angles, strict=True):
            targets[hip], targets[thigh], targets[calf] = leg
        return tuple(targets)

    def clamp(self, positions: Sequence[float]) -> Targets:
        """Return the nearest positions within the limits."""
        return tuple(
            limits.clamp(position) for limits, position in zip(self.limits, positions, strict=True)
        )

    def footprint(self, height: float, positions: Sequence[float]) -> Feet:
        """Return where the feet stand with the centre of mass over their middle.

        Args:
            height: Hip axes above the centres of the feet in [m].
            positions: Positions of all joints in [rad]; of interest for an arm, whose weight
                moves the centre of mass.

        Raises:
            DescriptionError: The legs do not reach so far.
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
    """Make the model of a robot from its URDF.

    Raises:
        DescriptionError: It is no URDF of a quadruped whose legs turn about x, y and y.
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
