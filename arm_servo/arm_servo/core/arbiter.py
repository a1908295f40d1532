# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Jogging, a trajectory and a single target: one of them moves the arm, and hands it over."""

from __future__ import annotations

from collections.abc import Hashable

import numpy as np

from arm_model import Array, RobotModel, RobotState
from arm_trajectory import GoalCode, hard_brake, OnlineTrajectoryGenerator

from ..jog.jogging import Jogging
from ..jog.servo_source import Command
from ..report import MotionReport
from .execution import Execution
from .outcome import CONTINUED, Outcome
from .set_point import Source
from .settings import CoreSettings
from .single_target import SingleTarget

Motion = Execution | SingleTarget  # what has a goal, and an outcome once it ended


class CommandArbiter:
    """What may move an arm, and what does.

    Attributes:
        execution: The trajectory that was followed last; None before the first.
        target: The single target that was aimed at last; None before the first.
        jogger: Who has jogged last.
        held: Whether a jog or a single target comes to rest, and goes on after that.
    """

    def __init__(
        self, model: RobotModel, generator: OnlineTrajectoryGenerator, settings: CoreSettings
    ) -> None:
        self._limits = model.limits
        self._generator = generator
        self._jogging = Jogging(model, settings.servo)
        self.active = Source.NONE
        self.execution: Execution | None = None
        self.target: SingleTarget | None = None
        self.jogger: Hashable = None
        self.held = False

    @property
    def motion(self) -> Motion | None:
        """The trajectory or the single target that moves the arm; None without one."""
        if self.active is Source.TRAJECTORY:
            return self.execution
        return self.target if self.active is Source.TARGET else None

    def jog(self, command: Command, fresh_until: float, client: Hashable) -> None:
        """Make a jog command the active motion.

        Args:
            fresh_until: Steady time until which it counts in [s].
        """
        if self.active is not Source.JOG:
            self.release('jogging took over')
            self._jogging.begin()
        self.active, self.jogger = Source.JOG, client
        self._jogging.take(command, fresh_until)

    @property
    def brakes(self) -> bool:
        """Whether what was ordered may still bring the arm to rest out of another motion."""
        if self.active is Source.TRAJECTORY:
            return self.execution is not None and self.execution.waits
        return self.active is Source.TARGET

    @property
    def on_path(self) -> bool:
        """Whether the step that was taken last is on a path that was checked for collisions."""
        if self.active is not Source.TRAJECTORY or self.execution is None:
            return False
        return self.execution.on_path

    def follow(self, execution: Execution) -> None:
        """Make a trajectory the active motion."""
        self.release('a new trajectory took over')
        self.active, self.execution = Source.TRAJECTORY, execution

    def aim(self, target: SingleTarget) -> None:
        """Make a single target the active motion."""
        if self.active is Source.TARGET:  # displacements add up: what was asked before is in it
            self.end(CONTINUED)
        self.release('a single target took over')
        self.active, self.target = Source.TARGET, target

    def stop(self, outcome: Outcome) -> None:
        """Come to rest: a trajectory on its path, anything else in the shortest time."""
        if self.active is Source.TRAJECTORY and self.execution is not None:
            self.execution.stop(outcome)
            return
        self.end(outcome)
        self.release(outcome.reason)

    def release(self, reason: str) -> None:
        """End the active motion; the arm comes to rest unless another one takes over."""
        self.end(Outcome(GoalCode.INVALID_GOAL, reason))
        self._jogging.end()
        self.active, self.held = Source.NONE, False

    def end(self, outcome: Outcome) -> None:
        """End the trajectory or the single target that moves the arm."""
        if self.motion is not None:
            self.motion.end(outcome)

    def step(
        self,
        state: RobotState,
        measured: RobotState,
        now: float,
        period: float,
        *,
        speed_scaling: float,
        paused: bool,
    ) -> tuple[RobotState, MotionReport]:
        """Return the next state that is wanted, and what limits it.

        Args:
            speed_scaling: Share of the speed of trajectories and targets, 0 to 1.
            paused: Whether jogging comes to rest in spite of a command.
        """
        report, wanted = MotionReport(), None
        if self.active is Source.JOG:
            velocity, report = self._jogging.step(state, now, period, held=paused or self.held)
            wanted = None if velocity is None else self._toward(state, velocity, period)
        elif self.active is Source.TRAJECTORY and self.execution is not None:
            wanted = self.execution.step(state, measured, speed_scaling, period)
        elif self.active is Source.TARGET and self.target is not None:
            wanted = self.target.step(state, 0.0 if self.held else speed_scaling, period)
        if wanted is None:
            wanted = self._toward(state, np.zeros(len(self._limits)), period)
        return wanted, report

    def ended(self, state: RobotState, now: float, *, paused: bool) -> Source:
        """Return what moved the arm in this cycle, and let go of what has ended.

        Args:
            paused: Whether jogging comes to rest in spite of a command.
        """
        source, motion = self.active, self.motion
        if isinstance(motion, SingleTarget):
            motion.arrive(state)
        done = motion is not None and motion.outcome is not None
        stale = paused or self._jogging.stale(now)
        if done or (source is Source.JOG and stale and not state.moving):
            self.release('')
        return source

    def _toward(self, state: RobotState, velocity: Array, period: float) -> RobotState:
        plan = self._generator.to_velocity(state, velocity)
        if plan is None:
            return hard_brake(state, self._limits, period)
        if period >= plan.duration and not velocity.any():
            return RobotState.at_rest(plan.at(plan.duration).position)
        return plan.at(period)
