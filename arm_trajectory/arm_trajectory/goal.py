# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Trajectory goals as received from clients: values, tolerances, errors and checks.

::

    CommandError (of arm_model)   a request is refused before anything moves
    └── GoalError                 a trajectory is refused; carries the action's result code
        └── StateMovedError       the arm has moved away from the planned start
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from itertools import pairwise
import math

import numpy as np

from arm_model import Array, CommandError, JointLimits, RobotState


class GoalCode(IntEnum):
    """Codes of control_msgs/action/FollowJointTrajectory."""

    SUCCESSFUL = 0
    INVALID_GOAL = -1
    INVALID_JOINTS = -2
    OLD_HEADER_TIMESTAMP = -3
    PATH_TOLERANCE_VIOLATED = -4
    GOAL_TOLERANCE_VIOLATED = -5


class GoalError(CommandError):
    """A trajectory is refused before anything moves.

    Scenarios: times that do not increase, a joint that the arm lacks, a point beyond a limit.
    """

    def __init__(self, code: GoalCode, reason: str) -> None:
        super().__init__(reason)
        self.code = code


class StateMovedError(GoalError):
    """The arm has moved away from the planned start of a trajectory; plan it again."""


@dataclass(frozen=True, slots=True)
class GoalPoint:
    """A trajectory point; fields that are not given are empty."""

    time: float  # time from the start in [s]
    positions: Sequence[float]  # positions in [rad]
    velocities: Sequence[float] = ()  # velocities in [rad/s]
    accelerations: Sequence[float] = ()  # accelerations in [rad/s2]


@dataclass(frozen=True, slots=True)
class JointTolerance:
    """Tolerances of a joint; 0 keeps the default, -1 removes the tolerance."""

    position: float = 0.0  # in [rad]
    velocity: float = 0.0  # in [rad/s]


DefaultTolerances = JointTolerance | Mapping[str, JointTolerance]  # of each joint, or by joint


@dataclass(frozen=True, slots=True)
class TrajectoryGoal:
    """A trajectory to follow."""

    joints: Sequence[str]  # joint names, in the order of the points' values
    points: Sequence[GoalPoint]  # its points
    age: float = 0.0  # time since its start in [s]; 0 starts now, negative starts later
    path_tolerance: Mapping[str, JointTolerance] | None = None  # path tolerances by joint
    goal_tolerance: Mapping[str, JointTolerance] | None = None  # goal tolerances by joint
    # time to reach the goal within tolerance after the end in [s]; 0 is the default
    goal_time: float = 0.0


@dataclass(frozen=True, slots=True)
class GoalRules:
    """Rules for accepting trajectories."""

    partial: bool = False  # whether joints may be missing; these do not move
    # whether the last point may have a velocity; the arm comes to rest behind it
    end_velocity: bool = False
    start: float = 0.05  # greatest distance of a first point without time from the arm in [rad]


MAX_POINTS = 5000
"""Greatest number of points: they take 1 s to plan, during which other goals wait."""

SPAN_TOLERANCE = 1e-6  # tolerated rounding of a point beyond a limit in [rad]

MIN_JOIN_TIME = 0.05
"""Least time in [s] to the point at which the arm joins a trajectory in progress."""


@dataclass(frozen=True, slots=True, eq=False)
class Points:
    """A checked trajectory in the arm's order: times (k), the rest (k, n) or None.

    ``requested_duration`` is the time_from_start of its last point in [s]; delays keep it.
    """

    times: Array
    positions: Array
    velocities: Array | None
    accelerations: Array | None
    requested_duration: float

    def at(self, place: int) -> RobotState:
        """Return a point as a state; missing velocities and accelerations are 0."""
        still = np.zeros(self.positions.shape[1])
        return RobotState(
            self.positions[place],
            still if self.velocities is None else self.velocities[place],
            still if self.accelerations is None else self.accelerations[place],
        )

    def slowed(self, factor: float) -> Points:
        """Return the points with all times multiplied by ``factor``."""
        return Points(
            self.times * factor,
            self.positions,
            None if self.velocities is None else self.velocities / factor,
            None if self.accelerations is None else self.accelerations / factor**2,
            self.requested_duration * factor,
        )

    def delayed(self, by: float) -> Points:
        """Return the points delayed by ``by`` in [s]."""
        return replace(self, times=self.times + by)

    def since(self, place: int) -> Points:
        """Return the points from number ``place`` on."""
        return Points(
            self.times[place:],
            self.positions[place:],
            None if self.velocities is None else self.velocities[place:],
            None if self.accelerations is None else self.accelerations[place:],
            self.requested_duration,
        )


def upcoming_points(
    goal: TrajectoryGoal, limits: JointLimits, state: RobotState, rules: GoalRules
) -> Points:
    """Check a goal, and return its points that are still to come.

    Raises:
        GoalError: The goal is refused.
    """
    points = _upcoming(_ordered(goal, limits, state, rules), goal.age)
    # by the short way: the first point of a continuous joint is at most half a turn off
    first = points.positions[0]
    turned = limits.in_nearest_turn(first, state.position) - first
    points = replace(points, positions=points.positions + turned)
    for number, positions in enumerate(points.positions):
        if words := limits.beyond(positions, SPAN_TOLERANCE):
            raise refuse(f'point {number}: {words}')
    end = np.abs(points.at(-1).velocity)
    joint = int(np.argmax(end / limits.velocity))
    if not rules.end_velocity and end[joint] > 1e-3 * limits.velocity[joint]:
        raise refuse(
            f'{limits.names[joint]} has {end[joint]:.4f} rad/s at the last point; end at rest, or'
            ' set allow_nonzero_velocity_at_trajectory_end'
        )
    return points


def refuse(reason: str, code: GoalCode = GoalCode.INVALID_GOAL) -> GoalError:
    """Return the error that refuses a goal."""
    return GoalError(code, reason)


def _ordered(
    goal: TrajectoryGoal, limits: JointLimits, state: RobotState, rules: GoalRules
) -> Points:
    """Check names, lengths, values and times; return the points in the arm's joint order."""
    _check_joints(goal.joints, limits, rules)
    if not goal.points:
        raise refuse('the trajectory has no points')
    if len(goal.points) > MAX_POINTS:
        raise refuse(
            f'{len(goal.points)} points; at most {MAX_POINTS} are planned, leave some out'
        )
    for number, point in enumerate(goal.points):
        _check_point(number, point, goal)
    times = np.array([point.time for point in goal.points], dtype=np.float64)
    for number, (before, after) in enumerate(pairwise(times)):
        if after <= before:
            raise refuse(
                f'point {number + 1} is at {after:g} s and point {number} at {before:g} s;'
                ' time_from_start must increase'
            )
    places = [limits.names.index(name) for name in goal.joints]
    still = np.zeros(len(limits))
    _check_fields(goal)
    has_velocities = all(len(point.velocities) for point in goal.points)
    has_accelerations = has_velocities and all(len(point.accelerations) for point in goal.points)
    return Points(
        times,
        _filled([point.positions for point in goal.points], places, state.position),
        _filled([p.velocities for p in goal.points], places, still) if has_velocities else None,
        _filled([p.accelerations for p in goal.points], places, still)
        if has_accelerations
        else None,
        float(times[-1]),
    )


def _check_joints(joints: Sequence[str], limits: JointLimits, rules: GoalRules) -> None:
    invalid = GoalCode.INVALID_JOINTS
    known = ', '.join(limits.names)
    for name in joints:
        if name not in limits.names:
            raise refuse(f'no joint {name!r}; joints: {known}', invalid)
        if list(joints).count(name) > 1:
            raise refuse(f'joint {name} is named twice', invalid)
    missing = [name for name in limits.names if name not in joints]
    if not joints or (missing and not rules.partial):
        raise refuse(
            f'joint {missing[0]} is missing; name all of {known},'
            ' or set allow_partial_joints_goal',
            invalid,
        )


def _check_point(number: int, point: GoalPoint, goal: TrajectoryGoal) -> None:
    if not (math.isfinite(point.time) and point.time >= 0.0):
        raise refuse(f'point {number}: time_from_start {point.time} s; it must be 0 or more')
    if len(point.positions) == 0:
        raise refuse(f'point {number} has no positions')
    fields = {
        'positions': point.positions,
        'velocities': point.velocities,
        'accelerations': point.accelerations,
    }
    for name, values in fields.items():
        if len(values) not in {0, len(goal.joints)}:
            raise refuse(f'point {number}: {len(values)} {name} for {len(goal.joints)} joints')
        for joint, value in zip(goal.joints, values, strict=False):
            if not math.isfinite(value):
                raise refuse(f'point {number}: {name} of {joint} is {value}; it must be finite')


def _check_fields(goal: TrajectoryGoal) -> None:
    """Check that all points have the same fields, since missing values cannot be invented."""
    for name, values in (
        ('velocities', [point.velocities for point in goal.points]),
        ('accelerations', [point.accelerations for point in goal.points]),
    ):
        given = [len(each) > 0 for each in values]
        if any(given) and not all(given):
            raise refuse(
                f'point {given.index(False)} has no {name} and point {given.index(True)} has;'
                ' give them at all points or at none'
            )
    first = goal.points[0]
    if len(first.accelerations) and not len(first.velocities):
        raise refuse('points have accelerations and no velocities; give both, or positions only')


def _filled(rows: Sequence[Sequence[float]], places: Sequence[int], default: Array) -> Array:
    """Return rows with values for all joints; joints without values get the default."""
    filled = np.tile(default, (len(rows), 1))
    filled[:, places] = np.array(rows, dtype=np.float64)
    return filled


def _upcoming(points: Points, age: float) -> Points:
    """Return the points whose times have not passed at ``age`` in [s]."""
    times = points.times - age
    if times[-1] < 0.0:
        raise refuse(
            f'the trajectory ended {-times[-1]:.3f} s ago; header.stamp is too old, or the clocks'
            ' differ (a stamp of 0 begins at once)',
            GoalCode.OLD_HEADER_TIMESTAMP,
        )
    # a point that passes in a moment cannot be met; the next one can, and the last one is the goal
    soonest = MIN_JOIN_TIME if age > 0.0 else 0.0
    left = min(int(np.searchsorted(times, soonest)), len(times) - 1)
    return replace(points, times=times, requested_duration=float(times[-1])).since(left)


@dataclass(frozen=True, slots=True, eq=False)
class Tolerances:
    """Tolerances of every joint; infinite where none is set."""

    position: Array  # in [rad]
    velocity: Array  # in [rad/s]

    def violation(self, limits: JointLimits, position: Array, velocity: Array) -> str | None:
        """Describe an error in [rad] or [rad/s] that exceeds its tolerance; None if none does."""
        for error, tolerance, what, unit in (
            (position, self.position, 'position', 'rad'),
            (velocity, self.velocity, 'velocity', 'rad/s'),
        ):
            excess = np.abs(error) / tolerance
            joint = int(np.argmax(excess))
            if excess[joint] > 1.0:
                off, most = _distinct(float(error[joint]), float(tolerance[joint]))
                return f'{limits.names[joint]}: {what} off by {off} {unit}, tolerance {most}'
        return None


def _distinct(error: float, tolerance: float) -> tuple[str, str]:
    """Format an error and the exceeded tolerance with enough digits to distinguish them."""
    for digits in range(4, 12):
        off, most = f'{error:+.{digits}f}', f'{tolerance:.{digits}f}'
        if abs(float(off)) > float(most) > 0.0:
            break
    return off, most


def merge_tolerances(
    limits: JointLimits,
    given: Mapping[str, JointTolerance] | None,
    default: DefaultTolerances,
    what: str = 'tolerance',
) -> Tolerances:
    """Merge the tolerances of a goal with the defaults.

    Args:
        given: The goal's tolerances by joint: a positive value applies, 0 keeps the default, a
            negative value removes the tolerance.
        default: One default for all joints, or defaults by joint; 0 means no tolerance.
        what: Name of the goal's field, for error messages.

    Raises:
        GoalError: A joint is unknown, or a tolerance is not a number.
    """
    for name, asked in (given or {}).items():
        if name not in limits.names:
            reason = f'{what}: no joint {name!r}; joints: {", ".join(limits.names)}'
            raise GoalError(GoalCode.INVALID_JOINTS, reason)
        if math.isnan(asked.position) or math.isnan(asked.velocity):
            raise GoalError(GoalCode.INVALID_GOAL, f'{what} of {name} is not a number')
    rows = []
    for name in limits.names:
        asked = (given or {}).get(name, JointTolerance())
        usual = default if isinstance(default, JointTolerance) else default[name]
        rows.append((_one(asked.position, usual.position), _one(asked.velocity, usual.velocity)))
    return Tolerances(np.array([row[0] for row in rows]), np.array([row[1] for row in rows]))


def _one(asked: float, default: float) -> float:
    value = default if asked == 0.0 else asked
    return value if value > 0.0 else np.inf
