# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Rounding of the corners of a path, including its start and end."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from arm_model import Array, JointLimits, RobotState

from .path import Path, shifted

DURATION_FACTOR = 1.25
"""Factor on the least rounding time that the peaks need, as segments are curved, too."""

MIN_HALF_TIME = 0.02
"""Least half duration of a rounding in [s]: a few cycles, so that samples show no corner."""

OVERLAP_TOLERANCE = 0.005  # greatest path deviation of overlapping roundings in [rad]

DEVIATION_FACTOR = 0.007
"""Greatest path deviation of a rounded acceleration step, as a share of E d^2."""

MERGE_TOLERANCE = 1e-7  # segment boundaries nearer than this are merged in [s]


@dataclass(frozen=True, slots=True, eq=False)
class _Corners:
    """Corners: times where velocity or acceleration jumps."""

    times: Array  # when in [s] (k)
    jumps: Array  # jumps of the velocities in [rad/s] (k, n)
    bends: Array  # jumps of the accelerations in [rad/s2] (k, n)
    rooms: Array  # half of the shorter neighbour in [s] (k)


def rounded(path: Path, limits: JointLimits, *, from_rest: bool = True) -> Path:
    """Round the corners of a path, including its start and end.

    Where velocity jumps by D or acceleration by E, the path is smoothed over a time 2 d that keeps
    the peaks, 3/4 D/d of acceleration and 3/2 D/d^2 or 9/8 E/d of jerk, within the limits. It
    deviates by 3/16 D d at a corner of straight segments, by 0.007 E d^2 at an acceleration step.
    Where points are so dense that roundings overlap, they add up, and the result is their smooth
    mean; d is reduced if that would deviate too far. A path that does not start or end at rest
    gets longer by d there.

    Args:
        path: Path whose segments may meet in corners.
        from_rest: Whether the arm is at rest at the start; else the start stays unchanged.
    """
    corners = _corners(path, from_rest=from_rest)
    halves = _halves(corners, limits)
    if not from_rest:
        halves = np.minimum(halves, corners.times)
    if not halves.any():
        return path
    lead = max(float(np.max(halves - corners.times)), 0.0)
    tail = max(float(np.max(corners.times + halves)) - path.duration, 0.0)
    rests = _rest(lead, path.at(0.0).position), _rest(tail, path.end.position)
    base = Path.joined([*rests[0], path, *rests[1]])
    corners = replace(corners, times=corners.times + lead)
    starts = _breaks(base, corners.times, halves)
    pieces = base.cut(starts)
    for corner in np.flatnonzero(halves):
        _round(pieces, starts, corners, int(corner), float(halves[corner]))
    return Path(np.diff(starts), pieces)


def run_out(end: RobotState, limits: JointLimits) -> list[Path]:
    """Return the motion to rest after a path that ends with a velocity."""
    still = np.zeros_like(end.velocity)
    duration = 2.0 * float(_needed(end.velocity[None], still[None], limits)[0])
    if duration == 0.0:
        return []
    behind = RobotState(end.position + 0.5 * duration * end.velocity, still, still)
    return [Path.between(duration, RobotState(end.position, end.velocity, still), behind)]


def _corners(path: Path, *, from_rest: bool) -> _Corners:
    """Return the corners between segments, and those to rest at start and end."""
    places, lasts = np.arange(len(path.durations)), path.durations
    at_rest = np.zeros((1, path.coefficients.shape[2]))
    jumps, bends = (
        np.concatenate((path.derived(order, places, 0.0 * lasts), at_rest))
        - np.concatenate((at_rest, path.derived(order, places, lasts)))
        for order in (1, 2)
    )
    if not from_rest:
        jumps[0], bends[0] = 0.0, 0.0
    rooms = 0.5 * np.minimum(np.append(lasts, np.inf), np.insert(lasts, 0, np.inf))
    return _Corners(np.append(path.starts, path.duration), jumps, bends, rooms)


def _needed(jumps: Array, bends: Array, limits: JointLimits) -> Array:
    """Return half the rounding time in [s] for velocity and acceleration jumps; 0 for none."""
    jump, bend = np.abs(jumps), np.abs(bends)
    by_acceleration = np.max(0.75 * jump / limits.acceleration, axis=1)
    by_jerk = np.max(np.sqrt(1.5 * jump / limits.jerk), axis=1)
    by_bend = np.max(1.125 * bend / limits.jerk, axis=1)
    needed = DURATION_FACTOR * np.maximum(np.maximum(by_acceleration, by_jerk), by_bend)
    none = np.maximum((jump / limits.velocity).max(1), (bend / limits.acceleration).max(1)) < 1e-6
    halves: Array = np.where(none, 0.0, np.maximum(needed, MIN_HALF_TIME))
    return halves


def _halves(corners: _Corners, limits: JointLimits) -> Array:
    """Return half the duration of each rounding in [s]; 0 without a corner."""
    jump = np.maximum(np.abs(corners.jumps).max(axis=1), 1e-12)
    bend = np.maximum(np.abs(corners.bends).max(axis=1), 1e-12)
    harmless = np.minimum(
        OVERLAP_TOLERANCE / (3.0 / 16.0 * jump),
        np.sqrt(OVERLAP_TOLERANCE / (DEVIATION_FACTOR * bend)),
    )
    halves: Array = np.minimum(
        _needed(corners.jumps, corners.bends, limits), np.maximum(corners.rooms, harmless)
    )
    return halves


def _rest(duration: float, position: Array) -> list[Path]:
    """Return a rest at a position; empty for duration 0."""
    coefficients = np.zeros((1, 6, len(position)))
    coefficients[0, 0] = position
    return [Path(np.array([duration]), coefficients)] if duration > 0.0 else []


def _breaks(base: Path, times: Array, halves: Array) -> Array:
    """Return the times in [s] between which the rounded path is one polynomial."""
    rounds = halves > 0.0
    end = base.duration
    ends = (times[rounds] - halves[rounds], times[rounds], times[rounds] + halves[rounds])
    inner = np.sort(np.concatenate((base.starts[1:], *ends)))
    inner = inner[(inner > MERGE_TOLERANCE) & (inner < end - MERGE_TOLERANCE)]
    apart = np.diff(inner, prepend=0.0) > MERGE_TOLERANCE
    breaks: Array = np.concatenate(((0.0,), inner[apart], (end,)))
    return breaks


def _round(pieces: Array, starts: Array, corners: _Corners, corner: int, half: float) -> None:
    """Add the rounding of a corner to the polynomials around it."""
    time, jump, bend = corners.times[corner], corners.jumps[corner], corners.bends[corner]
    d = half
    smooth = np.array(
        [
            0.0 * jump,
            0.0 * jump,
            0.0 * jump,
            jump / (4 * d**2) - bend / (8 * d),
            -jump / (16 * d**3) + 2.5 * bend / (16 * d**2),
            -bend / (32 * d**3),
        ]
    )
    sharp = np.zeros_like(smooth)
    sharp[1], sharp[2] = jump, 0.5 * bend
    middles = 0.5 * (starts[:-1] + starts[1:])
    first, turn, last = np.searchsorted(middles, (time - half, time, time + half)).tolist()
    pieces[first:last] += shifted(smooth, starts[first:last] - (time - half))
    pieces[turn:last] -= shifted(sharp, starts[turn:last] - time)
