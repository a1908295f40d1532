# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The interface of what moves an arm, and what comes out of it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from enum import Enum

from arm_model import ArmError, RobotState
from arm_trajectory import GoalCode, GoalError

from ..report import MotionReport


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
    canceled: bool = False  # whether it was asked to end


CONTINUED = Outcome(GoalCode.SUCCESSFUL, 'a further target goes on from it')
"""A single target that was not reached, as another one took its place."""


def refused(error: BaseException) -> Outcome:
    """Return the outcome of a motion that does not begin."""
    code = error.code if isinstance(error, GoalError) else GoalCode.INVALID_GOAL
    if isinstance(error, ArmError):
        return Outcome(code, str(error))
    return Outcome(code, f'the motion could not be planned: {type(error).__name__}: {error}')


@dataclass(slots=True, eq=False)
class ArmState:
    """What a controller sees of the arm in a cycle."""

    commanded: RobotState  # what was commanded last
    measured: RobotState  # what the drives report
    now: float  # time of the cycle
    speed_scaling: float  # share of the speed of trajectories and targets; 0 in a pause
    is_paused: bool  # whether jogging comes to rest in spite of a command
    is_held: bool  # whether a jog or a target comes to rest, and goes on after that


class Controller(ABC):
    """What moves the arm, cycle by cycle.

    Attributes:
        source: Its kind.
        outcome: How it ended; None while it goes on.
        report: What limits its last step.
        on_path: Whether its last step is on a path that was checked for collisions.
        brakes: Whether it may still bring the arm to rest out of another motion.
    """

    source: Source
    outcome: Outcome | None = None
    report = MotionReport()
    on_path = False
    brakes = True

    @abstractmethod
    def update(self, arm: ArmState, period: float) -> RobotState | None:
        """Return the next state; None to come to rest."""

    def conclude(self, arm: ArmState, state: RobotState) -> bool:  # of others
        """Return whether it is over, once a state is commanded that need not be its own."""
        return self.outcome is not None

    def stop(self, outcome: Outcome) -> None:
        """Come to rest: on its path where it has one, else it ends at once."""
        self.end(outcome)

    def end(self, outcome: Outcome) -> None:
        """End at once, unless it has ended: something else moves the arm now, or nothing."""
        self.outcome = self.outcome or outcome
