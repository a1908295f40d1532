# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Joint, orientation and position constraints: checks states, and projects states onto them.

A constraint consists of rows: functions of the joint positions that must stay between two bounds,
with their gradients. Newton steps on the violated rows project a state (Berenson et al.,
"Manipulation planning on constraint manifolds", ICRA 2009).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
import math

import numpy as np
import pinocchio as pin

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
from arm_trajectory import Path

from .exceptions import PlanningCode, PlanningError
from .link_kinematics import LinkKinematics
from .requests import OrientationConstraint, Parameterization, PathConstraints, PositionConstraint
from .validity import Violation

TOLERANCE = 1e-6  # rounding beyond a constraint that is let pass in [rad] and [m]


STEP = 4e-3  # turn of all joints together between two looks at a path in [rad] or [m]

LEAST_ROOMS = 4.0
"""Least width of a path constraint, as a multiple of the change between two samples of a path."""

WIDEST = 0.1  # half width beyond which the share of a constraint grows no more, in [rad] or [m]
COARSE_LOOKS = 2000  # looks at a path by which the others are laid out
INNER = 0.8  # share of a constraint into which a state is led that broke it

STEEPEST = 0.5 * np.pi - 0.01
"""Limit of the second Euler angle in [rad]; beyond it the other two are indistinguishable."""

MAX_ITERATIONS = 12  # newton steps at most
DAMPING = 1e-3  # of the steps, for rows of which the joints can move one with another only


@dataclass(frozen=True, slots=True)
class ConstraintResult:
    """Result of checking one constraint in one state."""

    violation: str  # what is wrong, in words; empty if satisfied
    distance: float  # how far the state violates it, in [rad] or [m]; 0 if satisfied


HEEDED = ConstraintResult('', 0.0)


@dataclass(frozen=True, slots=True)
class _Rows:
    """Functions of the joint positions, with their bounds and gradients."""

    values: Array  # in [rad] or [m] (k)
    lower: Array  # least values (k)
    upper: Array  # greatest values (k)
    gradients: Array  # by the joint positions (k, n)
    room: float  # how far a value changes between a look at a path and the middle to the next

    @property
    def beyond(self) -> float:
        """Greatest violation of the bounds, in [rad] or [m]; 0 or less inside."""
        return float(np.maximum(self.lower - self.values, self.values - self.upper).max())

    @property
    def half(self) -> Array:
        """Half the width of the bounds (k); values without a lower bound are lengths."""
        two_sided = np.isfinite(self.lower)
        width = self.upper - np.where(two_sided, self.lower, -self.upper)
        half: Array = 0.5 * width
        return half

    def excess(self, share: float, rooms: float) -> Array:
        """Return how far each value (k) exceeds its bounds, shrunk by share and rooms."""
        inset = rooms * self.room + (1.0 - share) * np.minimum(self.half, WIDEST)
        return self.values - np.clip(self.values, self.lower + inset, self.upper - inset)


class ConstraintCheck:
    """Checks constraints of states and paths of one arm. Not thread-safe."""

    def __init__(self, model: RobotModel, *constraints: PathConstraints) -> None:
        self._joints = tuple(model.joints)
        self._limits = model.limits
        self._reach = max(model.reach, 1.0)
        self.constraints = constraints
        names = {each.link for every in constraints for each in every.orientations}
        names |= {each.link for every in constraints for each in every.positions}
        self._links = {name: LinkKinematics(model, name) for name in names}

    def violated(self, positions: Array) -> str:
        """Describe the first constraint that a state violates; empty if there is none."""
        violations = (each.violation for each in self.results(positions))
        return next(filter(None, violations), '')

    def results(self, positions: Array) -> Iterator[ConstraintResult]:
        """Yield the result of each constraint: joints, orientations, then positions."""
        for rows, words in self._all(positions):
            beyond = rows.beyond
            yield ConstraintResult(words(), beyond) if beyond > TOLERANCE else HEEDED

    def heeds(self, positions: Array) -> bool:
        """Whether all constraints hold, with margin up to the next sample of a path."""
        return not any(rows.excess(1.0, 1.0).any() for rows, _ in self._all(positions))

    def projected(self, positions: Array, *, rooms: float = 1.0) -> Array | None:
        """Return a nearby state that satisfies the constraints; None if none was found.

        ``rooms`` is 1 for states of a path, 0 for a state at which the motion ends.
        """
        state = positions
        for _ in range(MAX_ITERATIONS):
            rows = [each for each, _ in self._all(state)]
            if not any(each.excess(1.0, rooms).any() for each in rows):
                return state
            excess = np.concatenate([each.excess(INNER, rooms) for each in rows])
            broken = excess != 0.0
            gradients = np.concatenate([each.gradients for each in rows])[broken]
            square = gradients @ gradients.T + DAMPING**2 * np.eye(len(gradients))
            step = gradients.T @ np.linalg.solve(square, excess[broken])
            state = np.clip(state - step, self._limits.lower, self._limits.upper)
        return None

    def path(self, path: Path, *, at_looks: bool = False) -> Violation | None:
        """Return where a path first violates a constraint; None if it never does.

        With ``at_looks`` the constraints are checked at the samples only, without a margin.
        """
        coarse = np.linspace(0.0, path.duration, COARSE_LOOKS)
        turned = np.abs(np.diff(path.positions(coarse), axis=0)).sum(axis=1)
        along = np.concatenate(((0.0,), np.cumsum(turned)))
        count = int(np.ceil(along[-1] / STEP)) + 1
        times = np.interp(np.linspace(0.0, along[-1], count + 1), along, coarse)
        for time, positions in zip(times.tolist(), path.positions(times), strict=True):
            if not self.heeds(positions) and (not at_looks or self.violated(positions)):
                return Violation(self.reason(positions), positions, time=time)
        return None

    def lines(self, places: Array) -> Violation | None:
        """Return where straight motions first violate a constraint; None if they never do."""
        for begin, end in pairwise(places):
            count = int(np.ceil(np.abs(end - begin).sum() / STEP)) + 1
            for positions in np.linspace(begin, end, count + 1):
                if not self.heeds(positions):
                    return Violation(self.reason(positions), positions)
        return None

    def refuse_narrow(self, positions: Array) -> None:
        """Refuse constraints that are too narrow for the sampling of a path."""
        for rows, words in self._all(positions):
            width, least = 2.0 * float(rows.half.min()), LEAST_ROOMS * rows.room
            if width < 0.0:
                raise PlanningError(
                    PlanningCode.PLANNING_FAILED, f'bounds contradict each other: {words()}'
                )
            if width < least:
                raise PlanningError(
                    PlanningCode.PLANNING_FAILED,
                    f'a path constraint is {width:.4f} wide ({words()}), free motion needs'
                    f' {least:.4f}; widen it, or plan with LIN or PTP',
                )

    def reason(self, positions: Array) -> str:
        """Describe why a state does not satisfy the constraints."""
        return self.violated(positions) or 'it comes too near to the bounds of a path constraint'

    def _all(self, positions: Array) -> Iterator[tuple[_Rows, Callable[[], str]]]:
        """Yield the rows of each constraint, and a function that describes a violation."""
        links = {name: link.pose_and_jacobian(positions) for name, link in self._links.items()}
        for every in self.constraints:
            for name, bounds in every.joints.items():
                yield self._joint(name, bounds, positions)
            for turn in every.orientations:
                yield _turned(turn, *links[turn.link])
            for point in every.positions:
                yield self._placed(point, *links[point.link])

    def _joint(
        self, name: str, bounds: tuple[float, float], positions: Array
    ) -> tuple[_Rows, Callable[[], str]]:
        joint = self._joints.index(name)
        gradient = np.zeros(len(self._joints))
        gradient[joint] = 1.0
        (lower, upper), place = bounds, float(positions[joint])
        if self._limits.continuous[joint]:  # whole turns do not count
            middle = 0.5 * (lower + upper)
            place = middle + math.remainder(place - middle, math.tau)
        rows = _rows([(place, lower, upper, gradient)], 0.5 * STEP)
        return (
            rows,
            lambda: f'{name} is at {place:.4f}, its constraint is {lower:.4f}..{upper:.4f}',
        )

    def _placed(
        self, constraint: PositionConstraint, pose: Pose, jacobian: Array
    ) -> tuple[_Rows, Callable[[], str]]:
        arm = pose.rotation @ constraint.offset
        point = pose.position + arm
        moved = jacobian[:3] - np.cross(arm, jacobian[3:], axis=0)
        room = 0.5 * STEP * (self._reach + float(np.linalg.norm(arm)))
        regions = (_within(region, point, moved, room) for region in constraint.regions)
        x, y, z = point.tolist()
        words = f'link {constraint.link} is outside of its region, at ({x:.3f}, {y:.3f}, {z:.3f})'
        return min(regions, key=lambda rows: rows.beyond), lambda: words


def _turned(
    constraint: OrientationConstraint, pose: Pose, jacobian: Array
) -> tuple[_Rows, Callable[[], str]]:
    about_wanted = constraint.rotation.T @ pose.rotation @ constraint.in_link
    if constraint.parameterization is Parameterization.XYZ_EULER_ANGLES:
        turned, by_turn, room = _euler_angles(about_wanted)
    else:
        turned, by_turn, room = _rotation_vector(about_wanted)

    def words() -> str:
        angles = ', '.join(f'{abs(each):.3f}' for each in turned.tolist())
        allowed = ', '.join(f'{each:.3f}' for each in constraint.tolerance.tolist())
        return f'link {constraint.link} is turned by ({angles}) rad, ({allowed}) are allowed'

    gradients = by_turn @ constraint.rotation.T @ jacobian[3:]
    bounds = np.where(constraint.tolerance < np.pi, constraint.tolerance, np.inf)
    return _Rows(turned, -bounds, bounds, gradients, room), words


def _rotation_vector(rotation: Array) -> tuple[Array, Array, float]:
    """Return rotation vector, its derivative in the target axes, and change to the next sample."""
    turned: Array = pin.log3(rotation)
    # it changes quicker than the link turns, the quickest at half a turn; of the farthest until
    # the next look
    half = 0.5 * min(float(np.linalg.norm(turned)) + STEP, np.pi)
    return turned, pin.Jlog3(rotation).T, 0.5 * STEP * half / np.sin(half)


def _euler_angles(rotation: Array) -> tuple[Array, Array, float]:
    """Return the same as :func:`_rotation_vector`, for Euler angles about x, y and z."""
    x = np.arctan2(-rotation[1, 2], rotation[2, 2])
    y = np.arcsin(np.clip(rotation[0, 2], -1.0, 1.0))
    z = np.arctan2(-rotation[0, 1], rotation[0, 0])
    # at a quarter turn about y the other two are one
    slope = np.tan(np.clip(y, -STEEPEST, STEEPEST))
    quicker = np.hypot(1.0, slope)
    by_turn = np.array(
        [
            [1.0, np.sin(x) * slope, -np.cos(x) * slope],
            [0.0, np.cos(x), np.sin(x)],
            [0.0, -np.sin(x) * quicker, np.cos(x) * quicker],
        ]
    )
    room = 0.5 * STEP / np.cos(min(abs(float(y)) + STEP, STEEPEST))
    return np.array([x, y, z]), by_turn, float(room)


def _within(region: PlacedShape, point: Array, moved: Array, room: float) -> _Rows:
    """Return the rows that keep a point (root link) in a region; moved is its Jacobian (3, n)."""
    place = combined(inverse(region.pose), Pose(ORIGIN.rotation, point)).position
    moved = region.pose.rotation.T @ moved
    aside = float(np.hypot(place[0], place[1]))
    outward = (place[:2] / aside if aside else np.zeros(2)) @ moved[:2]
    match region.shape:
        case Box(x, y, z):
            half = 0.5 * np.array([x, y, z])
            return _Rows(place, -half, half, moved, room)
        case Sphere(radius):
            away = float(np.linalg.norm(place))
            gradient = (place / away if away else np.zeros(3)) @ moved
            return _rows([(away, -np.inf, radius, gradient)], room)
        case Cylinder(radius, length):
            height = (place[2], -0.5 * length, 0.5 * length, moved[2])
            return _rows([(aside, -np.inf, radius, outward), height], room)
        case Cone(radius, length):
            # its tip is above its middle
            slope = radius / length
            height = (place[2], -0.5 * length, 0.5 * length, moved[2])
            shell = (aside + slope * place[2], -np.inf, 0.5 * radius, outward + slope * moved[2])
            return _rows([shell, height], room * np.hypot(1.0, slope))
    raise PlanningError(
        PlanningCode.INVALID_GOAL_CONSTRAINTS,
        f'the region of a position constraint is a {type(region.shape).__name__}; use a box,'
        ' sphere, cylinder or cone',
    )


def _rows(rows: Sequence[tuple[float, float, float, Array]], room: float) -> _Rows:
    values, lower, upper, gradients = (np.array(column) for column in zip(*rows, strict=True))
    return _Rows(values, lower, upper, gradients, float(room))
