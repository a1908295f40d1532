# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Controller interface of an arm, its results, and the simplest controller.

A :class:`Controller`, such as :class:`SingleTarget`, moves the arm cycle by cycle. Its
:class:`MotionReport` states what limits a step, its :class:`Outcome` how the motion ended.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from enum import Enum

import numpy as np

from arm_model import ArmError, Array, frozen, RobotState
from arm_trajectory import GoalCode, GoalError, OnlineTrajectoryGenerator, Plan

HALTED = 0.005  # share of the commanded speed below which a motion counts as halted


class Cause(Enum):
    """Why a motion is slower than commanded."""

    JOINT_POSITION = 'joint limit'
    JOINT_VELOCITY = 'joint speed'
    JOINT_ACCELERATION = 'joint acceleration'
    COLLISION = 'collision'
    SINGULARITY = 'singularity'
    HOLD = 'path'
    SOLVER = 'solver'


@dataclass(frozen=True, slots=True)
class Limiter:
    """One cause that limits a motion."""

    cause: Cause  # kind of limit
    name: str  # limiting object: a joint, two links, an axis of the tool
    # remaining distance in [rad] or [m], required speed in [rad/s], or measure of the singularity
    amount: float
    factor: float  # remaining share of the commanded speed, 0 to 1

    def __str__(self) -> str:
        """Describe it in a few words."""
        share = f'at {100.0 * self.factor:.0f} %' if self.factor >= HALTED else 'halted'
        if self.cause is Cause.COLLISION:
            return f'collision: {self.name} at {1e3 * self.amount:.0f} mm, {share}'
        if self.cause is Cause.JOINT_POSITION:
            left = round(self.amount, 3) + 0.0  # never -0.000
            return f'joint limit: {self.name}, {left:.3f} left, {share}'
        if self.cause is Cause.JOINT_VELOCITY:
            return f'joint speed: {self.name} would need {self.amount:.2f}, {share}'
        return f'{self.cause.value}: {self.name}, {share}'


@dataclass(frozen=True, slots=True)
class MotionReport:
    """How much of a commanded speed is achieved, and what limits it."""

    factor: float = 1.0  # achieved share of the commanded speed; 1 without limiters
    limiters: tuple[Limiter, ...] = ()  # what limits it, the strongest first

    def __post_init__(self) -> None:
        """Sort the limiters, the strongest first."""
        if len(self.limiters) > 1:
            strongest = tuple(sorted(self.limiters, key=lambda limiter: limiter.factor))
            object.__setattr__(self, 'limiters', strongest)

    def with_limiter(self, limiter: Limiter) -> MotionReport:
        """Return a copy of the report with one more limiter."""
        return MotionReport(min(self.factor, limiter.factor), (limiter, *self.limiters))

    def __str__(self) -> str:
        """Describe it in one line."""
        if not self.limiters:
            return 'free'
        return '; '.join(str(limiter) for limiter in self.limiters)


class NotReadyError(ArmError):
    """The arm accepts no commands before its position is known.

    Scenarios: a command before the first joint state, or after the set-point was dropped.
    """


class BackendError(ArmError):
    """The back end cannot start; the message names the remedy.

    Scenarios: a bus.yml with mistakes, a CAN interface that is not there, a bus with a master.
    """


class Source(Enum):
    """What moves the arm."""

    NONE = 'none'
    JOG = 'jog'
    TRAJECTORY = 'trajectory'
    TARGET = 'target'


JOGGING = (Source.JOG, Source.TARGET)  # what the servo commands
MOTIONS = (*JOGGING, Source.TRAJECTORY)  # what moves the arm


@dataclass(frozen=True, slots=True, eq=False)
class SetPoint:
    """What to command in a cycle."""

    state: RobotState  # positions, velocities and accelerations
    source: Source  # what moves the arm
    report: MotionReport  # what limits the motion


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a motion ended."""

    code: GoalCode  # code of the action's result
    reason: str  # why, in words
    canceled: bool = False  # whether a client canceled it


CONTINUED = Outcome(GoalCode.SUCCESSFUL, 'a further target goes on from it')
"""Outcome of a single target that a newer one replaced before the arm reached it."""


def refused(error: BaseException) -> Outcome:
    """Convert an error to the outcome of a motion that did not start."""
    code = error.code if isinstance(error, GoalError) else GoalCode.INVALID_GOAL
    if isinstance(error, ArmError):
        return Outcome(code, str(error))
    return Outcome(code, f'the motion could not be planned: {type(error).__name__}: {error}')


@dataclass(slots=True, eq=False)
class ArmState:
    """Input of a controller in one cycle."""

    commanded: RobotState  # what was commanded last
    measured: RobotState  # what the drives report
    now: float  # time of the cycle
    speed_scaling: float  # share of the speed of trajectories and targets; 0 in a pause
    is_paused: bool  # whether a pause overrides jog commands
    is_held: bool  # whether a jog or a target is held at rest, to resume later


class Controller(ABC):
    """Abstract base of controllers, which move the arm cycle by cycle."""

    source: Source  # its kind
    outcome: Outcome | None = None  # how it ended; None while it goes on
    report = MotionReport()  # what limits its last step
    on_path = False  # whether its last step is on a path that was checked for collisions
    brakes = True  # whether it may still be stopping the arm from another motion

    @abstractmethod
    def update(self, arm: ArmState, period: float) -> RobotState | None:
        """Return the next state; None to come to rest."""

    def conclude(self, arm: ArmState, state: RobotState) -> bool:  # of others
        """Return whether the motion is over, given the state commanded, its own or another."""
        return self.outcome is not None

    def stop(self, outcome: Outcome) -> None:
        """Bring the arm to rest on the path, if there is one; else end at once."""
        self.end(outcome)

    def end(self, outcome: Outcome) -> None:
        """End at once with an outcome, unless already ended; stop commanding the arm."""
        self.outcome = self.outcome or outcome


ARRIVAL_TOLERANCE = 1e-6  # distance of set-points to the target that counts as arrived in [rad]
MIN_SPEED_FACTOR = 0.01  # least share of the speed that a target is approached with


class SingleTarget(Controller):
    """Moves to one target, and replans in every cycle."""

    source = Source.TARGET

    def __init__(
        self, target: Array, max_speed: float, generator: OnlineTrajectoryGenerator
    ) -> None:
        self.target = frozen(target)
        self._max_speed, self._generator = max_speed, generator
        self._planned_for, self._planner = 0.0, generator

    def plan(self, state: RobotState, speed_scaling: float) -> Plan | None:
        """Return the motion to the target at a speed scaling; None if there is no plan."""
        speed_scaling = max(speed_scaling, MIN_SPEED_FACTOR)
        if speed_scaling != self._planned_for:
            self._planned_for = speed_scaling
            self._planner = OnlineTrajectoryGenerator(
                self._generator.limits.scaled(speed_scaling, fastest=self._max_speed)
            )
        return self._planner.to_state(state, RobotState.at_rest(self.target))

    def update(self, arm: ArmState, period: float) -> RobotState | None:
        """Return the next state; None to come to rest."""
        state = arm.commanded
        if arm.is_held or arm.speed_scaling == 0.0:
            return None
        plan = self.plan(state, arm.speed_scaling)
        if plan is None:
            if not state.moving:
                self.end(Outcome(GoalCode.INVALID_GOAL, 'no motion leads to the target'))
            return None
        return RobotState.at_rest(self.target) if plan.duration <= period else plan.at(period)

    def conclude(self, arm: ArmState, state: RobotState) -> bool:
        """End when the arm rests at the target; return whether the motion has ended."""
        if not state.moving and np.allclose(state.position, self.target, atol=ARRIVAL_TOLERANCE):
            self.end(Outcome(GoalCode.SUCCESSFUL, 'the target is reached'))
        return super().conclude(arm, state)
