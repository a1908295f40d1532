# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The motion core: smooth hand-over between jogging, trajectories and single targets.

Every source starts from the commanded state, and every step passes the same filter, so positions,
velocities and accelerations are continuous at each hand-over.

:meth:`MotionCore.apply` applies a jog, a stop, a pause or a speed at once. A motion is planned
outside the cycle by :meth:`MotionCore.plan`; :meth:`MotionCore.begin` starts it in the cycle. It
refuses a motion planned for another state, or before a later command or stop.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from arm_model import (
    Array,
    checked,
    Clearances,
    CommandError,
    frozen,
    ModelError,
    PlanningScene,
    RobotModel,
    RobotState,
)
from arm_trajectory import GoalCode, OnlineTrajectoryGenerator, PathCheck, StateMovedError

from ..controllers.controller import (
    ArmState,
    Cause,
    CONTINUED,
    Controller,
    Limiter,
    MotionReport,
    NotReadyError,
    Outcome,
    SetPoint,
    SingleTarget,
    Source,
)
from ..controllers.jog import Jog
from ..controllers.trajectory import Execution
from .preparation import CommandBasis, CoreSettings, Motion, Preparation, PreparedScene
from .requests import (
    by_joint,
    check_limits,
    check_request,
    DisplacementRequest,
    ImmediateRequest,
    in_base,
    JogRequest,
    MotionRequest,
    moves_nothing,
    PauseRequest,
    StopRequest,
)
from .safety_filter import Neighbours, SafetyFilter

PREPARED_STATE_TOLERANCE = 0.01
"""Greatest distance in [rad] of the arm from the state for which a trajectory was planned."""

ARM_DISTANCE = 0.005  # least distance to another arm that moves, for what is no jog, in [m]

UNCHECKED_CLEARANCE = 0.001
"""Least distance in [m] between links on a path not yet checked in a new scene: an arm stopped
there is not in contact and can move away. Planned paths keep the same distance."""

MAX_JOINTS = 8  # joints of the longest chain that is jogged

PAUSED = 'the arm is paused; resume first (~/resume of the trajectory controller)'


def check_arm(model: RobotModel) -> None:
    """Check that the core can move the arm of a model.

    Raises:
        ModelError: The joints form no chain, or there are too many.
    """
    if not model.serial:
        raise ModelError(
            f'group {model.group}: its joints are not one chain from {model.base!r} to'
            f' {model.tip!r}; choose a group, or a tip_link, that makes them one'
        )
    if len(model) > MAX_JOINTS:
        raise ModelError(f'group {model.group}: {len(model)} joints, {MAX_JOINTS} at most')


class MotionCore:
    """Computes the set-points of an arm cycle by cycle; one controller at a time moves it.

    The caller passes steady times in [s]; the core reads no clock. Call all methods in the thread
    of the cycle, except :meth:`plan` (one other thread at a time), :meth:`prepare_scene` and
    :meth:`check_displacement` (any thread).

    Attributes:
        model: The arm.
        scene: The objects and link pairs that may collide.
        execution: The last trajectory executed, with its outcome; None before the first.
        speed: Speed override of trajectories and targets, 0 to 1.
        paused: Whether the arm is paused.
    """

    def __init__(self, model: RobotModel, settings: CoreSettings | None = None) -> None:
        """Create a core that accepts no commands before :meth:`reset`.

        Raises:
            ModelError: The core cannot move this arm.
        """
        check_arm(model)
        self.model = model
        self.speed = 1.0
        self.paused = False
        self.execution: Execution | None = None
        self._settings = settings or CoreSettings()
        self._generator = generator = OnlineTrajectoryGenerator(model.limits)
        self._preparation = Preparation(model, generator, self._settings)
        self._filter = SafetyFilter(model, generator)
        self._jog = Jog(model, generator, self._settings.servo)
        self._active: Controller | None = None
        self._held = False  # whether a jog or a target comes to rest for what is prepared
        self._jogged = False  # whether the arm moves because of a jog, or out of one
        self._unchecked: Execution | None = None  # path not yet checked in the present scene
        self._state: RobotState | None = None
        self._rested: SetPoint | None = None  # set-point at rest, until something moves the arm
        self._still = frozen(np.zeros(len(model)))
        self._sequence = 0
        self._last_change = ''
        self.scene = self.prepare_scene(model.scene)

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
        """The source that moves the arm."""
        return Source.NONE if self._active is None else self._active.source

    @property
    def speed_scaling(self) -> float:
        """Effective speed override, 0 to 1; 0 while paused."""
        return 0.0 if self.paused else self.speed

    @property
    def basis(self) -> CommandBasis:
        """The basis for preparing a motion now.

        Raises:
            NotReadyError: The position of the arm is not known yet.
        """
        is_at_rest = self._held and not self.state.moving
        active = None if is_at_rest else self._active
        return CommandBasis(
            self.state,
            self.scene,
            self._sequence,
            Source.NONE if active is None else active.source,
            self.speed_scaling,
            active.target if isinstance(active, SingleTarget) else None,
            self.execution,
            None if self.execution is None else self.execution.timer(self.speed_scaling),
        )

    def reset(self, positions: Sequence[float] | Array, reason: str = 'the arm was reset') -> None:
        """Restart at rest at the given positions; end any motion.

        Raises:
            CommandError: The number of positions is wrong, or one is not finite.
        """
        where = checked(positions, len(self.model), 'positions')
        self._changed('the arm was moved by something else')
        self._release(reason)
        self._state, self._rested = RobotState.at_rest(where), None
        self._filter.reset(self._state)

    def keep_apart(self, neighbours: Neighbours) -> None:
        """Keep clear of other arms of the robot; call before the first step."""
        self._filter.keep_apart(neighbours)

    def prepare_scene(self, scene: PlanningScene, near: Array | None = None) -> PreparedScene:
        """Prepare a scene for distance measurement, outside the cycle.

        Args:
            near: Position of the arm in [rad]; None while unknown.

        Raises:
            SceneError: The scene belongs to another arm.
        """
        self.model.check_scene(scene)
        clearances = Clearances(scene)
        if near is not None:  # all pairs are measured, so that the cycle has not to
            clearances.least(near, 0.0)
        return PreparedScene(
            clearances, PathCheck(scene) if self._settings.check_self_collision else None
        )

    def use_scene(self, scene: PreparedScene) -> Execution | None:
        """Switch to another scene for jogs, targets and trajectories.

        Returns:
            The running trajectory, whose path must be checked again outside the cycle; see
            :meth:`conclude_check`. Until then the safety filter prevents contact. None if there is
            nothing to check.
        """
        self.model.use_scene(scene.clearances)
        self.scene = scene
        self._filter.forget()
        is_checked = self.source is Source.TRAJECTORY and scene.check is not None
        self._unchecked = self.execution if is_checked else None
        return self._unchecked

    def conclude_check(self, execution: Execution, scene: PreparedScene, problem: str) -> None:
        """Continue a trajectory whose path is clear in a scene; else stop it on its path.

        Args:
            scene: The checked scene; if it is no longer in use, the call has no effect.
        """
        if scene is not self.scene or execution is not self._unchecked:
            return
        if not problem:
            self._unchecked = None
        elif self._active is execution and execution.ending is None:
            self._end(Outcome(GoalCode.PATH_TOLERANCE_VIOLATED, problem))

    def hold(self, *, is_held: bool = True) -> None:
        """Hold a jog or a single target at rest while a motion is prepared, or resume it."""
        self._held = is_held

    def plan(self, request: MotionRequest, basis: CommandBasis) -> Motion:
        """Plan a motion and check its path, without moving. Call in one thread at a time.

        Args:
            basis: State from which the motion starts: :attr:`basis`, or a prediction from it.

        Raises:
            CommandError: The request is refused.
        """
        return self._preparation.prepare(request, basis)

    def check_displacement(self, request: DisplacementRequest, rest: RobotState | None) -> None:
        """Check that a displacement stays within the joint limits. Thread-safe.

        Args:
            rest: Where the arm stands while it does not follow; None while it follows.

        Raises:
            CommandError: The displacement exceeds the limits.
        """
        values, moved = by_joint(self.model, request.displacements, 'displacements')
        active, limits = self._active, self.model.limits
        if rest is not None:
            begin = rest.position
        else:
            begin = active.target if isinstance(active, SingleTarget) else self.state.position
        # check the moved joints only, as in planning
        check_limits(
            limits, np.where(moved, begin + values, np.clip(begin, limits.lower, limits.upper))
        )

    def begin(
        self,
        motion: Motion,
        basis: CommandBasis,
        elapsed: float = 0.0,
        *,
        in_any_scene: bool = False,
    ) -> None:
        """Start a motion; if the arm is off its path, the arm catches up smoothly.

        Args:
            basis: The basis from which the motion was planned.
            elapsed: Time since then in [s]; shortens the wait before a delayed start.
            in_any_scene: Whether to start a motion planned in an outdated scene, too. The caller
                must then check a trajectory's path again, as after :meth:`use_scene`.

        Raises:
            StateMovedError: Another command or a stop came after planning, or the arm has moved
                away from the state a trajectory was planned for; it may start if planned again.
            CommandError: The arm is paused, and a single target would start later by surprise.
            NotReadyError: The position of the arm is not known yet.
        """
        if basis.sequence != self._sequence:
            raise StateMovedError(
                GoalCode.INVALID_GOAL,
                f'{self._last_change} before this command had begun; send it again',
            )
        is_old = basis.scene is not self.scene
        if is_old and not in_any_scene:
            raise StateMovedError(
                GoalCode.INVALID_GOAL,
                'the scene changed while this motion was prepared; send it again',
            )
        if isinstance(motion, Execution):
            self._check_place(basis.state, self.state)
            motion.elapse(elapsed)
            self._release('a new trajectory took over')
            self.execution = motion
            self._unchecked = motion if is_old and self.scene.check is not None else None
        else:
            self._check_held()
            if isinstance(self._active, SingleTarget):  # what was asked before is in this one
                self._active.end(CONTINUED)
            self._release('a single target took over')
        self._changed('another command came')
        self._active = motion

    def apply(self, request: ImmediateRequest, now: float) -> None:
        """Apply at once a request that :func:`.check_request` has accepted.

        Raises:
            CommandError: The arm is paused, and a jog would start later by surprise.
            NotReadyError: A jog has expired, or the position of the arm is not known yet.
        """
        if isinstance(request, JogRequest):
            self._begin_jog(request, now)
        elif isinstance(request, StopRequest):
            self._stop(request)
        elif isinstance(request, PauseRequest):
            if request.is_paused:
                self._changed('the arm was paused')
            self.paused = request.is_paused
        else:
            self.speed = request.speed

    def command(
        self, request: MotionRequest | ImmediateRequest, now: float = 0.0
    ) -> Motion | None:
        """Check and execute a request in a loop that plans motions in its own thread.

        Returns:
            The motion that has started; None for immediate requests.

        Raises:
            CommandError: The request is refused; see also :meth:`apply`.
            NotReadyError: The position is not known yet; see also :meth:`apply`.
        """
        basis = self.basis
        if isinstance(request, ImmediateRequest):
            check_request(self.model, request)
            self.apply(request, now)
            return None
        if moves_nothing(self.model, request):
            return None
        motion = self.plan(request, basis)
        self.begin(motion, basis)
        return motion

    def fail(self, reason: str, code: GoalCode = GoalCode.INVALID_GOAL) -> None:
        """Bring the arm to rest after an error, a trajectory on its path."""
        self._end(Outcome(code, reason))

    def abandon(self, reason: str, measured: RobotState | None) -> None:
        """End any motion because something else commands the drives, and report it to other arms.

        Args:
            measured: Measured state of the drives; None while unknown.
        """
        self._filter.stands(measured)
        if self.source is not Source.NONE:
            self._changed('the arm did not follow')
            self._release(reason)

    def step(self, now: float, period: float, measured: RobotState | None = None) -> SetPoint:
        """Return the set-point of a cycle.

        Args:
            measured: Measured state; by default the commanded state.

        Raises:
            NotReadyError: The position of the arm is not known yet.
        """
        state, active = self.state, self._active
        if active is None and self._rested is not None:
            return self._rested
        arm = ArmState(state, measured or state, now, self.speed_scaling, self.paused, self._held)
        wanted = None if active is None else active.update(arm, period)
        report = MotionReport() if active is None else active.report
        if wanted is None:
            wanted = self._generator.step(state, self._still, period)
        if active is None or active is self._jog:
            self._jogged = True
        else:  # a jog counts until the arm rests after it
            self._jogged = self._jogged and state.moving and active.brakes
        after, limiter = self._filter.step(
            state, wanted, period, self._clearance, now=now, apart=self._apart
        )
        self._state = after
        if limiter is not None:
            report = report.with_limiter(limiter)
            self._give_up(limiter, is_at_rest=not (state.moving or after.moving))
        if active is not None and active.conclude(arm, after):
            self._release('')
        point = SetPoint(after, Source.NONE if active is None else active.source, report)
        rests = active is None and limiter is None and not (state.moving or after.moving)
        self._rested = point if rests and self._filter.is_alone else None
        return point

    @property
    def _clearance(self) -> float | None:
        """Return the least distance in [m] between links on a stop; None on a checked path."""
        if self._jogged:
            return self._settings.clearance
        is_unchecked = self._unchecked is not None and self._unchecked is self.execution
        is_clear = self._active is not None and self._active.on_path and not is_unchecked
        if is_clear or not self._settings.check_self_collision:
            return None
        return UNCHECKED_CLEARANCE if is_unchecked else 0.0

    @property
    def _apart(self) -> float | None:
        """Return the least distance in [m] to other arms while all of them stop."""
        if self._jogged:
            return self._settings.clearance
        return ARM_DISTANCE if self._settings.check_self_collision else None

    def _give_up(self, limiter: Limiter, *, is_at_rest: bool) -> None:
        """End a motion that the safety filter blocks; the arm comes to rest."""
        if self._active is None or self._active is self._jog:
            return
        if limiter.cause is Cause.COLLISION:
            reason = self._refusal(limiter)
        elif self.source is Source.TARGET and is_at_rest:
            reason = f'no way to the target from here: {limiter}'
        else:
            return
        self._active.end(Outcome(GoalCode.PATH_TOLERANCE_VIOLATED, reason))

    def _refusal(self, limiter: Limiter) -> str:
        """Return why a motion cannot continue, and the remedy."""
        if self._filter.is_near_neighbour:
            return (
                f'{limiter.name} would come nearer than {ARM_DISTANCE * 1e3:g} mm to another arm; '
                'begin when that is out of the way, or keep more distance'
            )
        if self.source is Source.TARGET:
            where = 'on the way to the target from where the arm is; go around that'
        elif self._unchecked is self.execution:
            where = 'on the trajectory: the scene changed; lead it around that'
        else:
            where = (
                'while the arm catches up with the path; begin at rest, or give the first point '
                'more time'
            )
        return f'{limiter.name} would collide {where}'

    def _begin_jog(self, request: JogRequest, now: float) -> None:
        """Start or update a jog; the safety filter checks every step.

        A zero command is a stop: it is never refused, and ends only the jog of its client.
        """
        if request.is_zero:
            if self._active is not self._jog or self._jog.client != request.client:
                return
        elif now > request.expires:
            raise NotReadyError(
                f'expired {now - request.expires:.2f} s before the cycle; send commands more'
                ' often than they expire (incoming_command_timeout)'
            )
        elif self.paused:
            raise CommandError(PAUSED)
        command = in_base(self.model, self.state.position, request)
        if not request.is_zero:
            self._changed('a jog took over')
        if self._active is not self._jog:
            self._release('jogging took over')
            self._jog.begin()
            self._active = self._jog
        self._jog.take(command, request.expires, request.client)

    def _stop(self, request: StopRequest) -> None:
        if request.motion is not None and request.motion is not self._active:
            return
        if request.sources is None or self.source in request.sources:
            self._end(Outcome(GoalCode.SUCCESSFUL, request.reason, canceled=True))

    def _end(self, outcome: Outcome) -> None:
        """Bring the arm to rest; end its motion with an outcome."""
        self._changed('the arm was stopped')
        if self._active is not None:
            self._active.stop(outcome)
            if self._active.outcome is not None:
                self._release(outcome.reason)

    def _release(self, reason: str) -> None:
        """End the motion of the arm, which comes to rest unless another source takes over."""
        if self._active is not None:
            self._active.end(Outcome(GoalCode.INVALID_GOAL, reason))
        self._active, self._held = None, False

    def _check_held(self) -> None:
        """Refuse a command that would wait during a pause and start unexpectedly later."""
        if self.paused:
            raise CommandError(PAUSED)
        if self.speed == 0.0:
            raise CommandError('the speed override is 0; raise it first (~/speed_scaling_input)')

    def _changed(self, what: str) -> None:
        """Count a command or a stop, which invalidates motions prepared before it."""
        self._sequence += 1
        self._last_change = what

    def _check_place(self, planned: RobotState, state: RobotState) -> None:
        """Check that the arm is at the state for which a trajectory was planned."""
        off = np.abs(state.position - planned.position)
        joint = int(np.argmax(off))
        if off[joint] > PREPARED_STATE_TOLERANCE:
            raise StateMovedError(
                GoalCode.INVALID_GOAL,
                f'{self.model.joints[joint]} was moved by {off[joint]:.3f} rad while the'
                ' trajectory was planned, and its path was checked from there only; send it'
                ' again, or end what moves the arm first',
            )
