# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""One motion core: jogging, trajectories and single targets hand over to each other smoothly.

Every source starts from the commanded state, and every step passes the same filter, so a hand-over
is no event: positions, velocities and accelerations go on from where they are.

Every motion comes in by one contract: :meth:`MotionCore.prepare` plans and checks a request beside
the cycle, :meth:`MotionCore.commit` begins it in the cycle, and refuses what was prepared for
another state or before another command or stop.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import math

import numpy as np

from arm_model import Array, checked, CommandError, ModelError, Pose, RobotModel, RobotState
from arm_trajectory import GoalCode, OnlineTrajectoryGenerator, StateMovedError, TrajectoryGoal

from ..exceptions import NotReadyError
from ..jog.servo_source import Command, JointCommand
from ..report import Cause, Limiter
from .arbiter import CommandArbiter, Motion
from .commands import by_joint, duration_of, in_base, pose_command, twist_command
from .execution import Execution, Feedback
from .outcome import Outcome
from .preparation import CommandBasis, Preparation, Prepared
from .requests import DisplacementRequest, JogRequest, MotionRequest, TargetRequest
from .safety_filter import SafetyFilter
from .set_point import SetPoint, Source
from .settings import CoreSettings

PREPARED_STATE_TOLERANCE = 0.01
"""How far the arm may be from where a trajectory was prepared in [rad]."""

MAX_JOINTS = 8
"""Joints of the longest chain that is jogged."""

PAUSED = 'the arm is paused; resume first (~/resume of the trajectory controller)'


def check_arm(model: RobotModel) -> None:
    """Make sure that a model is an arm that the core can move.

    Raises:
        ModelError: It is no chain, or too long.
    """
    if not model.serial:
        raise ModelError(
            f'group {model.group}: its joints are not one chain from {model.base!r} to'
            f' {model.tip!r}; choose a group, or a tip_link, that makes them one'
        )
    if len(model) > MAX_JOINTS:
        raise ModelError(f'group {model.group}: {len(model)} joints, {MAX_JOINTS} at most')


class MotionCore:
    """Set-points for an arm, cycle by cycle.

    Times are steady times in [s] that the owner hands over; it reads no clock. All methods are for
    the thread of the cycle but :meth:`prepare`, which is for any one other thread.
    """

    def __init__(self, model: RobotModel, settings: CoreSettings | None = None) -> None:
        """Wait for :meth:`reset`.

        Args:
            model: The arm.
            settings: How the core behaves.

        Raises:
            ModelError: The core cannot move such an arm.
        """
        check_arm(model)
        self._model = model
        self._settings = settings or CoreSettings()
        generator = OnlineTrajectoryGenerator(model.limits)
        self._preparation = Preparation(model, generator, self._settings)
        self._arbiter = CommandArbiter(model, generator, self._settings)
        self._filter = SafetyFilter(model, generator)
        self._state: RobotState | None = None
        self._speed = 1.0
        self._paused = False
        self._sequence = 0
        self._last_change = ''
        self._loose = False

    @property
    def model(self) -> RobotModel:
        """The arm."""
        return self._model

    @property
    def state(self) -> RobotState:
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
        return self._arbiter.active

    @property
    def execution(self) -> Execution | None:
        """The trajectory that was followed last, with its outcome; None before the first."""
        return self._arbiter.execution

    @property
    def motion(self) -> Motion | None:
        """The trajectory or the single target that moves the arm; None without one."""
        return self._arbiter.motion

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

    @property
    def basis(self) -> CommandBasis:
        """What a motion is prepared from now.

        Raises:
            NotReadyError: The position of the arm is not known yet.
        """
        target = self._arbiter.target if self.source is Source.TARGET else None
        return CommandBasis(
            self.state,
            self._sequence,
            self.source,
            self.speed_scaling,
            None if target is None else target.target,
            self.execution,
            None if self.execution is None else self.execution.timer(self.speed_scaling),
        )

    def reset(self, positions: Sequence[float] | Array, reason: str = 'the arm was reset') -> None:
        """Begin at rest where the arm is; whatever moved it ends.

        Args:
            positions: Measured positions in [rad].
            reason: Why, for the trajectory that this ends.

        Raises:
            CommandError: The count is wrong, or a position is not finite.
        """
        where = checked(positions, len(self._model), 'positions')
        self._changed('the arm was moved by something else')
        self._arbiter.release(reason)
        self._state = RobotState.at_rest(where)
        self._filter.reset(self._state)

    def prepare(self, request: MotionRequest, basis: CommandBasis) -> Prepared:
        """Plan a request and check its path; nothing moves. For any one thread at a time.

        Args:
            request: What is asked.
            basis: The arm where the motion begins: :attr:`basis`, or foreseen from it.

        Raises:
            CommandError: The request is refused.
        """
        return self._preparation.prepare(request, basis)

    def commit(self, prepared: Prepared, elapsed: float = 0.0) -> None:
        """Begin a motion; where it is off, the arm catches up smoothly.

        Args:
            prepared: What :meth:`prepare` returned.
            elapsed: Time since its basis in [s], by which one that begins later waits less.

        Raises:
            StateMovedError: Another command or a stop came after it was prepared, or the arm is
                elsewhere than where a trajectory was: it may begin when it is prepared again.
            CommandError: The arm is paused, and a single target would begin later, by surprise.
            NotReadyError: The position of the arm is not known yet.
        """
        state, motion = self.state, prepared.motion
        if motion is None:
            return
        if prepared.basis.sequence != self._sequence:
            raise StateMovedError(
                GoalCode.INVALID_GOAL,
                f'{self._last_change} before this command had begun; send it again',
            )
        if isinstance(motion, Execution):
            self._check_place(prepared.basis.state, state)
            self._changed('another command came')
            motion.elapse(elapsed)
            self._arbiter.follow(motion)
        else:
            self._check_held()
            self._changed('another command came')
            self._arbiter.aim(motion)

    def ignores(self, request: JogRequest) -> bool:
        """Whether a jog asks for standing still, and its client is not jogging."""
        jogs = self.source is Source.JOG and self._arbiter.jogger == request.client
        return request.is_zero and not jogs

    def commit_jog(self, request: JogRequest, now: float) -> None:
        """Jog from now on; there is nothing to prepare, the safety filter sees every step.

        Args:
            request: What is asked.
            now: Steady time in [s].

        Raises:
            CommandError: The arm is paused.
            NotReadyError: The request has expired, or the position of the arm is not known yet.
        """
        state = self.state
        if self.ignores(request):
            return
        if now > request.expires:
            raise NotReadyError(
                f'expired {now - request.expires:.2f} s before the cycle; send commands more'
                ' often than they expire (incoming_command_timeout)'
            )
        if self._paused:
            raise CommandError(PAUSED)
        command = in_base(self._model, state.position, request)
        if not request.is_zero:  # that ends the jog, and no other command
            self._changed('a jog took over')
        self._arbiter.jog(command, request.expires, request.client)

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
        basis = self.basis
        execution = self._preparation.trajectory(goal, basis)
        self.commit(Prepared(execution, basis))
        return execution

    def move_to(self, positions: Mapping[str, float], max_speed: float = math.inf) -> None:
        """Move joints to positions in the shortest time, and rest there.

        Args:
            positions: Targets in [rad] by joint; the others come to rest.
            max_speed: Greatest speed of a joint in [rad/s].

        Raises:
            CommandError: A joint is unknown, a number is not finite or beyond a limit, or links
                meet on the way.
            NotReadyError: The position of the arm is not known yet.
        """
        self.commit(self.prepare(TargetRequest(positions, max_speed), self.basis))

    def move_by(self, displacements: Mapping[str, float], max_speed: float = math.inf) -> None:
        """Move joints on by amounts, and rest there; they add up while they are carried out.

        Args:
            displacements: How far in [rad] by joint.
            max_speed: Greatest speed of a joint in [rad/s].

        Raises:
            CommandError: A joint is unknown, the end is not finite or beyond a limit, or links
                meet on the way.
            NotReadyError: The position of the arm is not known yet.
        """
        self.commit(self.prepare(DisplacementRequest(displacements, max_speed), self.basis))

    def stop(self, reason: str = 'stopped') -> None:
        """Come to rest: a trajectory on its path, anything else in the shortest time.

        Args:
            reason: Why, for the motion that this ends.
        """
        self._stop(Outcome(GoalCode.SUCCESSFUL, reason, canceled=True))

    def fail(self, reason: str, code: GoalCode = GoalCode.INVALID_GOAL) -> None:
        """Come to rest as by :meth:`stop`, because something has gone wrong.

        Args:
            reason: What, for the motion that this ends.
            code: Code of its outcome.
        """
        self._stop(Outcome(code, reason))

    def abandon(self, reason: str) -> None:
        """End at once what moves the arm, which does not follow any more.

        Args:
            reason: Why, for the motion that this ends.
        """
        if self.source is not Source.NONE:
            self._changed('the arm did not follow')
            self._arbiter.release(reason)

    def pause(self) -> None:
        """Come to rest, a trajectory on its path; jogging is refused until :meth:`resume`."""
        self._changed('the arm was paused')
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

    def step(self, now: float, period: float, measured: RobotState | None = None) -> SetPoint:
        """Return the set-point of a cycle.

        Args:
            now: Steady time in [s].
            period: Time to the next cycle in [s].
            measured: Measured state; by default what was commanded.

        Raises:
            NotReadyError: The position of the arm is not known yet.
        """
        state = self.state
        wanted, report = self._arbiter.step(
            state,
            measured or state,
            now,
            period,
            speed_scaling=self.speed_scaling,
            paused=self._paused,
        )
        after, limiter = self._filter.step(state, wanted, period, self._clearance(state))
        self._state = after
        if limiter is not None:
            report = report.with_limiter(limiter)
            self._give_up(limiter, is_at_rest=not (state.moving or after.moving))
        source = self._arbiter.ended(after, now, paused=self._paused)
        return SetPoint(after, source, report)

    @property
    def speed_scaling(self) -> float:
        """Speed override that counts, 0 to 1: none while it is paused."""
        return 0.0 if self._paused else self._speed

    def _clearance(self, state: RobotState) -> float | None:
        """Return the distance that links must keep on a stop in [m].

        None for what is on a path that was checked: a stop stays on it.
        """
        jogged = self.source in {Source.JOG, Source.NONE}
        self._loose = jogged or (self._loose and state.moving and self._arbiter.brakes)
        if self._loose:
            return self._settings.clearance
        if self._arbiter.on_path or not self._settings.check_self_collision:
            return None
        return 0.0

    def _give_up(self, limiter: Limiter, *, is_at_rest: bool) -> None:
        """End a motion that the safety filter does not let go on; the arm comes to rest."""
        is_target, code = self.source is Source.TARGET, GoalCode.PATH_TOLERANCE_VIOLATED
        if limiter.cause is Cause.COLLISION:
            where = (
                'on the way to the target from where the arm is; go around that'
                if is_target
                else 'while the arm catches up with the path; begin at rest, or give the first'
                ' point more time'
            )
            self._arbiter.end(Outcome(code, f'{limiter.name} would collide {where}'))
        elif is_target and is_at_rest:
            self._arbiter.end(Outcome(code, f'no way to the target from here: {limiter}'))

    def _stop(self, outcome: Outcome) -> None:
        self._changed('the arm was stopped')
        self._arbiter.stop(outcome)

    def _check_held(self) -> None:
        """Refuse what would wait, and begin when nobody expects it any more."""
        if self._paused:
            raise CommandError(PAUSED)
        if self._speed == 0.0:
            raise CommandError('the speed override is 0; raise it first (~/speed_scaling_input)')

    def _changed(self, what: str) -> None:
        """Count a command or a stop: what was prepared before it is void."""
        self._sequence += 1
        self._last_change = what

    def _check_place(self, planned: RobotState, state: RobotState) -> None:
        """Make sure that the arm is where a trajectory was prepared; else its way is another."""
        off = np.abs(state.position - planned.position)
        joint = int(np.argmax(off))
        if off[joint] > PREPARED_STATE_TOLERANCE:
            raise StateMovedError(
                GoalCode.INVALID_GOAL,
                f'{self._model.joints[joint]} was moved by {off[joint]:.3f} rad while the'
                ' trajectory was planned, and its path was checked from there only; send it'
                ' again, or end what moves the arm first',
            )

    def _jog(self, command: Command, now: float, duration: float | None) -> None:
        counts = duration_of(duration, self._settings.timeout)
        self.commit_jog(JogRequest(command, now + counts), now)
