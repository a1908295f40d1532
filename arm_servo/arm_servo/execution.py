# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Following a trajectory: on its path, at any pace, to an end that says how it went."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from .arrays import Array
from .exceptions import GoalCode
from .follower import Follower
from .goal import GoalRules, JointTolerance, TrajectoryGoal
from .goal_path import build_path
from .limits import JointLimits
from .otg import Generator, MotionState
from .path import Path
from .path_clock import PathClock
from .tolerances import tolerances

ARRIVED = 1e-6
"""How near to the end the set-points must be to have arrived in [rad]."""

CHASING = 0.7
"""Pace at most while the arm catches up with the path."""

MET = 1e-3
"""How near to the path the set-points must be to have met it in [rad]."""

ASTRAY = 0.02
"""How far from the path the set-points may be once they have met it in [rad]."""


class Phase(Enum):
    """Where the execution of a trajectory is."""

    FOLLOWING = 'following'
    SETTLING = 'settling'
    STOPPING = 'stopping'
    DONE = 'done'


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a trajectory ended.

    Attributes:
        code: Code of the action's result.
        reason: Why, in words.
        canceled: Whether it was asked to end.
    """

    code: GoalCode
    reason: str
    canceled: bool = False


@dataclass(frozen=True, slots=True)
class ExecutionSettings:
    """How trajectories are accepted and followed.

    Attributes:
        rules: What is accepted.
        path: Tolerance of each joint on the way; 0 is none.
        goal: Tolerance of each joint at the end; 0 is none.
        goal_time: Time to come within the goal's tolerance after the end in [s]; 0 is without end.
    """

    rules: GoalRules = field(default_factory=GoalRules)
    path: JointTolerance = field(default_factory=JointTolerance)
    goal: JointTolerance = field(default_factory=lambda: JointTolerance(0.0, 0.01))
    goal_time: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Feedback:
    """Where the execution is.

    Attributes:
        time: Time of the trajectory in [s].
        desired: What the trajectory says now.
        actual: What was measured.
        pace: Seconds of the trajectory per second.
    """

    time: float
    desired: MotionState
    actual: MotionState
    pace: float


class Execution:
    """One trajectory on its way.

    Pause, speed and cancel act on the pace at which the path is walked, so the arm stays on it.

    Attributes:
        phase: Where the execution is.
        feedback: Where it is on the path, as of the last step.
        ending: How it ends or has ended; None while nothing is decided.
    """

    def __init__(
        self,
        goal: TrajectoryGoal,
        *,
        limits: JointLimits,
        generator: Generator,
        state: MotionState,
        pace: float,
        settings: ExecutionSettings,
        wait: float = 0.0,
    ) -> None:
        """Accept a trajectory.

        Args:
            goal: The trajectory.
            limits: Limits of the joints.
            generator: Plans how to catch up.
            state: Commanded state of the arm where it begins.
            pace: Pace to start with, 0 to 1.
            settings: How it is followed.
            wait: How long to wait at rest in [s]; the state is one of rest then.

        Raises:
            GoalError: It is refused.
        """
        self._limits, self._waiting = limits, wait
        planned = build_path(goal, limits, state, settings.rules)
        self._path, self._late = planned.path, planned.late
        # an arm that moves goes on as it does, and takes up the pace from there
        self._clock = PathClock(limits, 1.0 if state.moving else pace)
        self._follower = Follower(limits, generator)
        self._path_tolerance = tolerances(limits, goal.path_tolerance, settings.path)
        self._goal_tolerance = tolerances(limits, goal.goal_tolerance, settings.goal)
        self._goal_time = goal.goal_time or settings.goal_time
        self._settling = 0.0
        self._off = 0.0
        self._met = False
        self._rested = False
        self.ending: Outcome | None = None
        self.phase = Phase.FOLLOWING
        begin_point = self._path.at(0.0)
        self.feedback = Feedback(0.0, MotionState.at_rest(begin_point.position), state, pace)

    @property
    def path(self) -> Path:
        """The path that it follows."""
        return self._path

    @property
    def duration(self) -> float:
        """How long its path lasts at full pace in [s]."""
        return self._path.duration

    def foreseen(self, ahead: float) -> MotionState:
        """Return where it will be at its present pace; for any thread.

        Args:
            ahead: Time from the last step in [s]; less than 0 is the past.
        """
        feedback, path = self.feedback, self._path
        here = path.at(feedback.time + feedback.pace * max(ahead - self._waiting, 0.0))
        return MotionState(
            here.position, here.velocity * feedback.pace, here.acceleration * feedback.pace**2
        )

    def stop(self, outcome: Outcome) -> None:
        """Come to rest on the path, and end.

        Args:
            outcome: How it ends then.
        """
        if self.phase in {Phase.FOLLOWING, Phase.SETTLING}:
            self.phase, self.ending = Phase.STOPPING, outcome

    def abandon(self, outcome: Outcome) -> None:
        """End at once: something else moves the arm now.

        Args:
            outcome: How it ended.
        """
        if self.phase is not Phase.DONE:
            self.ending = self.ending or outcome
            self.phase = Phase.DONE

    def step(
        self, state: MotionState, measured: MotionState, pace: float, period: float
    ) -> MotionState | None:
        """Advance.

        Args:
            state: Commanded state now.
            measured: Measured state now.
            pace: Wanted pace, 0 to 1.
            period: Time to the next step in [s].

        Returns:
            The state to command next; None to come to rest: it does not begin yet, or there is no
            way to follow.
        """
        if self.waits:
            return self._wait(state, period)
        self._check(state, measured, period)
        if self.phase is Phase.STOPPING:
            pace = 0.0
        elif self._off > MET:  # joints that give their utmost for the path cannot catch up
            pace = min(pace, CHASING)
        self._clock.step(self._path, pace, period)
        following = self._follower.step(state, self._ahead(period), period)
        desired = self._ahead(period)(period)
        self.feedback = Feedback(self._clock.time, desired, measured, self._clock.pace)
        self._advance(following)
        return following

    @property
    def waits(self) -> bool:
        """Whether it is yet to begin."""
        return self._waiting > 0.0

    def _wait(self, state: MotionState, period: float) -> MotionState | None:
        """Come to rest where the path begins, and wait there; all is planned already."""
        self._waiting -= period
        if self.phase is Phase.STOPPING:
            self.phase = Phase.DONE
            return None
        self._rested = self._rested or not state.moving
        if not self._rested:
            return None  # the joints slow down in step
        rest = MotionState.at_rest(self._path.at(0.0).position)
        return self._follower.step(state, lambda _: rest, period)

    def _ahead(self, period: float) -> Callable[[float], MotionState]:
        """Return where the path will be, by the time from now in [s]."""
        clock, path = self._clock, self._path

        def ahead(time: float) -> MotionState:
            at, pace, change = clock.ahead(time - period)
            here = path.at(at)
            return MotionState(
                here.position,
                here.velocity * pace,
                here.acceleration * pace**2 + here.velocity * change,
            )

        return ahead

    def _check(self, state: MotionState, measured: MotionState, period: float) -> None:
        """Check the tolerances at the present place."""
        desired, limits = self.feedback.desired, self._limits
        error = desired.position - measured.position
        speed_error = desired.velocity - measured.velocity
        if self.phase is Phase.FOLLOWING:
            violation = self._astray(desired.position - state.position)
            violation = violation or self._path_tolerance.violation(limits, error, speed_error)
            if violation is not None:
                where = f'{violation}, at {self.feedback.time:.3f} s of the trajectory'
                self.stop(Outcome(GoalCode.PATH_TOLERANCE_VIOLATED, where))
        elif self.phase is Phase.SETTLING:
            self._settle(state, self._goal_tolerance.violation(limits, error, speed_error), period)

    def _astray(self, error: Array) -> str | None:
        """Return how far the set-points are from the path that they had met, if it is too far."""
        joint = int(np.argmax(np.abs(error)))
        self._off = float(abs(error[joint]))
        self._met = self._met or self._off < MET
        if not self._met or self._off <= ASTRAY:
            return None
        name = self._limits.names[joint]
        return f'{name}: the set-point is {error[joint]:+.4f} rad off the path'

    def _settle(self, state: MotionState, violation: str | None, period: float) -> None:
        """Wait at the end until the arm has arrived, or the time for that is over."""
        arrived = np.allclose(state.position, self._path.end.position, atol=ARRIVED)
        if violation is None and arrived and not state.moving:
            late = f', {self._late}' if self._late else ''
            self.ending = Outcome(GoalCode.SUCCESSFUL, f'the goal is reached{late}')
            self.phase = Phase.DONE
            return
        self._settling += period
        if 0.0 < self._goal_time < self._settling:
            what = violation or 'the set-points have not arrived'
            self.ending = Outcome(
                GoalCode.GOAL_TOLERANCE_VIOLATED,
                f'{what}, {self._settling:.3f} s after the end (goal_time {self._goal_time:g} s)',
            )
            self.phase = Phase.DONE

    def _advance(self, state: MotionState | None) -> None:
        """Go on to the next phase at the end of the path, or where it stands still."""
        if self.phase is Phase.FOLLOWING and self._clock.time >= self._path.duration:
            self.phase = Phase.SETTLING
        at_rest = self._clock.stopped or self._clock.time >= self._path.duration
        if self.phase is Phase.STOPPING and at_rest and (state is None or not state.moving):
            self.phase = Phase.DONE
