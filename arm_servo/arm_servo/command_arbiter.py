# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Jogging, a trajectory and a single target: one of them moves the arm, and hands it over."""

from __future__ import annotations

import numpy as np

from .arrays import Array, frozen
from .core_settings import CoreSettings
from .exceptions import GoalCode
from .execution import Execution, Outcome, Phase
from .jogging import Jogging
from .model import RobotModel
from .otg import Generator, hard_brake, MotionState
from .report import MotionReport
from .servo import Command
from .set_point import Source
from .single_target import SingleTarget


class CommandArbiter:
    """What may move an arm, and what does.

    Attributes:
        active: What moves the arm.
        execution: The trajectory that was followed last; None before the first.
    """

    def __init__(self, model: RobotModel, generator: Generator, settings: CoreSettings) -> None:
        """Let nothing move the arm yet.

        Args:
            model: The arm.
            generator: Plans its motion.
            settings: How the core behaves.
        """
        self._limits = model.limits
        self._generator = generator
        self._jogging = Jogging(model, settings.servo)
        self._single = SingleTarget(model.limits, generator)
        self.active = Source.NONE
        self.execution: Execution | None = None

    @property
    def target(self) -> Array | None:
        """Where a single target takes the arm in [rad]; None without one."""
        return self._single.target

    def jog(self, command: Command, fresh_until: float) -> None:
        """Let a jog command move the arm.

        Args:
            command: The command.
            fresh_until: Steady time until which it counts in [s].
        """
        if self.active is not Source.JOG:
            self.release('jogging took over')
            self._jogging.begin()
        self.active = Source.JOG
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
        """Let a trajectory move the arm.

        Args:
            execution: Its execution.
        """
        self.release('a new trajectory took over')
        self.active, self.execution = Source.TRAJECTORY, execution

    def aim(self, target: Array, max_speed: float) -> None:
        """Let a single target move the arm.

        Args:
            target: Positions in [rad], within the limits.
            max_speed: Greatest speed of a joint in [rad/s].
        """
        if self.active is not Source.TARGET:
            self.release('a single target took over')
        self.active = Source.TARGET
        self._single.target, self._single.max_speed = frozen(target), max_speed

    def stop(self, reason: str) -> None:
        """Come to rest: a trajectory on its path, anything else in the shortest time.

        Args:
            reason: Why, for the trajectory that this ends.
        """
        if self.active is Source.TRAJECTORY and self.execution is not None:
            self.execution.stop(Outcome(GoalCode.SUCCESSFUL, reason, canceled=True))
            return
        self.release(reason)

    def release(self, reason: str) -> None:
        """Take the arm from what moves it; it comes to rest unless something else takes over.

        Args:
            reason: Why, for the trajectory that this ends.
        """
        if self.active is Source.TRAJECTORY and self.execution is not None:
            self.execution.abandon(Outcome(GoalCode.INVALID_GOAL, reason))
        self._jogging.end()
        self.active, self._single.target = Source.NONE, None

    def step(
        self,
        state: MotionState,
        measured: MotionState,
        now: float,
        period: float,
        *,
        speed_scaling: float,
        paused: bool,
    ) -> tuple[MotionState, MotionReport]:
        """Return the next state that is wanted, and what limits it.

        Args:
            state: Commanded state now.
            measured: Measured state now.
            now: Steady time in [s].
            period: Time to the next step in [s].
            speed_scaling: Share of the speed of trajectories and targets, 0 to 1.
            paused: Whether jogging comes to rest in spite of a command.
        """
        report, wanted = MotionReport(), None
        if self.active is Source.JOG:
            velocity, report = self._jogging.step(state, now, period, held=paused)
            wanted = None if velocity is None else self._toward(state, velocity, period)
        elif self.active is Source.TRAJECTORY and self.execution is not None:
            wanted = self.execution.step(state, measured, speed_scaling, period)
        elif self.active is Source.TARGET:
            wanted = self._single.step(state, speed_scaling, period)
        if wanted is None:
            wanted = self._toward(state, np.zeros(len(self._limits)), period)
        return wanted, report

    def ended(self, state: MotionState, now: float, *, paused: bool) -> Source:
        """Return what moved the arm in this cycle, and let go of what has ended.

        Args:
            state: Commanded state at the end of the cycle.
            now: Steady time in [s].
            paused: Whether jogging comes to rest in spite of a command.
        """
        source, execution = self.active, self.execution
        done = source is Source.TRAJECTORY and execution and execution.phase is Phase.DONE
        arrived = source is Source.TARGET and self._single.reached(state)
        stale = paused or self._jogging.stale(now)
        if done or arrived or (source is Source.JOG and stale and not state.moving):
            self.release('')
        return source

    def _toward(self, state: MotionState, velocity: Array, period: float) -> MotionState:
        plan = self._generator.to_velocity(state, velocity)
        if plan is None:
            return hard_brake(state, self._limits, period)
        if period >= plan.duration and not velocity.any():
            return MotionState.at_rest(plan.at(plan.duration).position)
        return plan.at(period)
