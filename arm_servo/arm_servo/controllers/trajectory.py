# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Trajectory execution: along its path, at any speed scaling, with a final outcome."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from enum import Enum

import numpy as np

from arm_model import Array, JointLimits, RobotState
from arm_trajectory import (
    build_path,
    CatchUpInterpolator,
    DefaultTolerances,
    GoalCode,
    GoalRules,
    JointTolerance,
    merge_tolerances,
    OnlineTrajectoryGenerator,
    PathCheck,
    PathContact,
    TimerState,
    TrajectoryGoal,
    TrajectoryTimer,
)

from .controller import ArmState, Controller, Outcome, Source

ARRIVAL_TOLERANCE = 1e-6  # distance of set-points to the end that counts as arrived in [rad]
MAX_CATCH_UP_SCALING = 0.7  # speed scaling at most while the arm catches up with the path
PATH_MET_TOLERANCE = 1e-3  # distance of set-points to the path that counts as met in [rad]

PATH_LEFT_TOLERANCE = 0.02
"""Greatest distance in [rad] of the set-points from the path after they have met it."""


class Phase(Enum):
    """Phase of the execution of a trajectory."""

    FOLLOWING = 'following'
    SETTLING = 'settling'
    STOPPING = 'stopping'
    DONE = 'done'


@dataclass(frozen=True, slots=True)
class ExecutionSettings:
    """Settings for accepting and executing trajectories."""

    rules: GoalRules = field(default_factory=GoalRules)  # what is accepted
    # path tolerances, by joint or one for all; 0 is none
    path: DefaultTolerances = field(default_factory=JointTolerance)
    # goal tolerances, by joint or one for all; 0 is none
    goal: DefaultTolerances = field(default_factory=lambda: JointTolerance(0.0, 0.01))
    # time to come within the goal's tolerance after the end in [s]; 0 is without end
    goal_time: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Feedback:
    """Feedback on the execution of a trajectory."""

    time: float  # time of the trajectory in [s]
    desired: RobotState  # state of the trajectory now
    actual: RobotState  # what was measured
    timer: TimerState  # how it runs through the trajectory


class Execution(Controller):
    """Execution of one trajectory.

    Pause, speed and cancel act on the speed scaling of the path, so the arm stays on the path.

    Attributes:
        feedback: Feedback of the last step.
        path: The path that the arm follows.
        ending: Outcome that the execution has or will have; None while undecided.
    """

    source = Source.TRAJECTORY

    def __init__(
        self,
        goal: TrajectoryGoal,
        *,
        limits: JointLimits,
        generator: OnlineTrajectoryGenerator,
        state: RobotState,
        speed_scaling: float,
        settings: ExecutionSettings,
        wait: float = 0.0,  # wait at rest in [s]; requires a state at rest
    ) -> None:
        """Check a trajectory and plan its path.

        Raises:
            GoalError: The trajectory is refused.
        """
        self._limits, self._waiting = limits, wait
        planned = build_path(goal, limits, state, settings.rules)
        self.path, self._late = planned.path, planned.late
        # an arm that moves goes on as it does, and changes its speed from there
        self._timer = TrajectoryTimer(limits, 1.0 if state.moving else speed_scaling)
        self._begins_at_rest = not state.moving
        self._catch_up = CatchUpInterpolator(limits, generator)
        self._path_tolerance = merge_tolerances(
            limits, goal.path_tolerance, settings.path, 'path_tolerance'
        )
        self._goal_tolerance = merge_tolerances(
            limits, goal.goal_tolerance, settings.goal, 'goal_tolerance'
        )
        self._goal_time = goal.goal_time or settings.goal_time
        self._settling = 0.0
        self._off = 0.0
        self._met = False
        self._rested = False
        self.ending: Outcome | None = None
        self.phase = Phase.FOLLOWING
        begin_point = self.path.at(0.0)
        timer = TimerState(0.0, self._timer.speed_scaling, 0.0, speed_scaling, wait)
        self.feedback = Feedback(0.0, RobotState.at_rest(begin_point.position), state, timer)

    def contact(self, check: PathCheck, begin: float = 0.0) -> PathContact | None:
        """Return the first contact on the path after path time ``begin``. Thread-safe."""
        found = check.contact(
            lambda times: self.path.positions(times + begin), max(self.path.duration - begin, 0.0)
        )
        return found and replace(found, time=found.time + begin)

    def foreseen(self, ahead: float, timer: TimerState | None = None) -> RobotState:
        """Predict the state ``ahead`` [s] from now if nothing intervenes. Thread-safe."""
        timer = timer or self.feedback.timer
        return self._state(*TrajectoryTimer.foreseen(self._limits, self.path, timer, ahead)[:3])

    def timer(self, speed_scaling: float) -> TimerState:
        """Return the timer state for a speed scaling from now on."""
        return self.feedback.timer._replace(wanted=self._wanted(speed_scaling))

    def elapse(self, time: float) -> None:
        """Shorten the wait by the time that has passed since planning."""
        if self._waiting > 0.0:
            self._waiting -= time

    def stop(self, outcome: Outcome) -> None:
        """Bring the arm to rest on the path, then end with an outcome."""
        if self.phase in {Phase.FOLLOWING, Phase.SETTLING}:
            self.phase, self.ending = Phase.STOPPING, outcome

    def end(self, outcome: Outcome) -> None:
        """End at once with an outcome, unless already ended; stop commanding the arm."""
        if self.phase is not Phase.DONE:
            self.ending = self.ending or outcome
            self._finish()

    def update(self, arm: ArmState, period: float) -> RobotState | None:
        """Advance by one cycle.

        Returns:
            The state to command next; None to come to rest, because the trajectory does not begin
            yet or cannot be followed.
        """
        state, speed_scaling = arm.commanded, arm.speed_scaling
        if self.brakes and self._waits(speed_scaling, period):
            return self._wait(state, speed_scaling, period)
        self.brakes = False
        self._check(state, arm.measured, period)
        self._timer.step(self.path, self._wanted(speed_scaling), period)
        following = self._catch_up.step(state, self._ahead(period), period)
        self.on_path = following is not None and self._catch_up.exact
        desired = self._ahead(period)(period)
        self.feedback = Feedback(self._timer.time, desired, arm.measured, self._timer.state)
        self._advance(following)
        return following

    def _wanted(self, speed_scaling: float) -> float:
        """Return the speed scaling to aim for, given the requested one."""
        if self.phase is Phase.STOPPING:
            return 0.0
        # joints that give their utmost for the path cannot catch up
        return (
            min(speed_scaling, MAX_CATCH_UP_SCALING)
            if self._off > PATH_MET_TOLERANCE
            else speed_scaling
        )

    def _waits(self, speed_scaling: float, period: float) -> bool:
        """Return whether the start must wait: it is too early, or the arm is paused or stopped."""
        if self._waiting > 0.5 * period:
            return True
        if not self._begins_at_rest:
            return False
        self._timer.begin(speed_scaling)
        return speed_scaling == 0.0 or self.phase is Phase.STOPPING

    def _wait(self, state: RobotState, speed_scaling: float, period: float) -> RobotState | None:
        """Come to rest where the planned path begins, and wait there."""
        self._waiting -= period
        timer = TimerState(0.0, speed_scaling, 0.0, speed_scaling, max(self._waiting, 0.0))
        self.feedback = replace(self.feedback, timer=timer)
        if self.phase is Phase.STOPPING:
            self._finish()
            return None
        self._rested = self._rested or not state.moving
        if not self._rested or speed_scaling == 0.0:
            return None  # the joints slow down in step; in a pause they stay where they are
        rest = RobotState.at_rest(self.path.at(0.0).position)
        return self._catch_up.step(state, lambda _: rest, period)

    def _ahead(self, period: float) -> Callable[[float], RobotState]:
        """Return a function that maps time from now in [s] to the state on the path."""
        timer = self._timer

        def ahead(time: float) -> RobotState:
            return self._state(*timer.ahead(time - period))

        return ahead

    def _state(self, time: float, speed_scaling: float, change: float) -> RobotState:
        """Return the state at a path time, with the speed scaling and its change applied."""
        here = self.path.at(time)
        return RobotState(
            here.position,
            here.velocity * speed_scaling,
            here.acceleration * speed_scaling**2 + here.velocity * change,
        )

    def _check(self, state: RobotState, measured: RobotState, period: float) -> None:
        """Check the tolerances at the current state."""
        desired, limits = self.feedback.desired, self._limits
        error = limits.error(desired.position, measured.position)
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
        """Describe the deviation of set-points that left the path; None if within tolerance."""
        joint = int(np.argmax(np.abs(error)))
        self._off = float(abs(error[joint]))
        self._met = self._met or self._off < PATH_MET_TOLERANCE
        if not self._met or self._off <= PATH_LEFT_TOLERANCE:
            return None
        name = self._limits.names[joint]
        return f'{name}: the set-point is {error[joint]:+.4f} rad off the path'

    def _settle(self, state: RobotState, violation: str | None, period: float) -> None:
        """Wait at the end until the arm has arrived or the goal time has expired."""
        arrived = np.allclose(state.position, self.path.end.position, atol=ARRIVAL_TOLERANCE)
        if violation is None and arrived and not state.moving:
            late = f', {self._late}' if self._late else ''
            self.ending = Outcome(GoalCode.SUCCESSFUL, f'the goal is reached{late}')
            self._finish()
            return
        self._settling += period
        if 0.0 < self._goal_time < self._settling:
            what = violation or 'the set-points have not arrived'
            self.ending = Outcome(
                GoalCode.GOAL_TOLERANCE_VIOLATED,
                f'{what}, {self._settling:.3f} s after the end (goal_time {self._goal_time:g} s)',
            )
            self._finish()

    def _advance(self, state: RobotState | None) -> None:
        """Enter the next phase at the end of the path, or when the timer has stopped."""
        if self.phase is Phase.FOLLOWING and self._timer.time >= self.path.duration:
            self.phase = Phase.SETTLING
        at_rest = self._timer.stopped or self._timer.time >= self.path.duration
        if self.phase is Phase.STOPPING and at_rest and (state is None or not state.moving):
            self._finish()

    def _finish(self) -> None:
        self.phase, self.outcome = Phase.DONE, self.ending
