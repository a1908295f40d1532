# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
r"""PTP, LIN and CIRC at full speed, as in Pilz' planner.

PTP: all joints move straight to the goal, synchronized. Each keeps its own limits: the slowest
joint determines the profile, and the others follow it in proportion. Pilz' planner applies the
strictest limits to every joint, which is never quicker, and keeps no limit better.

LIN and CIRC: a link moves along a line or an arc, and turns about one axis. One profile runs along
the curve; translation and rotation begin and end together, and neither exceeds its limit. Where
a joint would be too fast, the motion slows down; Pilz' planner refuses such motions.

Joints follow the curve with :math:`q' = J^+ \nu`, where :math:`\nu` is the derivative of the
curve. The parameter of the result is time at the full speed along the curve, scaled where a
joint would be too fast: by :math:`(1 + \sum_i |q'_i / v_i|^p)^{1/p}`, a smooth maximum.

Quintic polynomials in this time interpolate joint positions and two derivatives between points of
the curve. Their deviation from the curve depends on the scaling too, so the final polynomials are
measured, and the points are dense enough to keep the link on the curve.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
import math
from typing import Any, NoReturn

import numpy as np

from arm_model import Array, frozen, JointLimits
from arm_trajectory import brakeable, Path, quintics

from .cartesian import Curve
from .exceptions import PlanningCode, PlanningError
from .link_kinematics import LinkKinematics, pose_error
from .retime import FullSpeedPath, NEGLIGIBLE_SLOWDOWN, standstill

MIN_SCALING = 1e-4  # least factor of velocity and acceleration, as in Pilz' planner

JERK_RATIO = 10.0
"""Ratio of jerk to acceleration limit along a path in [1/s]; Pilz' planner has no jerk limit."""


@dataclass(frozen=True, slots=True)
class CartesianLimits:
    """Limits of a link's motion; the defaults are those of the Panda and the PRBT in MoveIt.

    The names are those of pilz_cartesian_limits.yaml. One profile runs along a path, with
    ``max_trans_acc`` at both ends; ``max_trans_dec`` is read and checked, but not used. Rotations
    accelerate so that they reach full speed in the same time.
    """

    max_trans_vel: float = 1.0  # greatest speed in [m/s]
    max_trans_acc: float = 2.25  # greatest acceleration in [m/s2]
    max_trans_dec: float = -5.0  # greatest deceleration in [m/s2], negative
    max_rot_vel: float = 1.57  # greatest speed of rotation in [rad/s]

    def __post_init__(self) -> None:
        """Refuse invalid limits."""
        for field in fields(self):
            value = getattr(self, field.name)
            sign, word = (-1.0, 'negative') if field.name == 'max_trans_dec' else (1.0, 'positive')
            if not math.isfinite(value) or value * sign <= 0.0:
                raise PlanningError(
                    PlanningCode.FAILURE,
                    f'cartesian_limits: {field.name} is {value}, a {word} number is needed',
                )

    @classmethod
    def of_table(cls, table: Mapping[str, Any]) -> CartesianLimits:
        """Return the limits of a table ``cartesian_limits``; other keys are ignored."""
        try:
            values = {
                each.name: float(table[each.name]) for each in fields(cls) if each.name in table
            }
        except (TypeError, ValueError) as error:
            raise PlanningError(PlanningCode.FAILURE, f'cartesian_limits: {error}') from error
        return cls(**values)

    @property
    def radius(self) -> float:
        """Distance in [m] that takes as long as a rotation of 1 rad."""
        return self.max_trans_vel / self.max_rot_vel


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
    """Return the joint path at full speed along a curve that starts at the link's pose."""
    length = max(curve.length, curve.angle * limits.radius)
    if length < MIN_LENGTH:
        return standstill(start)
    velocity, acceleration = factors
    most = acceleration * limits.max_trans_acc
    # a short way ends before the full speed
    peak = brakeable(0.5 * length, most, JERK_RATIO * most)
    speed = min(velocity * limits.max_trans_vel, peak)
    tracer = _Tracer(link, curve, joints, duration=length / speed, name=name)
    traced = tracer.timed(tracer.places(start))
    rate = most / speed
    notes = []
    if traced.slowdown > NEGLIGIBLE_SLOWDOWN:
        joint = joints.names[traced.joint]
        share = 1.0 / traced.slowdown
        notes.append(f'{name}: slowed to {share:.0%} where {joint} meets its limit of speed')
    return FullSpeedPath(traced.path, rate, rate * JERK_RATIO, notes=tuple(notes))


POSITION_TOLERANCE = 2e-5
"""Greatest deviation from the curve between two points in [m]; a fifth of the documented one."""

ROTATION_TOLERANCE = 1e-4  # greatest angle off the curve in [rad]

FIRST_STEP, MIN_STEP, MAX_STEP = 1 / 16, 1e-5, 1 / 6
"""Step between two points, as a share of the curve."""

EASY = 1 / 60  # share of the tolerance below which the next step is twice as long
ON_CURVE = 1e-11  # pose error that counts as none in [m] and [rad]
ON_SINGULAR_CURVE = 1e-8  # the same where the arm is singular
MAX_NEWTON = 6  # newton steps to a place at most; from a good guess two suffice

MAX_CORRECTION = 0.3
"""Greatest joint motion of a Newton step in [rad]; more may switch the arm configuration."""

DIFFERENCE = 1e-6  # share of a curve between the places of a difference quotient
SINGULAR = 1e-7  # share of the largest singular value below which one counts as none
NEARLY_SINGULAR = 1e-8  # determinant below which singular values are looked at
SHARPNESS = 16  # exponent of the smooth maximum

MAX_SLOWDOWN = 200.0
"""Slow-down factor from the full speed beyond which a curve counts as singular."""

RANGE_TOLERANCE = 1e-9  # rounding beyond a limit that is let pass in [rad]
POSE = 6  # numbers that a pose has: with more joints, an arm is redundant

_FIELDS = ('positions', 'first', 'second')

BETWEEN = frozen([0.5, 0.3, 0.7, 0.15, 0.85])
"""Where the deviation is measured between two points, as shares of the time.

The error has a factor :math:`t^3 (1 - t)^3`; it is greatest near 0.5, or near 0.3 and 0.7 where
its sign changes in the middle.
"""


@dataclass(frozen=True, slots=True, eq=False)
class _Trace:
    """Joint positions along a curve."""

    path: Path  # the joints by time at the full speed
    slowdown: float  # how many times slower the joints make it at the worst place
    joint: int  # number of the joint that does


@dataclass(frozen=True, slots=True, eq=False)
class _Place:
    """Joint positions at a share of the curve, and their derivatives with respect to it."""

    share: float
    positions: Array
    first: Array
    second: Array


class _Tracer:
    """Follows a curve that starts at the link's pose."""

    def __init__(
        self,
        link: LinkKinematics,
        curve: Curve,
        limits: JointLimits,
        *,
        duration: float,
        name: str,
    ) -> None:
        self._link, self._curve, self._limits = link, curve, limits
        self._duration, self._name = duration, name
        self._speed = limits.velocity * duration  # by the share

    def places(self, start: Array) -> list[_Place]:
        """Return points of the curve that are dense enough."""
        place = self._place(0.0, start)
        places, step = [place], FIRST_STEP
        while place.share < 1.0:
            step = min(step, 1.0 - place.share)
            if 1.0 - place.share - step < MIN_STEP:
                step = 1.0 - place.share
            following = self._next(place, step)
            error = np.inf if following is None else self._error(place, following)
            if following is None or error > 1.0:
                if step < 2.0 * MIN_STEP:
                    self._refuse_place(place)
                step *= 0.5
                continue
            self._check_range(following)
            places.append(following)
            place = following
            step = min(2.0 * step, MAX_STEP) if error < EASY else step
        return places

    def timed(self, places: Sequence[_Place]) -> _Trace:
        """Return the path through the points, slowed down where joints would be too fast."""
        durations, pieces = self._pieces(places)
        ratio = np.abs([each.first for each in places]) / self._speed
        joint = int(ratio.max(axis=0).argmax())
        return _Trace(Path(durations, pieces[:, :, :-1]), float(ratio.max()), joint)

    def _pieces(self, places: Sequence[_Place]) -> tuple[Array, Array]:
        """Return the polynomials between points: of the joints and, last, of the share.

        Returns durations in [s] (k) and coefficients (k, 6, n + 1).
        """
        q, first, second = (np.array([getattr(each, name) for each in places]) for name in _FIELDS)
        shares = np.array([each.share for each in places])
        ratio = np.abs(first) / self._speed
        power = (ratio**SHARPNESS).sum(axis=1)
        scaling = (1.0 + power) ** (1.0 / SHARPNESS)
        slope = (
            (ratio ** (SHARPNESS - 1) * np.sign(first) * second / self._speed).sum(axis=1)
            * scaling
            / (1.0 + power)
        )
        steps = np.diff(shares)
        durations = self._duration * (
            0.5 * steps * (scaling[1:] + scaling[:-1]) - steps**2 * np.diff(slope) / 12.0
        )
        durations = np.maximum(durations, self._duration * steps)  # never faster than the curve
        ones = np.ones_like(shares)
        pairs = (q, shares), (first, ones), (second, 0.0 * ones)
        positions, first, second = (np.column_stack(pair) for pair in pairs)
        scale = self._duration * scaling[:, None]
        velocity = first / scale
        acceleration = (second - first * (slope / scaling)[:, None]) / scale**2
        return durations, quintics(durations, positions, velocity, acceleration)

    def _place(self, share: float, positions: Array) -> _Place:
        first = self._field(share, positions)
        after = self._field(share + DIFFERENCE, positions + DIFFERENCE * first)
        return _Place(share, positions, first, (after - first) / DIFFERENCE)

    def _field(self, share: float, positions: Array) -> Array:
        """Return the derivatives of the joints with respect to the share."""
        _, jacobian = self._link.pose_and_jacobian(positions)
        twist = self._curve.twist(share)
        solved, is_singular = _solved(jacobian, twist)
        if is_singular:
            missed = np.abs(jacobian @ solved - twist).max()
            if not missed < SINGULAR * np.abs(twist).max():
                self._refuse_singular(share, '')
        return solved

    def _next(self, place: _Place, step: float) -> _Place | None:
        """Return the point one step further; None if Newton's method does not converge."""
        share = place.share + step
        guess = place.positions + step * place.first + 0.5 * step**2 * place.second
        positions = self._on_curve(share, guess)
        if positions is None:
            return None
        following = self._place(share, positions)
        if len(positions) <= POSE:
            return following
        # joints more than the pose needs: an implicit step of fourth order, put on the curve
        better = (
            place.positions
            + 0.5 * step * (place.first + following.first)
            + step**2 / 12.0 * (place.second - following.second)
        )
        positions = self._on_curve(share, better)
        return None if positions is None else self._place(share, positions)

    def _on_curve(self, share: float, guess: Array) -> Array | None:
        target, positions = self._curve.at(share), guess
        for _ in range(MAX_NEWTON):
            actual, jacobian = self._link.pose_and_jacobian(positions)
            error = pose_error(target, actual)
            if np.abs(error).max() < ON_CURVE:
                return positions
            change, is_singular = _solved(jacobian, error)
            if is_singular and np.abs(error).max() < ON_SINGULAR_CURVE:
                return positions + change  # what is left of the error no joint can take away
            if np.abs(change).max() > MAX_CORRECTION:
                return None
            positions = positions + change
        return None

    def _error(self, place: _Place, following: _Place) -> float:
        """Return the deviation from the curve between two points, divided by the tolerance."""
        durations, pieces = self._pieces((place, following))
        powers = np.vander(BETWEEN * durations, pieces.shape[1], increasing=True)
        worst = 0.0
        for row in powers @ pieces[0]:
            error = pose_error(self._curve.at(float(row[-1])), self._link.pose(row[:-1]))
            x, y, z, *turn = error.tolist()
            worst = max(
                worst,
                math.hypot(x, y, z) / POSITION_TOLERANCE,
                math.hypot(*turn) / ROTATION_TOLERANCE,
            )
            if worst > 1.0:
                break
        return worst

    def _check_range(self, place: _Place) -> None:
        if words := self._limits.beyond(place.positions, RANGE_TOLERANCE):
            raise self._refused(
                f'at {place.share:.0%} of the way {words}; start in another configuration'
            )
        ratio = np.abs(place.first) / self._speed
        joint = int(ratio.argmax())
        if ratio[joint] > MAX_SLOWDOWN:
            speed = place.first[joint] / self._duration
            self._refuse_singular(
                place.share, f': {self._limits.names[joint]} would need {abs(speed):.0f} rad/s'
            )

    def _refuse_singular(self, share: float, words: str) -> NoReturn:
        x, y, z = self._curve.at(share).position
        raise self._refused(
            f'the arm is singular at {max(share, 0.0):.0%} of the way, at ({x:.3f}, {y:.3f},'
            f' {z:.3f}){words}; use PTP, or lead it past that place'
        )

    def _refuse_place(self, place: _Place) -> NoReturn:
        """Refuse a curve that cannot be followed beyond a point."""
        _, jacobian = self._link.pose_and_jacobian(place.positions)
        values = np.linalg.svd(jacobian, compute_uv=False)
        x, y, z = self._curve.at(place.share).position
        count = len(place.positions)
        few = f', or its {count} joints cannot turn the link as it asks' if count < POSE else ''
        raise self._refused(
            f'it cannot be followed beyond {place.share:.0%} of the way, at ({x:.3f}, {y:.3f},'
            f' {z:.3f}): there it leads out of reach{few}, or the arm is singular (least singular'
            f' value {values[-1]:.1e}); use PTP, or lead it past that place'
        )

    def _refused(self, reason: str) -> PlanningError:
        return PlanningError(PlanningCode.PLANNING_FAILED, f'{self._name}: {reason}')


def _solved(jacobian: Array, twist: Array) -> tuple[Array, bool]:
    """Return the least joint rates for a twist, and whether the arm is singular.

    A singular arm, such as one with a straight wrist, may still move along its remaining
    directions; the rates are then a least-squares solution.
    """
    count = jacobian.shape[1]
    if count < POSE:
        return np.asarray(np.linalg.lstsq(jacobian, twist, rcond=None)[0], dtype=float), False
    square = jacobian if count == POSE else jacobian @ jacobian.T
    if abs(np.linalg.det(square)) > NEARLY_SINGULAR:
        solved = np.linalg.solve(square, twist)
        return solved if count == POSE else jacobian.T @ solved, False
    solved, _, rank, _ = np.linalg.lstsq(jacobian, twist, rcond=SINGULAR)
    return np.asarray(solved, dtype=float), int(rank) < POSE
