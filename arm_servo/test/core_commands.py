# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Commands to a core in a loop without other threads, and what comes of them: motion out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
import math

from model_robots import ready, robot
import numpy as np
import pinocchio as pin

from arm_model import Array, JointLimits, RobotModel, RobotState
import arm_servo
from arm_servo import Execution, MotionCore
from arm_servo.controllers.jog import Command
from arm_servo.core.requests import by_joint
from arm_trajectory import GoalPoint, TrajectoryGoal

PERIOD = 0.01  # cycle of the tests in [s]: slower than in use, so that they are quick


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """What came out of a run."""

    states: list[RobotState]  # state after every cycle, the start first
    report: arm_servo.MotionReport  # the last report
    limiters: tuple[arm_servo.Limiter, ...]  # of the last report that names one
    moved: Array  # twist from the first pose to the last, in the base


def twist_between(model: RobotModel, start: Array, end: Array) -> Array:
    """Return the twist from one pose to another in unit time."""
    before, after = model.pose(start), model.pose(end)
    angular = pin.log3(after.rotation @ before.rotation.T)
    return np.concatenate((after.position - before.position, angular))


def run(
    core: MotionCore,
    command: Command | Callable[[float], Command],
    duration: float,
    period: float = PERIOD,
) -> Run:
    """Jog by a command, or by one that changes with time, for a time [s]."""
    states, report = [core.state], arm_servo.MotionReport()
    limiters: tuple[arm_servo.Limiter, ...] = ()
    for step in range(round(duration / period)):
        now = step * period
        wanted = command(now) if callable(command) else command
        core.command(arm_servo.JogRequest(wanted, now + TIMEOUT), now)
        point = core.step(now, period)
        states.append(point.state)
        report, limiters = point.report, point.report.limiters or limiters
    moved = twist_between(core.model, states[0].position, states[-1].position)
    return Run(states, report, limiters, moved)


STREAM_PERIOD = 0.004  # cycle of the streams in [s]


def kept(limits: JointLimits, states: list[RobotState], period: float = STREAM_PERIOD) -> None:
    """Make sure that set-points keep every limit, also where only positions are seen.

    From beyond a limit of position the way leads back only.
    """
    position = np.array([state.position for state in states])
    velocity = np.array([state.velocity for state in states])
    acceleration = np.array([state.acceleration for state in states])
    assert np.all(position[1:] <= np.maximum(limits.upper, position[:-1]) + 1e-6)
    assert np.all(position[1:] >= np.minimum(limits.lower, position[:-1]) - 1e-6)
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
) -> list[arm_servo.SetPoint]:
    """Step a core for a time [s], with events at times [s]."""
    pending = sorted((events or {}).items(), key=lambda each: each[0])
    points = []
    for step in range(round(duration / STREAM_PERIOD)):
        now = step * STREAM_PERIOD
        while pending and pending[0][0] <= now:
            pending.pop(0)[1](core, now)
        points.append(core.step(now, STREAM_PERIOD))
    return points


def follow_to_the_end(
    core: MotionCore, execution: Execution, longest: float = 20.0
) -> list[RobotState]:
    """Step a core until a trajectory is done, and return the states."""
    states = [core.state]
    for step in range(round(longest / STREAM_PERIOD)):
        if execution.phase is arm_servo.Phase.DONE:
            return states
        states.append(core.step(step * STREAM_PERIOD, STREAM_PERIOD).state)
    raise AssertionError(f'the trajectory is not done after {longest} s')


def core_of(
    arm: str | RobotModel,
    settings: arm_servo.CoreSettings | None = None,
    at: Sequence[float] | Array | None = None,
) -> MotionCore:
    """Return a core of an arm at rest: in its pose to start from, or where it is put."""
    core = MotionCore(robot(arm) if isinstance(arm, str) else arm, settings)
    core.reset(ready(core.model.name) if at is None else at)
    return core


def goal_to(
    core: MotionCore, positions: Sequence[float] | Array, time: float = 2.0, age: float = 0.0
) -> TrajectoryGoal:
    """Return a trajectory of one point."""
    return TrajectoryGoal(core.model.joints, [GoalPoint(time, tuple(positions))], age=age)


def ending(execution: Execution) -> arm_servo.Outcome:
    """Return how a trajectory has ended."""
    assert execution.ending is not None
    return execution.ending


TIMEOUT = 0.1  # time for which a jog counts in [s]


def twist(
    core: MotionCore,
    numbers: Sequence[float] | Array,
    now: float,
    *,
    link: str | None = None,
    axes: Array | None = None,
    duration: float = TIMEOUT,
) -> None:
    """Move the tool at a speed."""
    jog = arm_servo.TwistCommand(np.array(numbers, dtype=np.float64), link, axes)
    core.command(arm_servo.JogRequest(jog, now + duration), now)


def jog(
    core: MotionCore, speeds: Mapping[str, float], now: float, duration: float = TIMEOUT
) -> None:
    """Move joints at speeds."""
    jog = arm_servo.JointCommand(*by_joint(core.model, speeds, 'velocities'))
    core.command(arm_servo.JogRequest(jog, now + duration), now)


def follow(core: MotionCore, goal: TrajectoryGoal) -> Execution:
    """Follow a trajectory."""
    execution = core.command(goal)
    assert isinstance(execution, Execution)
    return execution


def move_to(core: MotionCore, positions: Mapping[str, float], max_speed: float = math.inf) -> None:
    """Move joints to positions."""
    core.command(arm_servo.TargetRequest(positions, max_speed))


def move_by(
    core: MotionCore, displacements: Mapping[str, float], max_speed: float = math.inf
) -> None:
    """Move joints on by amounts."""
    core.command(arm_servo.DisplacementRequest(displacements, max_speed))


def override(core: MotionCore, speed: float) -> None:
    """Set the speed of trajectories and targets."""
    core.command(arm_servo.SpeedRequest(speed))


def pause(core: MotionCore) -> None:
    """Come to rest until resumed."""
    core.command(arm_servo.PauseRequest())


def resume(core: MotionCore) -> None:
    """Go on."""
    core.command(arm_servo.PauseRequest(is_paused=False))


def stop(core: MotionCore, reason: str = 'stopped') -> None:
    """Come to rest."""
    core.command(arm_servo.StopRequest(reason))
