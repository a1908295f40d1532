# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A quadruped: four legs, the order of its joints, its limits and its weight."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import math

from ..exceptions import DescriptionError
from .leg import Leg, leg_geometry, LegGeometry
from .leg_kinematics import foot_position, LegSolution, solve
from .tree import centre_of_mass
from .urdf import Description, Limits, parse, Vector

Targets = tuple[float, ...]
"""One position in [rad] or [m] for each commanded joint, in the order of the URDF."""

Feet = tuple[Vector, Vector, Vector, Vector]
"""Centres of the feet in the body's frame in [m], in the order of :class:`Leg`."""

BALANCE_PASSES = 3  # the centre of mass moves with the legs; this many passes settle to 0.1 mm


@dataclass(frozen=True, slots=True)
class Quadruped:
    """A robot.

    Attributes:
        description: What the URDF says.
        names: Commanded joints in the order of the URDF.
        limits: Their ranges, in the same order.
        legs: The four legs in the order of :class:`Leg`.
        leg_indices: For each leg the places of hip, thigh and calf in ``names``.
        mass: Weight of all links in [kg].
    """

    description: Description
    names: tuple[str, ...]
    limits: tuple[Limits, ...]
    legs: tuple[LegGeometry, ...]
    leg_indices: tuple[tuple[int, int, int], ...]
    mass: float

    @property
    def hip_centre(self) -> Vector:
        """Mean of the hip points in the body's frame in [m]."""
        hips = [leg.hip for leg in self.legs]
        count = len(hips)
        return (
            sum(hip[0] for hip in hips) / count,
            sum(hip[1] for hip in hips) / count,
            sum(hip[2] for hip in hips) / count,
        )

    @property
    def others(self) -> tuple[int, ...]:
        """Places of the joints that belong to no leg (those of an arm)."""
        taken = {index for indices in self.leg_indices for index in indices}
        return tuple(index for index in range(len(self.names)) if index not in taken)

    def leg_angles(self, positions: Sequence[float]) -> list[Vector]:
        """Take the joint positions of each leg out of those of all joints [rad]."""
        return [(positions[a], positions[b], positions[c]) for a, b, c in self.leg_indices]

    def feet(self, positions: Sequence[float]) -> Feet:
        """Return where the feet are for the positions of all joints [rad]."""
        one, two, three, four = (
            foot_position(leg, angles)
            for leg, angles in zip(self.legs, self.leg_angles(positions), strict=True)
        )
        return one, two, three, four

    def solve(self, feet: Sequence[Vector]) -> list[LegSolution]:
        """Return the joint positions of each leg for where the feet shall be."""
        return [solve(leg, foot) for leg, foot in zip(self.legs, feet, strict=True)]

    def place(self, solutions: Sequence[LegSolution], others: Sequence[float]) -> Targets:
        """Put the legs' joint positions among those of all joints.

        Args:
            solutions: One for each leg.
            others: Positions of all joints; those of the legs in it are replaced.
        """
        targets = list(others)
        for (hip, thigh, calf), solution in zip(self.leg_indices, solutions, strict=True):
            targets[hip], targets[thigh], targets[calf] = solution.angles
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
                    f'the legs do not reach a height of {height:.3f} m; choose a height between '
                    'folded and stretched legs'
                )
            placed = self.place(solutions, placed)
            centre = centre_of_mass(self.description, self._named(placed), 'base_link')
            shift = float(centre[0]) - self.hip_centre[0]
        return self._feet_below(shift, height)

    def _feet_below(self, shift: float, height: float) -> Feet:
        one, two, three, four = (
            (leg.hip[0] + shift, leg.hip[1] + leg.offset_y, leg.hip[2] - height)
            for leg in self.legs
        )
        return one, two, three, four

    def _named(self, positions: Sequence[float]) -> Mapping[str, float]:
        return dict(zip(self.names, positions, strict=True))


def quadruped(robot_description: str) -> Quadruped:
    """Make the model of a robot from its URDF.

    Args:
        robot_description: URDF as XML text.

    Raises:
        DescriptionError: It is no URDF of a quadruped with the joints that this stack knows.
    """
    description = parse(robot_description)
    commanded = description.commanded
    names = tuple(joint.name for joint in commanded)
    legs = tuple(leg_geometry(description, leg) for leg in Leg)
    for leg in Leg:
        for name in leg.joint_names:
            if name not in names:
                raise DescriptionError(f'{name} takes no commands: it is fixed or a mimic joint')
    for joint in commanded:
        if not joint.limits.velocity < math.inf:
            raise DescriptionError(f'{joint.name} has no velocity limit (limit velocity="...")')
    return Quadruped(
        description=description,
        names=names,
        limits=tuple(joint.limits for joint in commanded),
        legs=legs,
        leg_indices=tuple(_indices(names, leg) for leg in Leg),
        mass=sum(point.mass for point in description.masses.values()),
    )


def _indices(names: Sequence[str], leg: Leg) -> tuple[int, int, int]:
    hip, thigh, calf = (names.index(name) for name in leg.joint_names)
    return hip, thigh, calf
