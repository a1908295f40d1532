# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Time parameterization of paths: rest to rest, within joint limits and a link's speed limit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
import math

import numpy as np

from arm_model import Array, frozen, JointLimits, RobotState
from arm_trajectory import Demand, OnlineTrajectoryGenerator, Path, quintics, Timing

from .exceptions import PlanningCode, PlanningError
from .ik import IkSolver
from .link_kinematics import LinkKinematics

MAX_SPACING = 0.05  # greatest length of a segment of a path that is not straight in [s]

MAX_SEGMENTS = 400
"""Greatest number of segments; a slow path bends little from one longer segment to the next."""

MIN_SPACING = 1e-4  # places that are nearer than this in time count as one in [s]

SPEEDS = (0.75, 0.55, 0.4, 0.3, 0.2)
"""Shares of the full speed, tried in this order as long as they make a path quicker.

A path that slows down at many points is quicker at an even speed.
"""

SLOW = 1.5  # how much longer a path may take for its joints before an even speed is tried
QUANTITIES = ('speed', 'acceleration', 'jerk')  # names of what is limited
SLOWER_MARGIN = 1.001  # factor for rounding where a whole path is followed slower
SPEED_SAMPLES = (
    200  # places at which the speed of a link is computed, and again around its maximum
)
STANDSTILL = 1e-3  # how long a motion takes that has no way in [s]
NEGLIGIBLE_SLOWDOWN = 1.01  # factor by which a path may take longer without a note


@dataclass(frozen=True, slots=True, eq=False)
class FullSpeedPath:
    """A path parameterized by its time at full speed, and how it begins and ends."""

    path: Path  # the joints by time at full speed; its velocity and acceleration do not jump
    acceleration: float  # greatest change of the speed, as a share of the full one, in [1/s]
    jerk: float  # greatest change of that in [1/s2]
    straight: bool = False  # whether joints keep the limits by these two alone, all in phase
    notes: tuple[str, ...] = ()  # what a person should know of it


def standstill(positions: Array) -> FullSpeedPath:
    """Return a path that stays where it is."""
    coefficients = np.zeros((6, len(positions)))
    coefficients[0] = positions
    return FullSpeedPath(
        Path(np.array([STANDSTILL]), coefficients[None]), 1.0 / STANDSTILL, 1.0 / STANDSTILL**2
    )


def timed(full: FullSpeedPath, limits: JointLimits) -> tuple[Path, tuple[str, ...]]:
    """Return a path from rest to rest within the limits, and notes on what slows it down."""
    if not full.path.coefficients[:, 1:].any():  # it stands still
        return full.path, full.notes
    path = _from_rest_to_rest(full)
    if full.straight:
        return path, full.notes
    scaled, demand = _within(path, limits)
    for speed in SPEEDS:
        if scaled.duration < SLOW * path.duration:
            break
        steady = replace(
            full,
            path=slower(full.path, 1.0 / speed),
            acceleration=full.acceleration / speed,
            jerk=full.jerk / speed,
        )
        other, _ = _within(_from_rest_to_rest(steady), limits)
        if other.duration > scaled.duration:
            break
        scaled = other
    if scaled.duration < NEGLIGIBLE_SLOWDOWN * path.duration:
        return scaled, full.notes
    note = (
        f'takes {scaled.duration:.2f} s instead of {path.duration:.2f} s, where'
        f' {limits.names[demand.joint]} meets its limit of {QUANTITIES[demand.quantity]}'
    )
    return scaled, (*full.notes, note)


def _within(path: Path, limits: JointLimits) -> tuple[Path, Demand]:
    """Return a path with its time scaling applied, and the strictest limit."""
    timing = Timing(path, limits)
    scaled = timing.time_scaled()
    if scaled is None:
        scaled = slower(path, timing.demand.time_factor * SLOWER_MARGIN)
    return scaled, timing.plainest


def _from_rest_to_rest(full: FullSpeedPath) -> Path:
    """Return the path with one jerk-limited profile from its begin to its end."""
    profile, lasts = _profile(full.path.duration, full)
    if full.straight:
        return _straight(full.path, profile, lasts)
    path = full.path
    begins = np.concatenate(((0.0,), np.cumsum(lasts)[:-1]))
    end = float(lasts.sum())
    count = min(int(np.ceil(end / MAX_SPACING)), MAX_SEGMENTS)
    grid = np.linspace(0.0, end, count + 1)
    fine = np.linspace(0.0, end, 4 * len(grid))
    crossings = np.interp(path.starts[1:], _evaluated(profile, begins, fine)[0], fine)
    times = np.unique(np.concatenate((begins, grid, crossings)))
    keep = np.diff(times, prepend=-1.0) > MIN_SPACING
    keep &= (times < end - MIN_SPACING) | (times == end)
    times = np.unique(np.append(times[keep], end))
    along, rate, bend = _evaluated(profile, begins, times)
    along = np.clip(along, 0.0, path.duration)
    numbers = np.maximum(np.searchsorted(path.starts, along, side='right') - 1, 0)
    q, first, second = (
        path.derived(order, numbers, along - path.starts[numbers]) for order in range(3)
    )
    velocity = first * rate[:, None]
    acceleration = second * (rate**2)[:, None] + first * bend[:, None]
    lengths = np.diff(times)
    return Path(lengths, quintics(lengths, q, velocity, acceleration))


def _straight(line: Path, profile: tuple[Array, Array, Array, Array], lasts: Array) -> Path:
    """Return one straight segment that follows a profile exactly: one cubic for each phase.

    A phase may be as short as rounding errors, so a polynomial cannot be fitted to its ends.
    """
    base, slope = line.coefficients[0, :2]
    place, rate, bend, jerk = profile
    coefficients = np.zeros((len(lasts), 6, len(base)))
    shares = np.stack((place, rate, bend / 2.0, jerk / 6.0), axis=1)
    coefficients[:, :4] = shares[:, :, None] * slope
    coefficients[:, 0] += base
    return Path(lasts, coefficients)


def _profile(
    length: float, full: FullSpeedPath
) -> tuple[tuple[Array, Array, Array, Array], Array]:
    """Return the phases of the profile: position, speed, acceleration and jerk at each begin."""
    one, endless = frozen([1.0]), frozen([np.inf])
    bounds = JointLimits(
        ('path',), -endless, endless, one, frozen([full.acceleration]), frozen([full.jerk])
    )
    begin, end = RobotState.at_rest([0.0]), RobotState.at_rest([length])
    plan = OnlineTrajectoryGenerator(bounds).to_state(begin, end)
    if plan is None:
        raise ArithmeticError(f'no profile over {length} s with {full.acceleration}, {full.jerk}')
    switches = np.concatenate(((0.0,), plan.switches))
    states = [plan.at(float(time)) for time in switches]
    place, rate, bend = (
        np.array([getattr(each, name)[0] for each in states])
        for name in ('position', 'velocity', 'acceleration')
    )
    lasts = np.diff(switches)
    real = lasts > 0.0
    jerk = np.divide(np.diff(bend), lasts, out=np.zeros_like(lasts), where=real)
    return (place[:-1][real], rate[:-1][real], bend[:-1][real], jerk[real]), lasts[real]


def _evaluated(
    profile: tuple[Array, Array, Array, Array], begins: Array, times: Array
) -> tuple[Array, Array, Array]:
    """Return position, speed and acceleration of the profile at some times."""
    number = np.maximum(np.searchsorted(begins, times, side='right') - 1, 0)
    place, rate, bend, jerk = (each[number] for each in profile)
    t = times - begins[number]
    return (
        place + t * (rate + t * (bend / 2.0 + t * jerk / 6.0)),
        rate + t * (bend + t * jerk / 2.0),
        bend + t * jerk,
    )


def timed_rows(rows: Array, limits: JointLimits) -> Path:
    """Return a jerk-limited path from rest to rest through joint positions in [rad] (k, n).

    The path is smooth: it cuts the corners by at most a quarter of a step.
    """
    steps = np.diff(rows, axis=0)
    lasts = (np.abs(steps) / limits.velocity).max(axis=1)
    moves = lasts > 0.0
    if not moves.any():
        return standstill(rows[0]).path
    rows, steps, lasts = np.concatenate((rows[:1], rows[1:][moves])), steps[moves], lasts[moves]
    slopes = steps / lasts[:, None]
    around = (lasts[1:] + lasts[:-1])[:, None]
    velocity = np.concatenate(
        (slopes[:1], (slopes[:-1] * lasts[1:, None] + slopes[1:] * lasts[:-1, None]) / around)
    )
    velocity = np.concatenate((velocity, slopes[-1:]))
    acceleration = np.zeros_like(velocity)
    acceleration[1:-1] = 2.0 * np.diff(slopes, axis=0) / around
    path = Path(lasts, quintics(lasts, rows, velocity, acceleration))
    most = float((limits.acceleration / limits.velocity).min())
    jerk = float((limits.jerk / limits.velocity).min())
    return timed(FullSpeedPath(path, most, jerk), limits)[0]


def speed_limited(
    path: Path, most: float, link_name: str, solver: Callable[[str], IkSolver]
) -> tuple[Path, tuple[str, ...]]:
    """Limit the speed of a link; return the path, and a note if it became slower.

    The geometry of the path stays the same. ``most`` is in [m/s]; 0 for no limit.
    """
    if not most:
        return path, ()
    if not 0.0 < most < math.inf:
        raise PlanningError(
            PlanningCode.INVALID_GOAL_CONSTRAINTS,
            f'max_cartesian_speed is {most:g} m/s; it must be positive, or 0 for no limit',
        )
    link = solver(link_name).link
    factor = _greatest_speed(path, link) / most
    if factor <= 1.0:
        return path, ()
    limited = slower(path, factor * SLOWER_MARGIN)
    note = (
        f'takes {limited.duration:.3f} s instead of {path.duration:.3f} s, for link'
        f' {link.link} may move at {most:g} m/s'
    )
    return limited, (note,)


def slower(path: Path, factor: float) -> Path:
    """Return the same path with its duration multiplied by a factor."""
    powers = (factor ** -np.arange(6.0))[:, None]
    return Path(path.durations * factor, path.coefficients * powers)


def _greatest_speed(path: Path, link: LinkKinematics) -> float:
    times = np.linspace(0.0, path.duration, SPEED_SAMPLES)
    fastest = int(_speeds(path, link, times).argmax())
    beside = times[max(fastest - 1, 0)], times[min(fastest + 1, SPEED_SAMPLES - 1)]
    return float(_speeds(path, link, np.linspace(*beside, SPEED_SAMPLES)).max())


def _speeds(path: Path, link: LinkKinematics, times: Array) -> Array:
    speeds = []
    for time in times.tolist():
        point = path.at(time)
        _, jacobian = link.pose_and_jacobian(point.position)
        speeds.append(np.linalg.norm(jacobian[:3] @ point.velocity))
    return np.array(speeds)
