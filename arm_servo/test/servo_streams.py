# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Following set-points in the tests, and checking what leaves on the bus."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from arm_model import Array, JointLimits, RobotModel, RobotState
from arm_servo import Execution, MotionCore, Phase, SetPoint
from arm_trajectory import GoalPoint, TrajectoryGoal

PERIOD = 0.004  # cycle of the streams in [s]


def kept(limits: JointLimits, states: list[RobotState], period: float = PERIOD) -> None:
    """Make sure that set-points keep every limit, also where only positions are seen."""
    position = np.array([state.position for state in states])
    velocity = np.array([state.velocity for state in states])
    acceleration = np.array([state.acceleration for state in states])
    assert np.all(position <= limits.upper + 1e-6)
    assert np.all(position >= limits.lower - 1e-6)
    assert np.all(np.abs(velocity) <= limits.velocity * 1.0001)
    assert np.all(np.abs(acceleration) <= limits.acceleration * 1.0001)
    assert np.all(np.abs(np.diff(acceleration, axis=0)) <= limits.jerk * period * 1.0001)
    speeds = np.diff(position, axis=0) / period
    assert np.all(np.abs(speeds) <= limits.velocity * 1.001)
    changes = np.diff(speeds, axis=0) / period
    rounding = 1e-7 / period**2  # [rad/s^2]: where one section follows another
    assert np.all(np.abs(changes) <= limits.acceleration * 1.001 + rounding)
    assert np.all(np.abs(np.diff(changes, axis=0)) <= limits.jerk * period * 1.3)


def wave(model: RobotModel, start: Array, kind: str, step: float = 1.5) -> TrajectoryGoal:
    """Return a trajectory of three points, linear (l), cubic (c) or quintic (q)."""
    count = len(model)
    ends = [np.linspace(0.3, -0.2, count), np.linspace(-0.2, 0.3, count), np.full(count, 0.1)]
    speeds = [np.linspace(-0.1, 0.1, count), np.linspace(0.1, -0.1, count), np.zeros(count)]
    points = [
        GoalPoint(
            step * (number + 1),
            tuple(start + end),
            tuple(speed) if kind in 'cq' else (),
            (0.0,) * count if kind == 'q' else (),
        )
        for number, (end, speed) in enumerate(zip(ends, speeds, strict=True))
    ]
    return TrajectoryGoal(model.joints, points)


Event = Callable[[MotionCore, float], object]


def stream(
    core: MotionCore, duration: float, events: Mapping[float, Event] | None = None
) -> list[SetPoint]:
    """Step a core for a time [s], with events at times [s]."""
    pending = sorted((events or {}).items(), key=lambda each: each[0])
    points = []
    for step in range(round(duration / PERIOD)):
        now = step * PERIOD
        while pending and pending[0][0] <= now:
            pending.pop(0)[1](core, now)
        points.append(core.step(now, PERIOD))
    return points


def follow_to_the_end(
    core: MotionCore, execution: Execution, longest: float = 20.0
) -> list[RobotState]:
    """Step a core until a trajectory is done, and return the states."""
    states = [core.state]
    for step in range(round(longest / PERIOD)):
        if execution.phase is Phase.DONE:
            return states
        states.append(core.step(step * PERIOD, PERIOD).state)
    raise AssertionError(f'the trajectory is not done after {longest} s')
