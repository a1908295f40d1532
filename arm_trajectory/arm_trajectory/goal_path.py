# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Converts trajectory goals to paths that the joints can follow.

An arm in motion reaches the first point with the speed that the path has there: by a quintic, the
smoothest motion, if that stays within the limits, else by a jerk-limited motion from ruckig,
which takes longer if necessary.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
import math

import numpy as np

from arm_model import Array, JointLimits, Mask, RobotState

from .goal import GoalError, GoalRules, Points, refuse, TrajectoryGoal, upcoming_points
from .otg import OnlineTrajectoryGenerator, Plan
from .path import cubics, farthest_beyond, lines, Path, quintics
from .rounding import rounded, run_out
from .time_scaling import Demand, Timing

MAX_SPEED_EXCESS = 1.02
"""Factor by which a segment may exceed a speed limit; the path is then slowed down."""

MAX_DELAY = (1.1, 0.5)
"""Factor, and time in [s], by which a path may exceed its last time_from_start.

MoveIt waits as long by default: allowed_execution_duration_scaling,
allowed_goal_duration_margin.
"""

NEGLIGIBLE_DELAY = 0.01  # delay in [s] that is not reported

STRAIGHT_TOLERANCE = 1e-3
"""Greatest deviation in [rad] from a line at which a jerky segment is replaced by the line."""

APPROACH_FACTORS = (0.2, 0.5, 1.0, 2.0, 4.0)
"""Factors of additional time that are tried for the motion to the first point."""

MIN_APPROACH_MARGIN = 0.25
"""Time in [s] added to the approach time before scaling: goals may be joined late."""

START_TOLERANCE = 1e-3
"""Distance in [rad] to a first point without time from which the arm is moved there."""

MAX_ITERATIONS = 40  # iterations that refine the sufficient time

QUANTITIES = (('rad/s', 'speed'), ('rad/s2', 'acceleration'), ('rad/s3', 'jerk'))
"""Units and names of the limited quantities."""


@dataclass(frozen=True, slots=True, eq=False)
class GoalPath:
    """A path that the joints can follow."""

    path: Path  # the path
    late: str  # delay of its end and the cause, as text; empty if in time


@dataclass(frozen=True, slots=True)
class _TimeDeficit:
    """Too little time: reason, short cause, path time in [s], and factor of time that suffices."""

    reason: str
    cause: str
    time: float
    factor: float = 1.0


def build_path(
    goal: TrajectoryGoal, limits: JointLimits, state: RobotState, rules: GoalRules
) -> GoalPath:
    """Check a trajectory and convert it to a path that begins at the commanded state.

    Where joints cannot follow as fast as requested, the same path is followed slower. A trajectory
    that would take much longer is refused.

    Raises:
        GoalError: The goal is refused; the message names the joint, the point and the remedy.
    """
    points = upcoming_points(goal, limits, state, rules)
    points = _from_here(points, limits, state, rules)
    answer = _tried(points, limits, state)
    if isinstance(answer, GoalPath):
        return answer
    if points.requested_duration == 0.0:
        raise refuse(f'{answer.reason}; give the trajectory a time_from_start')
    factor = _sufficient(points, limits, state, answer.factor)
    raise refuse(f'{answer.reason}; give the trajectory {factor:.2f} times the time')


def _tried(points: Points, limits: JointLimits, state: RobotState) -> GoalPath | _TimeDeficit:
    """Return the path through points, or the time deficit."""
    if state.moving:
        return _from_motion(points, limits, state)
    approach = float(points.times[0])
    answer = _from_rest(points, limits, state)
    if (
        isinstance(answer, GoalPath)
        or approach == 0.0
        or answer.time > 2.0 * approach + MIN_APPROACH_MARGIN
    ):
        return answer
    # only the way to the first point is longer
    for factor in APPROACH_FACTORS:
        more = factor * (approach + MIN_APPROACH_MARGIN)
        later = _from_rest(points.delayed(more), limits, state)
        if isinstance(later, GoalPath):
            return later
    return answer


def _from_rest(points: Points, limits: JointLimits, state: RobotState) -> GoalPath | _TimeDeficit:
    """Return the path through points from a state of rest, or the time deficit."""
    pieces = [*_first(points, state), *_between(points, limits)]
    if not pieces:  # one point, at once, where the arm is
        pieces.append(_line(1e-3, points.positions[0], points.positions[0]))
    path = Path.joined([*pieces, *_run_out(points, pieces, limits)])
    beyond = _beyond(path, limits, state)
    if beyond is not None:
        if points.velocities is not None or points.times[0] == 0.0:
            raise beyond
        straight = _line(pieces[0].duration, state.position, points.positions[0])
        path = Path.joined([straight, *pieces[1:]])
    scaled, deficit = _time_scaled(path, limits)
    return deficit if scaled is None else _in_time(scaled, points, deficit)


def _from_motion(
    points: Points, limits: JointLimits, state: RobotState
) -> GoalPath | _TimeDeficit:
    """Return the path through points from a state of motion, or the time deficit.

    From the first point on, the path does not depend on the initial state.
    """
    lead, begin = float(points.times[0]), points.at(0)
    shifted, deficit = points.delayed(-lead), _TimeDeficit('', '', lead)
    pieces = _between(shifted, limits)
    onward = [*pieces, *_run_out(shifted, pieces, limits)]
    if onward:
        path = Path.joined(onward)
        if (beyond := _beyond(path, limits, state)) is not None:
            raise beyond
        scaled, deficit = _time_scaled(path, limits, from_rest=False)
        deficit = replace(deficit, time=lead + deficit.time)
        if scaled is None:
            return deficit
        begin, onward = scaled.at(0.0), [scaled]
    approach = approach_path(state, begin, lead, limits)
    if approach is None:
        return _after_stop(points, limits, state)
    if approach.duration > lead + NEGLIGIBLE_DELAY or not onward:
        deficit = _TimeDeficit(
            f'from its motion the arm needs {approach.duration:.3f} s to the first point, which'
            f' is at {lead:.3f} s',
            'way from the motion to the first point',
            lead,
        )
    return _in_time(Path.joined([approach, *onward]), points, deficit)


def _after_stop(points: Points, limits: JointLimits, state: RobotState) -> GoalPath | _TimeDeficit:
    """Return the path through points of an arm that comes to rest first, or the time deficit.

    Used if no motion from the state to the first point stays within the position limits.
    """
    plan = OnlineTrajectoryGenerator(limits).brake(state)
    if plan is None:
        raise refuse('the arm cannot come to rest in front of the trajectory; stop it first')
    stop = _phases(plan)
    saved = stop.duration if points.times[0] > 2.0 * stop.duration else 0.0
    rest = RobotState.at_rest(stop.end.position)
    answer = _tried(points.delayed(-saved), limits, rest)
    if isinstance(answer, _TimeDeficit):
        return replace(answer, time=answer.time + saved)
    deficit = _TimeDeficit(
        f'the arm needs {stop.duration:.3f} s to come to rest first',
        'stop in front of it',
        stop.duration,
    )
    return _in_time(Path.joined([stop, answer.path]), points, deficit)


def _time_scaled(
    path: Path, limits: JointLimits, *, from_rest: bool = True
) -> tuple[Path | None, _TimeDeficit]:
    """Return the fastest feasible path with rounded corners, and its greatest time deficit."""
    demand = Timing(path, limits).fastest
    if demand.time_factor > MAX_SPEED_EXCESS:
        return None, _time_deficit(demand, limits, demand.time_factor)
    timing = Timing(rounded(path, limits, from_rest=from_rest), limits)
    return timing.time_scaled(), _time_deficit(timing.plainest, limits, timing.demand.time_factor)


def _in_time(path: Path, points: Points, deficit: _TimeDeficit) -> GoalPath | _TimeDeficit:
    """Return a path unless it takes much longer than requested; else the time deficit."""
    most = MAX_DELAY[0] * points.requested_duration + MAX_DELAY[1]
    if path.duration > most:
        enough = (path.duration - MAX_DELAY[1]) / MAX_DELAY[0]
        return replace(deficit, factor=enough / max(points.requested_duration, 1e-9))
    late = path.duration - points.requested_duration
    if late < NEGLIGIBLE_DELAY:
        return GoalPath(path, '')
    return GoalPath(path, f'{late:.2f} s later than requested, for the {deficit.cause}')


def _sufficient(points: Points, limits: JointLimits, state: RobotState, guess: float) -> float:
    """Return the factor of time that suffices, rounded up to hundredths."""
    factor = _hundredths(guess)
    for _ in range(MAX_ITERATIONS):
        try:
            answer = _tried(points.slowed(factor), limits, state)
        except GoalError:  # more time would make a moving arm swing out beyond a limit
            return factor
        if isinstance(answer, GoalPath):
            return factor
        factor = _hundredths(factor * max(answer.factor, 1.02))
    return factor


def _hundredths(factor: float) -> float:
    return math.ceil(factor * 100.0) / 100.0


def _time_deficit(demand: Demand, limits: JointLimits, factor: float) -> _TimeDeficit:
    unit, quantity = QUANTITIES[demand.quantity]
    limit = (limits.velocity, limits.acceleration, limits.jerk)[demand.quantity][demand.joint]
    name = limits.names[demand.joint]
    is_assumed = quantity == 'jerk' and name in limits.assumed_jerk
    assumed = ' (assumed, as the limits file has no max_jerk)' if is_assumed else ''
    return _TimeDeficit(
        f'{name} would need {demand.value:.3f} {unit} at {demand.time:.3f} s, its limit of'
        f' {quantity} is {limit:.3f}{assumed}',
        f'{quantity} of {name}',
        demand.time,
        factor,
    )


def _run_out(points: Points, pieces: Sequence[Path], limits: JointLimits) -> list[Path]:
    """Return the motion to rest after a last point that has a velocity; else no path."""
    if points.velocities is None:
        return []
    return run_out(pieces[-1].end if pieces else points.at(-1), limits)


def _beyond(path: Path, limits: JointLimits, state: RobotState) -> GoalError | None:
    """Return the error for a path that exceeds a position limit; None if it does not."""
    # an arm that is beyond a limit may come back
    lower = np.minimum(limits.lower, state.position)
    upper = np.maximum(limits.upper, state.position)
    beyond = farthest_beyond(path, lower, upper)
    if beyond is None:
        return None
    joint = beyond.joint
    return refuse(
        f'{limits.names[joint]} would be at {beyond.position:.4f} at {beyond.time:.3f} s, beyond'
        f' its limits {limits.lower[joint]:.4f}..{limits.upper[joint]:.4f}: speeds lead there'
        ' between the points; set points farther from the limit, or lower speeds'
    )


def _from_here(points: Points, limits: JointLimits, state: RobotState, rules: GoalRules) -> Points:
    """Add the time to reach a first point without time; drop that point in motion."""
    off = np.abs(points.positions[0] - state.position)
    if points.times[0] > 0.0:
        return points
    if float(off.max()) > rules.start:
        raise refuse(
            f'the first point is {off.max():.3f} rad away from where the arm is and has no'
            ' time_from_start; give it time, or plan from the present state'
        )
    if state.moving:  # the point has passed; the next one can be met
        return points.since(1) if len(points.times) > 1 else points
    if float(off.max()) < START_TOLERANCE:
        return points
    # as a part of the path it follows the speed override; peaks of a quintic from rest to rest
    needed = (
        1.875 * off / limits.velocity,
        np.sqrt(5.774 * off / limits.acceleration),
        np.cbrt(60.0 * off / limits.jerk),
    )
    return points.delayed(float(np.max(needed)))


def _first(points: Points, state: RobotState) -> list[Path]:
    """Return the path from the commanded state to the first point; empty if its time is 0."""
    if points.times[0] > 0.0:
        toward = points.at(0)
        if points.velocities is None and len(points.times) > 1:  # run into the line that follows
            step = points.times[1] - points.times[0]
            line = (points.positions[1] - points.positions[0]) / step
            toward = RobotState(toward.position, line, toward.acceleration)
        return [Path.between(float(points.times[0]), state, toward)]
    return []


def _between(points: Points, limits: JointLimits) -> list[Path]:
    """Return the path between the points; empty for one point."""
    lasts, q, v, a = (
        np.diff(points.times),
        points.positions,
        points.velocities,
        points.accelerations,
    )
    if not len(lasts):
        return []
    straight = lines(lasts, q)
    if v is None:
        return [Path(lasts, straight)]
    pieces = cubics(lasts, q, v)
    if a is not None:
        fifth = quintics(lasts, q, v, a)
        smooth = ~_jerky(lasts, fifth, limits)
        pieces[smooth] = fifth[smooth]
    numbers, middles = np.arange(len(lasts)), 0.5 * lasts
    bulges = Path(lasts, pieces - straight).derived(0, numbers, middles)
    flat = np.abs(bulges).max(axis=1) < STRAIGHT_TOLERANCE
    flat &= _jerky(lasts, pieces, limits)
    pieces[flat] = straight[flat]
    return [Path(lasts, pieces)]


def _jerky(lasts: Array, pieces: Array, limits: JointLimits) -> Mask:
    """Return a mask (k) of segments that exceed jerk limits, left to corner rounding."""
    places = np.repeat(np.arange(len(lasts)), 3)
    times = (lasts[:, None] * [0.0, 0.5, 1.0]).ravel()
    jerks = Path(lasts, pieces).derived(3, places, times).reshape(len(lasts), -1, len(limits))
    jerky: Mask = np.any(np.abs(jerks) > limits.jerk, axis=(1, 2))
    return jerky


def _line(duration: float, begin: Array, end: Array) -> Path:
    lasts = np.array([duration])
    return Path(lasts, lines(lasts, np.array([begin, end])))


MIN_PHASE = 1e-7  # least length of a segment with one jerk in [s]; shorter ones are left out


def approach_path(
    state: RobotState, begin: RobotState, duration: float, limits: JointLimits
) -> Path | None:
    """Return the path from a state to the begin of another path; None if there is none.

    It lasts ``duration`` in [s], or longer if the joints need more time.
    """
    # an arm that is beyond a limit may come back
    lower = np.minimum(limits.lower, state.position)
    upper = np.maximum(limits.upper, state.position)
    if duration > 0.0:
        path = Path.between(duration, state, begin)
        fits = Timing(path, limits).demand.time_factor <= 1.0
        if fits and farthest_beyond(path, lower, upper) is None:
            return path
    generator = OnlineTrajectoryGenerator(limits)
    plan = generator.to_state(state, begin, duration or None)
    plan = plan or generator.to_state(state, begin)  # ruckig may refuse a least duration
    if plan is None:
        return None
    path = _phases(plan)
    return path if farthest_beyond(path, lower, upper) is None else None


def _phases(plan: Plan) -> Path:
    """Convert a plan to polynomials of constant jerk."""
    ends = plan.switches
    times = ends[np.diff(ends, prepend=0.0) > MIN_PHASE]
    times = np.concatenate(((0.0,), times[:-1], (plan.duration,)))
    states = [plan.at(time) for time in times.tolist()]
    lengths = np.diff(times)
    coefficients = np.zeros((len(lengths), 6, len(states[0].position)))
    for piece, length, before, after in zip(
        coefficients, lengths, states, states[1:], strict=False
    ):
        jerk = (after.acceleration - before.acceleration) / length
        piece[:4] = before.position, before.velocity, before.acceleration / 2.0, jerk / 6.0
    return Path(lengths, coefficients)
