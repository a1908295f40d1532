# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Running the servo in the tests: command in, motion out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from arm_model import Array, RobotModel, RobotState
from arm_servo import Limiter, MotionReport
from arm_servo.controllers.jog import Command, ServoSource
from arm_servo.core.safety_filter import SafetyFilter
from arm_trajectory import OnlineTrajectoryGenerator

PERIOD = 0.01  # cycle of the tests in [s]: slower than in use, so that they are quick


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """What came out of a run."""

    states: list[RobotState]  # state after every cycle, the start first
    report: MotionReport  # the last report
    held_up: list[Limiter]  # what the safety filter held up, by any cycle
    moved: Array  # twist from the first pose to the last, in the base


def twist_between(model: RobotModel, start: Array, end: Array) -> Array:
    """Return the twist from one pose to another in unit time."""
    before, after = model.pose(start), model.pose(end)
    angular = pin.log3(after.rotation @ before.rotation.T)
    return np.concatenate((after.position - before.position, angular))


def run(
    model: RobotModel,
    start: Array | RobotState,
    command: Command | Callable[[float], Command],
    duration: float,
    period: float = PERIOD,
) -> Run:
    """Carry out a command, or one that changes with time, for a time [s]."""
    source, generator = ServoSource(model), OnlineTrajectoryGenerator(model.limits)
    safety_filter = SafetyFilter(model, generator)
    state = start if isinstance(start, RobotState) else RobotState.at_rest(start)
    safety_filter.reset(state)
    states, held_up, report = [state], [], MotionReport()
    for step in range(round(duration / period)):
        now = command(step * period) if callable(command) else command
        answer = source.step(state, now, period)
        report = answer.report
        plan = generator.to_velocity(state, answer.velocity)
        assert plan is not None
        state, limiter = safety_filter.step(state, plan.at(period), period, 0.005)
        held_up += [limiter] if limiter is not None else []
        states.append(state)
    moved = twist_between(model, states[0].position, state.position)
    return Run(states, report, held_up, moved)
