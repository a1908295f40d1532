# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""One motion core: jogging, trajectories and single targets hand over to each other smoothly.

Every source starts from the commanded state, and every step passes the same filter, so a hand-over
is no event: positions, velocities and accelerations go on from where they are.

Every command comes in by one contract, be it a jog, a motion, a pause or a stop:
:meth:`MotionCore.prepare` checks a request and plans a motion beside the cycle,
:meth:`MotionCore.commit` lets it count in the cycle, and refuses a motion that was prepared for
another state or before another command or stop.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from arm_model import (
    Array,
    checked,
    CommandError,
    ModelError,
    PlanningScene,
    RobotModel,
    RobotState,
)
from arm_trajectory import GoalCode, OnlineTrajectoryGenerator, StateMovedError

from ..exceptions import NotReadyError
from ..report import Cause, Limiter
from .arbiter import CommandArbiter, Motion
from .commands import in_base
from .execution import Execution, Feedback
from .moving_arms import Neighbours
from .outcome import Outcome
from .preparation import CommandBasis, Preparation, Prepared
from .prepared_scene import PreparedScene
from .requests import (
    ImmediateRequest,
    JogRequest,
    MotionRequest,
    PauseRequest,
    SpeedRequest,
    StopRequest,
)
from .safety_filter import SafetyFilter
from .set_point import SetPoint, Source
from .settings import CoreSettings
from .stop_distances import StopDistances

PREPARED_STATE_TOLERANCE = 0.01
"""How far the arm may be from where a trajectory was prepared in [rad]."""

MAX_JOINTS = 8  # joints of the longest chain that is jogged

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
    the thread of the cycle but :meth:`prepare`, which is for any one other thread, and
    :meth:`prepare_scene`, for any.
    """

    def __init__(self, model: RobotModel, settings: CoreSettings | None = None) -> None:
        """Wait for :meth:`reset`.

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
        self._distances = StopDistances(self._settings, self._arbiter)
        self._scene = self.prepare_scene(model.scene, 0, None)

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
    def scene(self) -> PreparedScene:
        """What may collide."""
        return self._scene

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
        is_at_rest = self._arbiter.held and not self.state.moving
        source = Source.NONE if is_at_rest else self.source
        target = self._arbiter.target if source is Source.TARGET else None
        return CommandBasis(
            self.state,
            self._scene,
            self._sequence,
            source,
            self.speed_scaling,
            None if target is None else target.target,
            self.execution,
            None if self.execution is None else self.execution.timer(self.speed_scaling),
        )

    def reset(self, positions: Sequence[float] | Array, reason: str = 'the arm was reset') -> None:
        """Begin at rest where the arm is; whatever moved it ends.

        Raises:
            CommandError: The count is wrong, or a position is not finite.
        """
        where = checked(positions, len(self._model), 'positions')
        self._changed('the arm was moved by something else')
        self._arbiter.release(reason)
        self._state = RobotState.at_rest(where)
        self._filter.reset(self._state)

    def keep_apart(self, neighbours: Neighbours) -> None:
        """Heed from now on how other arms of the robot move; before the first step."""
        self._filter.keep_apart(neighbours)

    def stands(self, measured: RobotState | None) -> None:
        """Pass a cycle in which something else has the drives; other arms heed where it is."""
        self._filter.stands(measured)

    def prepare_scene(
        self, scene: PlanningScene, version: int, near: Array | None
    ) -> PreparedScene:
        """Measure a scene beside the cycle.

        Args:
            near: Where the arm is in [rad]; None while that is not known.

        Raises:
            SceneError: It is of another arm.
        """
        self._model.check_scene(scene)
        checks_paths = self._settings.check_self_collision
        return PreparedScene.of(scene, version, near=near, checks_paths=checks_paths)

    def use_scene(self, scene: PreparedScene) -> Execution | None:
        """Use another scene from now on, for jogs, targets and trajectories.

        Returns:
            The trajectory under way, whose path is to be checked again beside the cycle; see
            :meth:`conclude_check`. The safety filter keeps it from contact until then. None where
            there is nothing to check.
        """
        self._model.use_scene(scene.clearances)
        self._scene = scene
        self._filter.forget()
        is_checked = self.source is Source.TRAJECTORY and scene.check is not None
        self._distances.unchecked = self.execution if is_checked else None
        return self._distances.unchecked

    def conclude_check(self, execution: Execution, scene: PreparedScene, problem: str) -> None:
        """Go on with a trajectory whose path is clear in a scene, or end it on its path.

        Args:
            scene: The scene; nothing is done when it does not count any more.
        """
        if scene is not self._scene or execution is not self._distances.unchecked:
            return
        if not problem:
            self._distances.unchecked = None
        elif self.motion is execution and execution.ending is None:
            self._end(Outcome(GoalCode.PATH_TOLERANCE_VIOLATED, problem))

    def hold(self, *, is_held: bool = True) -> None:
        """Bring a jog or a single target to rest for what is prepared, or let it go on."""
        self._arbiter.held = is_held

    def prepare(
        self, request: MotionRequest | ImmediateRequest, basis: CommandBasis | None = None
    ) -> Prepared:
        """Check a request; plan a motion, and check its path. Nothing moves.

        Motions are for one thread at a time, whichever; other requests for any thread.

        Args:
            basis: The arm where a motion begins: :attr:`basis`, or foreseen from it.

        Raises:
            CommandError: The request is refused.
        """
        return self._preparation.prepare(request, basis)

    def commit(
        self, prepared: Prepared, now: float, elapsed: float = 0.0, *, in_any_scene: bool = False
    ) -> None:
        """Apply a request from now on; where a motion is off, the arm catches up smoothly.

        Args:
            elapsed: Time since its basis in [s], by which a motion that begins later waits less.
            in_any_scene: A motion that was prepared in an old scene begins, too. The path of a
                trajectory is then to be checked beside the cycle, as after :meth:`use_scene`.

        Raises:
            StateMovedError: Another command or a stop came after a motion was prepared, or the arm
                is elsewhere than where a trajectory was: prepared again it may begin.
            CommandError: The arm is paused, and a jog or a single target would begin later, by
                surprise.
            NotReadyError: A jog has expired, or the position of the arm is not known yet.
        """
        request = prepared.request
        if isinstance(request, JogRequest):
            self._jog(request, now)
        elif isinstance(request, StopRequest):
            self._stop(request)
        elif isinstance(request, PauseRequest):
            self._pause(request)
        elif isinstance(request, SpeedRequest):
            self._speed = request.speed
        elif prepared.motion is not None and prepared.basis is not None:
            self._begin(prepared.motion, prepared.basis, elapsed, in_any_scene)

    def fail(self, reason: str, code: GoalCode = GoalCode.INVALID_GOAL) -> None:
        """Come to rest, a trajectory on its path, because something has gone wrong."""
        self._end(Outcome(code, reason))

    def abandon(self, reason: str) -> None:
        """End at once what moves the arm, which does not follow any more."""
        if self.source is not Source.NONE:
            self._changed('the arm did not follow')
            self._arbiter.release(reason)

    def step(self, now: float, period: float, measured: RobotState | None = None) -> SetPoint:
        """Return the set-point of a cycle.

        Args:
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
        self._distances.update(moving=state.moving)
        after, limiter = self._filter.step(
            state,
            wanted,
            period,
            self._distances.between_links,
            now=now,
            apart=self._distances.between_arms,
        )
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

    def _give_up(self, limiter: Limiter, *, is_at_rest: bool) -> None:
        """End a motion that the safety filter does not let go on; the arm comes to rest."""
        code = GoalCode.PATH_TOLERANCE_VIOLATED
        if limiter.cause is Cause.COLLISION:
            near_arm = self._filter.is_near_neighbour
            self._arbiter.end(Outcome(code, self._distances.refusal(limiter, near_arm=near_arm)))
        elif self.source is Source.TARGET and is_at_rest:
            self._arbiter.end(Outcome(code, f'no way to the target from here: {limiter}'))

    def _jog(self, request: JogRequest, now: float) -> None:
        """Jog from now on; the safety filter sees every step.

        A zero is a stop: it is not refused, and ends only the jog of its client.
        """
        if request.is_zero:
            if self.source is not Source.JOG or self._arbiter.jogger != request.client:
                return
        elif now > request.expires:
            raise NotReadyError(
                f'expired {now - request.expires:.2f} s before the cycle; send commands more'
                ' often than they expire (incoming_command_timeout)'
            )
        elif self._paused:
            raise CommandError(PAUSED)
        command = in_base(self._model, self.state.position, request)
        if not request.is_zero:
            self._changed('a jog took over')
        self._arbiter.jog(command, request.expires, request.client)

    def _begin(
        self, motion: Motion, basis: CommandBasis, elapsed: float, in_any_scene: bool
    ) -> None:
        state = self.state
        if basis.sequence != self._sequence:
            raise StateMovedError(
                GoalCode.INVALID_GOAL,
                f'{self._last_change} before this command had begun; send it again',
            )
        is_old = basis.scene is not self._scene
        if is_old and not in_any_scene:
            raise StateMovedError(
                GoalCode.INVALID_GOAL,
                f'the scene changed (version {basis.scene.version} to {self._scene.version}) while'
                ' this motion was prepared; send it again',
            )
        if isinstance(motion, Execution):
            self._check_place(basis.state, state)
            self._changed('another command came')
            motion.elapse(elapsed)
            self._arbiter.follow(motion)
            is_unchecked = is_old and self._scene.check is not None
            self._distances.unchecked = motion if is_unchecked else None
        else:
            self._check_held()
            self._changed('another command came')
            self._arbiter.aim(motion)

    def _pause(self, request: PauseRequest) -> None:
        if request.is_paused:
            self._changed('the arm was paused')
        self._paused = request.is_paused

    def _stop(self, request: StopRequest) -> None:
        if request.motion is not None and request.motion is not self.motion:
            return
        if request.sources is None or self.source in request.sources:
            self._end(Outcome(GoalCode.SUCCESSFUL, request.reason, canceled=True))

    def _end(self, outcome: Outcome) -> None:
        """Bring the arm to rest; what moves it ends so."""
        self._changed('the arm was stopped')
        self._arbiter.stop(outcome)

    def _check_held(self) -> None:
        """Refuse what would wait, and begin when it is no longer expected."""
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
