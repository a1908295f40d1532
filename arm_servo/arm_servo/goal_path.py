# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Goals checked, put in order, and made a path."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
import math

import numpy as np

from .arrays import Array
from .exceptions import GoalCode, GoalError
from .goal import GoalPoint, GoalRules, TrajectoryGoal
from .limits import JointLimits
from .otg import MotionState
from .path import cubic, linear, Path, PathPoint, quintic, rounded, Segment, with_run_out

SAMPLES = np.linspace(0.0, 1.0, 9)
"""Places of a segment where its speed and position are checked."""

OVER = 1.02
"""How far the speed of a segment may exceed a limit; the follower slows the rest."""


@dataclass(frozen=True, slots=True, eq=False)
class _Points:
    """A checked trajectory in the arm's order: times (k), the rest (k, n) or None."""

    times: Array
    positions: Array
    velocities: Array | None
    accelerations: Array | None

    def at(self, place: int) -> PathPoint:
        still = np.zeros(self.positions.shape[1])
        return PathPoint(
            self.positions[place],
            still if self.velocities is None else self.velocities[place],
            still if self.accelerations is None else self.accelerations[place],
        )


def build_path(
    goal: TrajectoryGoal, limits: JointLimits, state: MotionState, rules: GoalRules
) -> Path:
    """Check a trajectory and make a path of it that begins at the commanded state.

    Args:
        goal: The trajectory.
        limits: Limits of the joints.
        state: Commanded state of the arm.
        rules: What is accepted.

    Raises:
        GoalError: It is refused; the message names the joint, the point and the remedy.
    """
    points = _upcoming(_ordered(goal, limits, state, rules), goal.age)
    points = _by_the_short_way(points, limits, state)
    _check_positions(points, limits)
    segments = _segments(points, state, rules)
    path = Path(segments, joined=bool(points.times[0] > 0.0))
    _check_speeds(path, limits)
    _check_end(points, limits, rules)
    if points.velocities is not None:
        path = with_run_out(path, limits)
        _check_span(path.end.position, limits, 'the way to rest behind the last point')
    return rounded(path, limits)


def _refuse(reason: str, code: GoalCode = GoalCode.INVALID_GOAL) -> GoalError:
    return GoalError(code, reason)


def _ordered(
    goal: TrajectoryGoal, limits: JointLimits, state: MotionState, rules: GoalRules
) -> _Points:
    """Check names, lengths, numbers and times, and put the joints in the arm's order."""
    _check_joints(goal.joints, limits, rules)
    if not goal.points:
        raise _refuse('the trajectory has no points')
    for number, point in enumerate(goal.points):
        _check_point(number, point, goal)
    times = np.array([point.time for point in goal.points], dtype=np.float64)
    for number, (before, after) in enumerate(pairwise(times)):
        if after <= before:
            raise _refuse(
                f'point {number + 1} is at {after:g} s and point {number} at {before:g} s;'
                ' time_from_start must increase'
            )
    places = [limits.names.index(name) for name in goal.joints]
    still = np.zeros(len(limits))
    has_velocities = all(len(point.velocities) for point in goal.points)
    has_accelerations = has_velocities and all(len(point.accelerations) for point in goal.points)
    return _Points(
        times,
        _filled([point.positions for point in goal.points], places, state.position),
        _filled([p.velocities for p in goal.points], places, still) if has_velocities else None,
        _filled([p.accelerations for p in goal.points], places, still)
        if has_accelerations
        else None,
    )


def _check_joints(joints: Sequence[str], limits: JointLimits, rules: GoalRules) -> None:
    invalid = GoalCode.INVALID_JOINTS
    known = ', '.join(limits.names)
    for name in joints:
        if name not in limits.names:
            raise _refuse(f'there is no joint {name!r}; joints: {known}', invalid)
        if list(joints).count(name) > 1:
            raise _refuse(f'joint {name} is named twice', invalid)
    missing = [name for name in limits.names if name not in joints]
    if not joints or (missing and not rules.partial):
        raise _refuse(
            f'joint {missing[0]} is missing; name all of {known},'
            ' or set allow_partial_joints_goal',
            invalid,
        )


def _check_point(number: int, point: GoalPoint, goal: TrajectoryGoal) -> None:
    if not (math.isfinite(point.time) and point.time >= 0.0):
        raise _refuse(f'point {number}: time_from_start {point.time} s; it must be 0 or more')
    if len(point.positions) == 0:
        raise _refuse(f'point {number} has no positions')
    fields = {
        'positions': point.positions,
        'velocities': point.velocities,
        'accelerations': point.accelerations,
    }
    for name, values in fields.items():
        if len(values) not in {0, len(goal.joints)}:
            raise _refuse(f'point {number}: {len(values)} {name} for {len(goal.joints)} joints')
        for joint, value in zip(goal.joints, values, strict=False):
            if not math.isfinite(value):
                raise _refuse(f'point {number}: {name} of {joint} is {value}; it must be finite')


def _filled(rows: Sequence[Sequence[float]], places: Sequence[int], default: Array) -> Array:
    """Return rows for all joints; those that are not given have a default."""
    filled = np.tile(default, (len(rows), 1))
    filled[:, places] = np.array(rows, dtype=np.float64)
    return filled


def _upcoming(points: _Points, age: float) -> _Points:
    """Leave out the points that have passed."""
    times = points.times - age
    if times[-1] < 0.0:
        raise _refuse(
            f'the trajectory ended {-times[-1]:.3f} s ago; header.stamp is too old, or the clocks'
            ' differ (a stamp of 0 begins at once)',
            GoalCode.OLD_HEADER_TIMESTAMP,
        )
    left = slice(int(np.searchsorted(times, 0.0)), None)
    return _Points(
        times[left],
        points.positions[left],
        None if points.velocities is None else points.velocities[left],
        None if points.accelerations is None else points.accelerations[left],
    )


def _by_the_short_way(points: _Points, limits: JointLimits, state: MotionState) -> _Points:
    """Move continuous joints by whole turns: the first point is at most half a turn off."""
    turn = 2 * math.pi
    turns = np.round((state.position - points.positions[0]) / turn) * turn
    shifted = points.positions + np.where(limits.continuous, turns, 0.0)
    return _Points(points.times, shifted, points.velocities, points.accelerations)


def _check_positions(points: _Points, limits: JointLimits) -> None:
    for number, positions in enumerate(points.positions):
        _check_span(positions, limits, f'point {number}')


def _check_span(positions: Array, limits: JointLimits, place: str) -> None:
    beyond = (positions < limits.lower - 1e-6) | (positions > limits.upper + 1e-6)
    if beyond.any():
        joint = int(np.argmax(beyond))
        raise _refuse(
            f'{place}: {limits.names[joint]} at {positions[joint]:.4f} is beyond its limits'
            f' {limits.lower[joint]:.4f}..{limits.upper[joint]:.4f}'
        )


def _segments(points: _Points, state: MotionState, rules: GoalRules) -> list[Segment]:
    """Join the commanded state and the points."""
    count = len(points.times)
    segments: list[Segment] = []
    if points.times[0] > 0.0:
        toward = points.at(0)
        if points.velocities is None and count > 1:  # run into the line that follows
            step = points.times[1] - points.times[0]
            line = (points.positions[1] - points.positions[0]) / step
            toward = PathPoint(toward.position, line, toward.acceleration)
        here = PathPoint(state.position, state.velocity, state.acceleration)
        segments.append(quintic(0.0, float(points.times[0]), here, toward))
    else:
        off = np.abs(points.positions[0] - state.position)
        if float(off.max()) > rules.start:
            raise _refuse(
                f'the first point is {off.max():.3f} rad away from where the arm is and has no'
                ' time_from_start; give it time, or plan from the present state'
            )
    for place in range(count - 1):
        start = float(points.times[place])
        duration = float(points.times[place + 1]) - start
        begin, end = points.at(place), points.at(place + 1)
        if points.velocities is None:
            segments.append(linear(start, duration, begin.position, end.position))
        elif points.accelerations is None:
            segments.append(cubic(start, duration, begin, end))
        else:
            segments.append(quintic(start, duration, begin, end))
    if not segments:  # one point, at once, where the arm is
        segments.append(linear(0.0, 1e-3, points.positions[0], points.positions[0]))
    return segments


def _check_speeds(path: Path, limits: JointLimits) -> None:
    for segment in path.segments:
        for share in SAMPLES:
            here = segment.at(segment.start + share * segment.duration)
            speeds = np.abs(here.velocity) / limits.velocity
            joint = int(speeds.argmax())
            if speeds[joint] > OVER:
                raise _refuse(
                    f'{limits.names[joint]} would need {abs(here.velocity[joint]):.3f} rad/s at'
                    f' {segment.start + share * segment.duration:.3f} s, its limit is'
                    f' {limits.velocity[joint]:.3f}; give the trajectory'
                    f' {speeds[joint]:.2f} times the time'
                )


def _check_end(points: _Points, limits: JointLimits, rules: GoalRules) -> None:
    end = np.abs(points.at(-1).velocity)
    joint = int(np.argmax(end / limits.velocity))
    if not rules.end_velocity and end[joint] > 1e-3 * limits.velocity[joint]:
        raise _refuse(
            f'{limits.names[joint]} has {end[joint]:.4f} rad/s at the last point; end at rest, or'
            ' set allow_nonzero_velocity_at_trajectory_end'
        )
