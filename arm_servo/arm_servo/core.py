# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""One motion core: jogging, trajectories and single targets hand over to each other smoothly.

Every source starts from the commanded state, and every step passes the same gate, so a hand-over
is no event: positions, velocities and accelerations go on from where they are.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import math

import numpy as np

from .arrays import Array, checked
from .commands import by_joint, duration_of, pose_command, twist_command
from .core_settings import CoreSettings
from .exceptions import CommandError, NotReadyError
from .execution import Execution, Feedback
from .goal import TrajectoryGoal
from .guard import Guard
from .model import Pose, RobotModel
from .otg import Generator, MotionState
from .planning import Planning, Way
from .report import Limiter, MotionReport
from .servo import Command, JointCommand
from .set_point import SetPoint, Source
from .sources import Sources


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
        self._planning = Planning(model, self._generator, self._settings)
        self._sources = Sources(model, self._generator, self._settings)
        self._guard = Guard(model, self._generator, self._settings.clearance)
        self._state: MotionState | None = None
        self._speed = 1.0
        self._paused = False
        self._turn = 0
        self._loose = False

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
        return self._sources.active

    @property
    def execution(self) -> Execution | None:
        """The trajectory that was followed last, with its outcome; None before the first."""
        return self._sources.execution

    @property
    def feedback(self) -> Feedback | None:
        """Where the trajectory is; None without one."""
        return None if self.execution is None else self.execution.feedback

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
        self._turn += 1
        self._sources.release(reason)
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
        """Check a trajectory and plan its execution, see :class:`Planning`.

        For any one thread at a time: only the execution's steps use what belongs to the cycle.

        Args:
            goal: The trajectory.
            state: The commanded state at which it will begin.

        Raises:
            GoalError: It is refused.
        """
        return self._planning.execution(goal, state, self._pace)

    def begin(self, execution: Execution) -> None:
        """Follow a trajectory that was planned; where it is off, the arm catches up smoothly.

        Args:
            execution: What :meth:`plan` returned.

        Raises:
            NotReadyError: The position of the arm is not known yet.
        """
        _ = self.state
        self._turn += 1
        self._sources.follow(execution)

    def move_to(self, positions: Mapping[str, float], fastest: float = math.inf) -> None:
        """Move joints to positions in the shortest time, and rest there.

        Args:
            positions: Targets in [rad] by joint; the others come to rest.
            fastest: Greatest speed of a joint in [rad/s].

        Raises:
            CommandError: A joint is unknown, a number is not finite or beyond a limit, or links
                meet on the way.
            NotReadyError: The position of the arm is not known yet.
        """
        way = self.way_to(positions, fastest)
        self.check(way)
        self.go(way)

    def nudge(self, displacements: Mapping[str, float], fastest: float = math.inf) -> None:
        """Move joints on by amounts, and rest there; nudges add up while they are carried out.

        Args:
            displacements: How far in [rad] by joint.
            fastest: Greatest speed of a joint in [rad/s].

        Raises:
            CommandError: A joint is unknown, the end is not finite or beyond a limit, or links
                meet on the way.
            NotReadyError: The position of the arm is not known yet.
        """
        way = self.way_by(displacements, fastest)
        self.check(way)
        self.go(way)

    def way_to(self, positions: Mapping[str, float], fastest: float = math.inf) -> Way:
        """Return the way of :meth:`move_to`, for :meth:`check` and :meth:`go`; nothing moves."""
        values, moved = by_joint(self._model, positions, 'positions')
        rest, limits = self._generator.brake(self.state), self._limits
        stay = self.state.position if rest is None else rest.at(rest.duration).position
        # where a joint comes to rest was not asked for: it need not be refused
        target = np.where(moved, values, np.clip(stay, limits.lower, limits.upper))
        return self._way(target, fastest)

    def way_by(self, displacements: Mapping[str, float], fastest: float = math.inf) -> Way:
        """Return the way of :meth:`nudge`, for :meth:`check` and :meth:`go`; nothing moves."""
        values, moved = by_joint(self._model, displacements, 'displacements')
        pending = self._sources.target
        if pending is not None:
            return self._way(
                pending + values, fastest
            )  # what other nudges are on their way to stays
        ends, names = self.state.position + values, self._limits.names
        asked = {names[place]: float(ends[place]) for place in np.flatnonzero(moved)}
        return self.way_to(asked, fastest)

    def check(self, way: Way) -> None:
        """Look for collisions on a way, see :class:`Planning`; for any one thread.

        Args:
            way: The way.

        Raises:
            CommandError: Links meet on it.
        """
        self._planning.check(way)

    def go(self, way: Way) -> None:
        """Go a way that was checked.

        Args:
            way: What :meth:`way_to` or :meth:`way_by` returned.

        Raises:
            CommandError: Another command came in between.
        """
        if way.turn != self._turn:
            raise CommandError('another command came before this one had begun; give it again')
        self._sources.aim(way.target, way.fastest)

    def stop(self, reason: str = 'stopped') -> None:
        """Come to rest: a trajectory on its path, anything else in the shortest time.

        Args:
            reason: Why, for the trajectory that this ends.
        """
        self._turn += 1
        self._sources.stop(reason)

    def pause(self) -> None:
        """Come to rest, a trajectory on its path; jogging is refused until :meth:`resume`."""
        self._turn += 1
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
        wanted, report = self._sources.step(
            state, measured or state, now, period, pace=self._pace, paused=self._paused
        )
        # the ways of trajectories and targets were looked at; but not from out of a jog
        self._loose = self._sources.active in {Source.JOG, Source.NONE} or (
            self._loose and state.moving and self._sources.brakes
        )
        after, limiter = self._guard.step(state, wanted, period, clearances=self._loose)
        self._state = after
        source = self._sources.ended(after, now, paused=self._paused)
        return SetPoint(after, source, _with(report, limiter))

    @property
    def _pace(self) -> float:
        return 0.0 if self._paused else self._speed

    def _jog(self, command: Command, now: float, duration: float | None) -> None:
        _ = self.state
        counts = duration_of(duration, self._settings.timeout)
        if self._paused:
            raise CommandError(
                'the arm is paused; resume first (~/resume of the trajectory controller)'
            )
        self._turn += 1
        self._sources.jog(command, now + counts)

    def _way(self, target: Array, fastest: float) -> Way:
        if not fastest > 0.0:
            raise CommandError(f'greatest speed of a joint {fastest} rad/s: it must be above 0')
        self._sources.check_target(target)
        return Way(self.state, target, fastest, self._turn)


def _with(report: MotionReport, limiter: Limiter | None) -> MotionReport:
    if limiter is None:
        return report
    return MotionReport(min(report.factor, limiter.factor), (*report.limiters, limiter))
