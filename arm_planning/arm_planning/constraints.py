# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Whether a state heeds constraints of joints, orientations and positions."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from arm_model import (
    Array,
    Box,
    combined,
    Cone,
    Cylinder,
    inverse,
    ORIGIN,
    PlacedShape,
    Pose,
    RobotModel,
    Sphere,
)

from .exceptions import PlanningCode, PlanningError
from .ik.link_kinematics import LinkKinematics, pose_error
from .requests import OrientationConstraint, PathConstraints, PositionConstraint

TOLERANCE = 1e-6
"""Rounding beyond a constraint that is let pass in [rad] and [m]."""


@dataclass(frozen=True, slots=True)
class ConstraintResult:
    """What became of one constraint in a state.

    Attributes:
        violation: What is wrong, in words; empty where it is heeded.
        distance: How far the state is beyond it, in [rad] or [m]; 0 where it is heeded.
    """

    violation: str
    distance: float


HEEDED = ConstraintResult('', 0.0)


class ConstraintCheck:
    """Looks at states of one arm; belongs to one thread."""

    def __init__(self, model: RobotModel, constraints: PathConstraints) -> None:
        """Prepare.

        Args:
            model: The arm.
            constraints: What must hold.

        Raises:
            PlanningError: A link is unknown, or no joint moves it.
        """
        self._joints = tuple(model.joints)
        self._constraints = constraints
        names = {each.link for each in constraints.orientations}
        names |= {each.link for each in constraints.positions}
        self._links = {name: LinkKinematics(model, name) for name in names}

    def violated(self, positions: Array) -> str:
        """Return what a state violates first, in words; empty for nothing.

        Args:
            positions: Joint positions in [rad] (n).
        """
        violations = (each.violation for each in self.results(positions))
        return next(filter(None, violations), '')

    def results(self, positions: Array) -> Iterator[ConstraintResult]:
        """Yield what becomes of each constraint: of joints, orientations, then positions.

        Args:
            positions: Joint positions in [rad] (n).
        """
        place = dict(zip(self._joints, positions.tolist(), strict=True))
        for name, (lower, upper) in self._constraints.joints.items():
            beyond = max(lower - place[name], place[name] - upper)
            yield _result(
                beyond,
                f'{name} is at {place[name]:.4f}, its constraint is {lower:.4f}..{upper:.4f}',
            )
        poses = {name: link.pose(positions) for name, link in self._links.items()}
        for turn in self._constraints.orientations:
            yield _turned(turn, poses[turn.link])
        for point in self._constraints.positions:
            yield _outside(point, poses[point.link])


def _result(beyond: float, violation: str) -> ConstraintResult:
    return ConstraintResult(violation, beyond) if beyond > TOLERANCE else HEEDED


def _turned(constraint: OrientationConstraint, pose: Pose) -> ConstraintResult:
    wanted = Pose(constraint.rotation, pose.position)
    # the rotation vector about the axes that are wanted
    off = np.abs(constraint.rotation.T @ pose_error(wanted, pose)[3:])
    angles = ', '.join(f'{each:.3f}' for each in off.tolist())
    allowed = ', '.join(f'{each:.3f}' for each in constraint.tolerance.tolist())
    return _result(
        float((off - constraint.tolerance).max()),
        f'link {constraint.link} is turned by ({angles}) rad, ({allowed}) are allowed',
    )


def _outside(constraint: PositionConstraint, pose: Pose) -> ConstraintResult:
    point = pose.position + pose.rotation @ constraint.offset
    x, y, z = point.tolist()
    return _result(
        min(_beyond(region, point) for region in constraint.regions),
        f'link {constraint.link} is outside of its region, at ({x:.3f}, {y:.3f}, {z:.3f})',
    )


def _beyond(region: PlacedShape, point: Array) -> float:
    """Return how far a point of the root link is beyond a region in [m]; 0 or less inside."""
    in_region = combined(inverse(region.pose), Pose(ORIGIN.rotation, point)).position
    height = float(in_region[2])
    aside = float(np.hypot(in_region[0], in_region[1]))
    match region.shape:
        case Box(x, y, z):
            return float((np.abs(in_region) - 0.5 * np.array([x, y, z])).max())
        case Sphere(radius):
            return float(np.linalg.norm(in_region)) - radius
        case Cylinder(radius, length):
            return max(aside - radius, abs(height) - 0.5 * length)
        case Cone(radius, length):
            # its tip is above its middle
            at_height = radius * (0.5 - height / length)
            return max(aside - at_height, abs(height) - 0.5 * length)
    raise PlanningError(
        PlanningCode.INVALID_GOAL_CONSTRAINTS,
        f'the region of a position constraint is a {type(region.shape).__name__}; use a box,'
        ' sphere, cylinder or cone',
    )
