# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The way of an arm in motion to the begin of a path, with the speed that it has there.

A quintic where it keeps within the limits: it is the smoothest. Else the jerk-limited way of
ruckig, which takes longer where it must.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from arm_model import JointLimits, RobotState

from ..otg import OnlineTrajectoryGenerator, Plan
from .path import farthest_beyond, Path
from .time_scaling import Timing

MIN_PHASE = 1e-7  # least length of a segment with one jerk in [s]; shorter ones are left out


def approach_path(
    state: RobotState, begin: RobotState, duration: float, limits: JointLimits
) -> Path | None:
    """Return the path from a motion to the begin of another path; None where there is none.

    Args:
        begin: Where it leads, with velocity and acceleration within the limits.
        duration: How long it lasts in [s]; longer where the joints need that.
    """
    # an arm that is beyond a limit may come back
    lower = np.minimum(limits.lower, state.position)
    upper = np.maximum(limits.upper, state.position)
    for path in _candidates(state, begin, duration, limits):
        if farthest_beyond(path, lower, upper) is None:
            return path
    return None


def _candidates(
    state: RobotState, begin: RobotState, duration: float, limits: JointLimits
) -> Iterator[Path]:
    if duration > 0.0:
        smooth = Path.between(duration, state, begin)
        if Timing(smooth, limits).demand.time_factor <= 1.0:
            yield smooth
    generator = OnlineTrajectoryGenerator(limits)
    plan = generator.to_state(state, begin, duration or None)
    plan = plan or generator.to_state(state, begin)  # ruckig may refuse a least duration
    if plan is not None:
        yield _phases(plan)


def stop_path(state: RobotState, limits: JointLimits) -> Path | None:
    """Return the shortest path from a motion to rest; None where ruckig has no answer."""
    stop = OnlineTrajectoryGenerator(limits).brake(state)
    return None if stop is None else _phases(stop)


def _phases(plan: Plan) -> Path:
    """Return a plan as polynomials with one jerk each."""
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
