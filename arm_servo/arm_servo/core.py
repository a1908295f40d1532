# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""One motion core: jogging, trajectories and single targets hand over to each other smoothly.

Every source starts from the commanded state, and every step passes the same gate, so a hand-over
is no event: positions, velocities and accelerations go on from where they are.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from .arrays import Array, checked, frozen
from .commands import by_joint, duration_of, pose_command, twist_command
from .exceptions import CommandError, GoalCode, NotReadyError
from .execution import Execution, ExecutionSettings, Feedback, Outcome, Phase
from .goal import TrajectoryGoal
from .guard import Guard
from .jogging import Jogging
from .model import Pose, RobotModel
from .otg import Generator, hard_brake, MotionState
from .report import Limiter, MotionReport
from .servo import Command, JointCommand, ServoSettings
from .single_target import SingleTarget


class Source(Enum):
    """What moves the arm."""

    NONE = 'none'
    JOG = 'jog'
    TRAJECTORY = 'trajectory'
    TARGET = 'target'


@dataclass(frozen=True, slots=True)
class CoreSettings:
    """How the core behaves.

    Attributes:
        servo: How jogging behaves.
        execution: How trajectories are followed.
        timeout: Time without a fresh jog command after which the arm comes to rest in [s].
        clearance: Least distance between links that a stop may end at in [m].
    """

    servo: ServoSettings = field(default_factory=ServoSettings)
    execution: ExecutionSettings = field(default_factory=ExecutionSettings)
    timeout: float = 0.1
    clearance: float = 0.005


@dataclass(frozen=True, slots=True, eq=False)
class SetPoint:
    """What to command in a cycle.

    Attributes:
        state: Positions, velocities and accelerations.
        source: What moves the arm.
        report: What limits the motion.
    """

    state: MotionState
    source: Source
    report: MotionReport


class MotionCore:
    """Set-points for an arm, cycle by cycle.

    It reads no clock: times are steady times in [s] that its owner hands over. Commands and
    :meth:`step` are for one thread.
    """

    def __init__(self, model: RobotModel, settings: CoreSettings | None = None) -> None:
        """Wait for :meth:`reset`.

        Args:
            model: The arm.
            settings: How the core behaves.
        """
        self._model = model
        self._limits = model.limits
        self._settings = settings or CoreSettings()
        self._generator = Generator(model.limits)
        self._jogging = Jogging(model, self._settings.servo)
        self._single = SingleTarget(model.limits, self._generator)
        self._guard = Guard(model, self._generator, self._settings.clearance)
        self._state: MotionState | None = None
        self._source = Source.NONE
        self._execution: Execution | None = None
        self._speed = 1.0
        self._paused = False

    @property
    def model(self) -> RobotModel:
        """The arm."""
        return self._model

    @property
    def state(self) -> MotionState:
        """The commanded state.

        Raises:
            NotReadyError: The position of the arm is not known yet.
        """
        if self._state is None:
            raise NotReadyError('the position of the arm is not known yet; wait for joint states')
        return self._state

    @property
    def source(self) -> Source:
        """What moves the arm."""
        return self._source

    @property
    def execution(self) -> Execution | None:
        """The trajectory that was followed last, with its outcome; None before the first."""
        return self._execution

    @property
    def feedback(self) -> Feedback | None:
        """Where the trajectory is; None without one."""
        return None if self._execution is None else self._execution.feedback

    @property
    def speed(self) -> float:
        """Speed override of trajectories and targets, 0 to 1."""
        return self._speed

    @property
    def paused(self) -> bool:
        """Whether it is paused."""
        return self._paused

    def reset(self, positions: Sequence[float] | Array, reason: str = 'the arm was reset') -> None:
        """Begin at rest where the arm is; whatever moved it ends.

        Args:
            positions: Measured positions in [rad].
            reason: Why, for the trajectory that this ends.

        Raises:
            CommandError: The count is wrong, or a position is not finite.
        """
        where = checked(positions, len(self._model), 'positions')
        self._release(reason)
        self._state = MotionState.at_rest(where)
        self._guard.reset(self._state)

    def twist(
        self,
        twist: Sequence[float] | Array,
        now: float,
        *,
        link: str | None = None,
        axes: Array | None = None,
        duration: float | None = None,
    ) -> None:
        """Move the tool at a speed.

        Args:
            twist: Linear [m/s], then angular [rad/s] (6).
            now: Steady time in [s].
            link: Link along whose axes the twist is given; the base when None.
            axes: Rotation (3, 3) from other axes to the base, in place of a link.
            duration: How long it counts in [s]; by default the time-out.

        Raises:
            CommandError: A number is not finite, the count is wrong, the link is unknown, or the
                axes are no rotation.
            NotReadyError: The position of the arm is not known yet.
        """
        self._jog(twist_command(self._model, twist, link, axes), now, duration)

    def jog(
        self, velocities: Mapping[str, float], now: float, duration: float | None = None
    ) -> None:
        """Move joints at speeds; the others are held.

        Args:
            velocities: Speeds in [rad/s] by joint.
            now: Steady time in [s].
            duration: How long it counts in [s]; by default the time-out.

        Raises:
            CommandError: A joint is unknown, or a number is not finite.
            NotReadyError: The position of the arm is not known yet.
        """
        values, commanded = by_joint(self._model, velocities, 'velocities')
        self._jog(JointCommand(values, commanded), now, duration)

    def track(self, pose: Pose, now: float, duration: float | None = None) -> None:
        """Go to a pose, and track it when it moves.

        Args:
            pose: Pose of the tip in the base.
            now: Steady time in [s].
            duration: How long it counts in [s]; by default the time-out.

        Raises:
            CommandError: A number is not finite, or the rotation is none.
            NotReadyError: The position of the arm is not known yet.
        """
        self._jog(pose_command(pose), now, duration)

    def follow(self, goal: TrajectoryGoal) -> Execution:
        """Follow a trajectory, from the commanded state on.

        Args:
            goal: The trajectory.

        Returns:
            Its execution, which says where it is and how it ends.

        Raises:
            GoalError: It is refused; what moves the arm goes on.
            NotReadyError: The position of the arm is not known yet.
        """
        execution = self.plan(goal, self.state)
        self.begin(execution)
        return execution

    def plan(self, goal: TrajectoryGoal, state: MotionState) -> Execution:
        """Check a trajectory and plan its execution, which takes 0.4 ms a point; for any thread.

        Args:
            goal: The trajectory.
            state: The commanded state at which it will begin.

        Raises:
            GoalError: It is refused.
        """
        return Execution(
            goal,
            limits=self._limits,
            generator=self._generator,
            state=state,
            pace=self._pace,
            settings=self._settings.execution,
        )

    def begin(self, execution: Execution) -> None:
        """Follow a trajectory that was planned; where it is off, the arm catches up smoothly.

        Args:
            execution: What :meth:`plan` returned.

        Raises:
            NotReadyError: The position of the arm is not known yet.
        """
        _ = self.state
        self._release('a new trajectory took over')
        self._source, self._execution = Source.TRAJECTORY, execution

    def move_to(self, positions: Mapping[str, float]) -> None:
        """Move joints to positions in the shortest time, and rest there.

        Args:
            positions: Targets in [rad] by joint; the others come to rest.

        Raises:
            CommandError: A joint is unknown, or a number is not finite or beyond a limit.
            NotReadyError: The position of the arm is not known yet.
        """
        values, moved = by_joint(self._model, positions, 'positions')
        rest, limits = self._generator.brake(self.state), self._limits
        stay = self.state.position if rest is None else rest.at(rest.duration).position
        # where a joint comes to rest was not asked for: it need not be refused
        self._aim(np.where(moved, values, np.clip(stay, limits.lower, limits.upper)))

    def nudge(self, displacements: Mapping[str, float]) -> None:
        """Move joints on by amounts, and rest there; nudges add up while they are carried out.

        Args:
            displacements: How far in [rad] by joint.

        Raises:
            CommandError: A joint is unknown, or the end is not finite or beyond a limit.
            NotReadyError: The position of the arm is not known yet.
        """
        values, moved = by_joint(self._model, displacements, 'displacements')
        pending = self._single.target
        if pending is not None:
            self._aim(pending + values)  # what other nudges are on their way to stays
            return
        ends, names = self.state.position + values, self._limits.names
        self.move_to({names[place]: float(ends[place]) for place in np.flatnonzero(moved)})

    def stop(self, reason: str = 'stopped') -> None:
        """Come to rest: a trajectory on its path, anything else in the shortest time.

        Args:
            reason: Why, for the trajectory that this ends.
        """
        if self._source is Source.TRAJECTORY and self._execution is not None:
            self._execution.stop(Outcome(GoalCode.SUCCESSFUL, reason, canceled=True))
            return
        self._release(reason)

    def pause(self) -> None:
        """Come to rest, a trajectory on its path; jogging is refused until :meth:`resume`."""
        self._paused = True

    def resume(self) -> None:
        """Go on after a pause."""
        self._paused = False

    def override(self, speed: float) -> None:
        """Set the speed of trajectories and targets.

        Args:
            speed: 0 to 1; 0 is a pause.

        Raises:
            CommandError: It is not between 0 and 1.
        """
        if not 0.0 <= speed <= 1.0:
            raise CommandError(f'speed override {speed}: it must be between 0 and 1')
        self._speed = speed

    def step(self, now: float, period: float, measured: MotionState | None = None) -> SetPoint:
        """Return the set-point of a cycle.

        Args:
            now: Steady time in [s].
            period: Time to the next cycle in [s].
            measured: Measured state; by default what was commanded.

        Raises:
            NotReadyError: The position of the arm is not known yet.
        """
        state = self.state
        wanted, report = self._wanted(state, measured or state, now, period)
        jogging = self._source is Source.JOG
        if wanted is None:
            wanted = self._toward(state, np.zeros(len(self._limits)), period)
        after, limiter = self._guard.step(state, wanted, period, clearances=jogging)
        self._state = after
        return SetPoint(after, self._ended(after, now), _with(report, limiter))

    @property
    def _pace(self) -> float:
        return 0.0 if self._paused else self._speed

    def _jog(self, command: Command, now: float, duration: float | None) -> None:
        _ = self.state
        counts = duration_of(duration, self._settings.timeout)
        if self._paused:
            raise CommandError('jogging is paused; resume first')
        if self._source is not Source.JOG:
            self._release('jogging took over')
            self._jogging.begin()
        self._source = Source.JOG
        self._jogging.take(command, now + counts)

    def _aim(self, target: Array) -> None:
        self._single.check(target)
        if self._source is not Source.TARGET:
            self._release('a single target took over')
        self._source, self._single.target = Source.TARGET, frozen(target)

    def _release(self, reason: str) -> None:
        """Take the arm from what moves it; it comes to rest unless something else takes over."""
        if self._source is Source.TRAJECTORY and self._execution is not None:
            self._execution.abandon(Outcome(GoalCode.INVALID_GOAL, reason))
        self._jogging.end()
        self._source, self._single.target = Source.NONE, None

    def _wanted(
        self, state: MotionState, measured: MotionState, now: float, period: float
    ) -> tuple[MotionState | None, MotionReport]:
        """Return the next state that the source wants; None to come to rest."""
        if self._source is Source.JOG:
            velocity, report = self._jogging.step(state, now, period, held=self._paused)
            return (None if velocity is None else self._toward(state, velocity, period)), report
        if self._source is Source.TRAJECTORY and self._execution is not None:
            return self._execution.step(state, measured, self._pace, period), MotionReport()
        if self._source is Source.TARGET:
            return self._single.step(state, self._pace, period), MotionReport()
        return None, MotionReport()

    def _toward(self, state: MotionState, velocity: Array, period: float) -> MotionState:
        plan = self._generator.to_velocity(state, velocity)
        if plan is None:
            return hard_brake(state, self._limits, period)
        if period >= plan.duration and not velocity.any():
            return MotionState.at_rest(plan.at(plan.duration).position)
        return plan.at(period)

    def _ended(self, state: MotionState, now: float) -> Source:
        """Return what moved the arm in this cycle, and let go of what has ended."""
        source, execution = self._source, self._execution
        done = source is Source.TRAJECTORY and execution and execution.phase is Phase.DONE
        arrived = source is Source.TARGET and self._single.reached(state)
        stale = self._paused or self._jogging.stale(now)
        if done or arrived or (source is Source.JOG and stale and not state.moving):
            self._release('')
        return source


def _with(report: MotionReport, limiter: Limiter | None) -> MotionReport:
    if limiter is None:
        return report
    return MotionReport(min(report.factor, limiter.factor), (*report.limiters, limiter))
