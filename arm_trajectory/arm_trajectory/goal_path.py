# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Goals made paths that the joints can follow."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
import math

import numpy as np

from arm_model import JointLimits, RobotState

from .exceptions import GoalError
from .goal import GoalRules, TrajectoryGoal
from .goal_points import Points, refuse, upcoming_points
from .path import cubic, linear, Path, PathPoint, quintic, Segment
from .path_bounds import farthest_beyond
from .path_rounding import rounded, with_run_out
from .path_timing import Demand, Timing

MAX_SPEED_EXCESS = 1.02
"""How far the speed of a segment may exceed a limit; it is followed slower then."""

MAX_DELAY = (1.1, 0.5)
"""Share, and time in [s], by which a path may take longer than its last time_from_start.

As much as MoveIt waits for by default: allowed_execution_duration_scaling,
allowed_goal_duration_margin.
"""

STRAIGHT_TOLERANCE = 1e-3
"""Bulge of a segment that counts as straight where its ends do not fit together in [rad]."""

APPROACH_FACTORS = (0.2, 0.5, 1.0, 2.0, 4.0)
"""Shares by which the way to the first point is tried longer."""

MIN_APPROACH_MARGIN = 0.25
"""Time that such a way has beside its own in [s]: a trajectory may be joined late."""

START_TOLERANCE = 1e-3
"""How far from a first point without time the arm may be before it is taken there in [rad]."""

MAX_ITERATIONS = 8
"""How often the time that suffices is improved."""

QUANTITIES = (('rad/s', 'speed'), ('rad/s2', 'acceleration'), ('rad/s3', 'jerk'))
"""Units and names of what is limited."""


@dataclass(frozen=True, slots=True, eq=False)
class GoalPath:
    """A path that the joints can follow.

    Attributes:
        path: The path.
        late: How much later than asked it ends, and why, in words; empty for in time.
    """

    path: Path
    late: str


@dataclass(frozen=True, slots=True)
class _Haste:
    """Why there is too little time, at what time, and how many times the time may suffice."""

    reason: str
    time: float
    factor: float


def build_path(
    goal: TrajectoryGoal, limits: JointLimits, state: RobotState, rules: GoalRules
) -> GoalPath:
    """Check a trajectory and make a path of it that begins at the commanded state.

    Where joints could not follow as quickly as asked, the path is followed slower; it stays the
    same. A trajectory that would take much longer then is refused.

    Args:
        goal: The trajectory.
        limits: Limits of the joints.
        state: Commanded state of the arm.
        rules: What is accepted.

    Raises:
        GoalError: It is refused; the message names the joint, the point and the remedy.
    """
    points = upcoming_points(goal, limits, state, rules)
    points = _from_here(points, limits, state, rules)
    answer = _tried(points, limits, state)
    if isinstance(answer, GoalPath):
        return answer
    if points.asked == 0.0:
        raise refuse(f'{answer.reason}; give the trajectory a time_from_start')
    factor = _sufficient(points, limits, state, answer.factor)
    raise refuse(f'{answer.reason}; give the trajectory {factor:.2f} times the time')


def _tried(points: Points, limits: JointLimits, state: RobotState) -> GoalPath | _Haste:
    """Return the path through points, or why there is too little time for it."""
    answer = _walkable(points, limits, state)
    approach = float(points.times[0])
    if (
        isinstance(answer, GoalPath)
        or approach == 0.0
        or answer.time > 2.0 * approach + MIN_APPROACH_MARGIN
    ):
        return answer
    # only the way from the present motion to the first point is longer
    for share in APPROACH_FACTORS:
        more = share * (approach + MIN_APPROACH_MARGIN)
        try:
            later = _walkable(points.delayed(more), limits, state)
        except GoalError:  # it would swing out beyond a limit
            return answer
        if isinstance(later, GoalPath):
            return later
    return answer


def _walkable(points: Points, limits: JointLimits, state: RobotState) -> GoalPath | _Haste:
    """Return the path through points, or why there is too little time."""
    path = _given(points, limits, state)
    demand = Timing(path, limits).fastest
    if demand.share > MAX_SPEED_EXCESS:
        return _Haste(_words(demand, limits), demand.time, demand.share)
    path = rounded(path, limits)
    timing = Timing(path, limits)
    scaled, demand = timing.time_scaled(), timing.plainest
    if scaled is None:
        return _Haste(_words(demand, limits), demand.time, timing.demand.share)
    most = MAX_DELAY[0] * points.asked + MAX_DELAY[1]
    if scaled.duration > most:
        enough = (scaled.duration - MAX_DELAY[1]) / MAX_DELAY[0]
        return _Haste(_words(demand, limits), demand.time, enough / max(points.asked, 1e-9))
    late = scaled.duration - points.asked
    if late < 0.01:
        return GoalPath(scaled, '')
    cause = f'{QUANTITIES[demand.quantity][1]} of {limits.names[demand.joint]}'
    return GoalPath(scaled, f'{late:.2f} s later than asked, for the {cause}')


def _sufficient(points: Points, limits: JointLimits, state: RobotState, guess: float) -> float:
    """Return how many times the time suffices, in hundredths."""
    factor = _hundredths(guess)
    for _ in range(MAX_ITERATIONS):
        try:
            answer = _tried(points.slowed(factor), limits, state)
        except GoalError:  # slower, an arm in motion would swing out beyond a limit
            return factor
        if isinstance(answer, GoalPath):
            return factor
        factor = _hundredths(factor * max(answer.factor, 1.01))
    return factor


def _hundredths(factor: float) -> float:
    return math.ceil(factor * 100.0) / 100.0


def _words(demand: Demand, limits: JointLimits) -> str:
    unit, name = QUANTITIES[demand.quantity]
    limit = (limits.velocity, limits.acceleration, limits.jerk)[demand.quantity][demand.joint]
    return (
        f'{limits.names[demand.joint]} would need {demand.value:.3f} {unit} at'
        f' {demand.time:.3f} s, its limit of {name} is {limit:.3f}'
    )


def _given(points: Points, limits: JointLimits, state: RobotState) -> Path:
    """Return the path as it is given, with its corners, once it keeps within the limits."""
    joined = bool(points.times[0] > 0.0) and state.moving
    segments = [*_first(points, state), *_between(points, limits)]
    if not segments:  # one point, at once, where the arm is
        segments.append(linear(0.0, 1e-3, points.positions[0], points.positions[0]))
    path = Path(segments, joined)
    if points.velocities is not None:
        path = with_run_out(path, limits)
    # an arm that is beyond a limit may come back
    lower = np.minimum(limits.lower, state.position)
    upper = np.maximum(limits.upper, state.position)
    beyond = farthest_beyond(path, lower, upper)
    if beyond is None:
        return path
    if points.velocities is None and segments[0].start == 0.0 < points.times[0] and not joined:
        straight = linear(0.0, segments[0].duration, state.position, points.positions[0])
        return Path([straight, *segments[1:]])
    joint = beyond.joint
    raise refuse(
        f'{limits.names[joint]} would be at {beyond.position:.4f} at {beyond.time:.3f} s, beyond'
        f' its limits {limits.lower[joint]:.4f}..{limits.upper[joint]:.4f}: speeds lead there'
        ' between the points; set points farther from the limit, or lower speeds'
    )


def _from_here(points: Points, limits: JointLimits, state: RobotState, rules: GoalRules) -> Points:
    """Give a first point without time the time to get there, where the arm is beside it."""
    off = np.abs(points.positions[0] - state.position)
    if points.times[0] > 0.0 or float(off.max()) < START_TOLERANCE:
        return points
    if float(off.max()) > rules.start:
        raise refuse(
            f'the first point is {off.max():.3f} rad away from where the arm is and has no'
            ' time_from_start; give it time, or plan from the present state'
        )
    # as a part of the path it heeds the speed override; peaks of a quintic from rest to rest
    needed = (
        1.875 * off / limits.velocity,
        np.sqrt(5.774 * off / limits.acceleration),
        np.cbrt(60.0 * off / limits.jerk),
    )
    return points if state.moving else points.delayed(float(np.max(needed)))


def _first(points: Points, state: RobotState) -> list[Segment]:
    """Return the segment from the commanded state to the first point, unless it is there."""
    if points.times[0] > 0.0:
        toward = points.at(0)
        if points.velocities is None and len(points.times) > 1:  # run into the line that follows
            step = points.times[1] - points.times[0]
            line = (points.positions[1] - points.positions[0]) / step
            toward = PathPoint(toward.position, line, toward.acceleration)
        here = PathPoint(state.position, state.velocity, state.acceleration)
        return [quintic(0.0, float(points.times[0]), here, toward)]
    return []


def _between(points: Points, limits: JointLimits) -> list[Segment]:
    """Return the segments between the points."""
    segments = []
    for place, (start, end) in enumerate(pairwise(points.times.tolist())):
        ends, duration = (points.at(place), points.at(place + 1)), end - start
        if points.velocities is None:
            segments.append(linear(start, duration, ends[0].position, ends[1].position))
            continue
        segment = quintic(start, duration, *ends)
        if points.accelerations is None or _jerky(segment, limits):
            segment = cubic(start, duration, *ends)
        line = linear(start, duration, ends[0].position, ends[1].position)
        bulge = (
            segment.at(start + 0.5 * duration).position - line.at(start + 0.5 * duration).position
        )
        if _jerky(segment, limits) and np.abs(bulge).max() < STRAIGHT_TOLERANCE:
            segment = line
        segments.append(segment)
    return segments


def _jerky(segment: Segment, limits: JointLimits) -> bool:
    """Whether no smooth way joins the accelerations of two points: the rounding does it then."""
    jerk = Path([segment]).derived(3, np.zeros(3, int), segment.duration * np.arange(3.0) / 2.0)
    return bool(np.any(np.abs(jerk) > limits.jerk))
