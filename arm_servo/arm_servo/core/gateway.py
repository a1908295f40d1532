# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Where any thread gives commands to the motion core, and reads what it does.

Every motion goes the same way: it is requested in any thread, prepared beside the cycle from the
state that the cycle hands out, and begun in the cycle. A stop counts from the moment of the
call: whatever was requested before it is refused at every later step, so no stop is overtaken by
what was under way.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from itertools import count
import math
import time

from arm_model import ArmError, Array, PlanningScene, RobotModel, RobotState
from arm_trajectory import GoalCode

from ..controllers.controller import JOGGING, MOTIONS, NotReadyError, SetPoint, Source
from ..controllers.trajectory import Execution
from .mailbox import (
    BEGINS,
    check_request,
    Cycle,
    ImmediateRequest,
    JogRequest,
    Mailbox,
    PauseRequest,
    Snapshot,
    StopRequest,
    TOGETHER,
)
from .motion_core import MotionCore
from .motion_queue import MotionQueue
from .preparation import PreparedScene

MAX_QUEUED_JOGS = 1000  # jog commands that may wait for the cycle

Loss = tuple[str, GoalCode]  # why an arm that followed does not go on, and the code of its motion


def start_worker() -> Executor:
    """Start the thread that prepares motions; the cycle hands over to it, and starts none."""
    worker = ThreadPoolExecutor(1, thread_name_prefix='motion preparation')
    worker.submit(lambda: None)  # an executor starts its thread with the first piece of work
    return worker


class CommandGateway:
    """Commands to one motion core from any thread, carried out by the thread that steps it.

    :meth:`update`, :meth:`reset` and :meth:`abandon` are for the cycle, and the kinematics of the
    core's model belong to it; the rest is for any thread. Times are steady times in [s].
    """

    def __init__(
        self, core: MotionCore, worker: Executor, clock: Callable[[], float] = time.monotonic
    ) -> None:
        """Wait for the arm; the core is the gateway's now, ``clock`` the one of the cycle."""
        self.model: RobotModel = core.model  # the arm
        # what the core did in the last cycle
        self.snapshot = Snapshot(0.0, None, None, 'the cycle has not begun yet')
        self.is_following = False  # whether the arm is commanded, also to bring it to rest
        self._lost = ''  # why an arm that followed comes to rest
        self._core, self._worker, self._clock = core, worker, clock
        self._mailbox = Mailbox()
        self._gate = self._mailbox.gate
        self._versions = count(1)
        self._motions = MotionQueue(
            core, self._mailbox, worker, clock, rest=self._rest, recheck=self._recheck
        )
        self.request, self.cancel = self._motions.request, self._motions.cancel
        self.number = self._gate.number  # the place of a command that comes now among all
        self.keep_apart = core.keep_apart  # before the first cycle
        self.reset = core.reset  # where others have moved the arm while it was at rest

    @property
    def refused(self) -> float:
        """When a motion was refused last, as the arm did not follow, in [s]."""
        return self._mailbox.refused

    def command(
        self, request: ImmediateRequest, get_ready: Callable[[], object] = lambda: None
    ) -> Future[None]:
        """Apply a jog, a stop, a pause or a speed override from the next cycle on.

        A stop refuses from the moment of the call what was requested before it, a pause what jogs.

        Args:
            get_ready: Gets back drives that others have; called for a request that is not refused.

        Returns:
            Nothing once it counts; the ArmError with which it was refused.
        """
        future: Future[None] = Future()
        number = self._gate.number()  # first: a stop during what follows counts
        moves = isinstance(request, JogRequest) and not request.is_zero
        try:
            check_request(self.model, request)
            if isinstance(request, JogRequest):
                if len(self._mailbox) >= MAX_QUEUED_JOGS:
                    raise NotReadyError(f'{MAX_QUEUED_JOGS} commands wait for the cycle')
                self.stream(Source.JOG, request.client, is_zero=not moves, expires=request.expires)
            get_ready()
        except ArmError as error:
            future.set_exception(error)
            return future
        since = self._clock()
        if isinstance(request, StopRequest):
            self._gate.stop(request.sources or MOTIONS, request.reason)
        elif isinstance(request, PauseRequest) and request.is_paused:
            self._gate.stop(JOGGING, 'the arm was paused')

        def commit(cycle: Cycle) -> bool:
            try:
                if moves:
                    self._mailbox.admit(Source.JOG, number, since, cycle)
                self._core.apply(request, cycle.now)
            except Exception as error:  # noqa: BLE001  # its future carries it
                future.set_exception(error)
                return True
            if moves:  # the newest command counts: older ones never begin
                self._gate.stop((Source.TARGET, Source.TRAJECTORY), 'a jog took over', number)
            future.set_result(None)
            return True

        self._mailbox.post(commit)
        return future

    def stream(
        self,
        source: Source,
        client: Hashable,
        *,
        is_zero: bool = False,  # whether it commands standing still, with which the client lets go
        # steady time until which it moves the arm in [s]; by default not beyond now
        expires: float = -math.inf,
    ) -> None:
        """Record a command of a client that may send one after the other.

        Raises:
            NotReadyError: The arm has stopped since the client began; it has to let go first.
        """
        if is_zero:
            self._gate.release(source, client)
        elif reason := self._gate.command(source, client, self._clock(), expires):
            raise NotReadyError(reason)

    def get_ready_for(
        self, source: Source, client: Hashable, get_ready: Callable[[], bool]
    ) -> None:
        """Get back the drives, if they are away, for a client whose stream begins."""
        self._gate.ask(source, client, self._clock())  # first: the cycle may be quicker
        if not get_ready():
            self._gate.ask(source, client, -math.inf)

    def renew(self, source: Source) -> None:
        """Treat the next command as a new one: a person has requested it.

        A stream of trajectories that goes on is not let in by that.
        """
        silence = TOGETHER if source is Source.TRAJECTORY else -math.inf
        self._gate.renew(source, self._clock(), silence)

    def use_scene(self, scene: PlanningScene) -> Future[int]:
        """Use another scene from the next cycle on, for jogs, targets and trajectories.

        It is measured here, beside the cycle, which takes some milliseconds for 100 objects. A
        trajectory under way is checked again, and ends on its path where it would collide.

        Returns:
            Its version once it counts.

        Raises:
            SceneError: The scene is of another arm.
        """
        version, reference = next(self._versions), self.snapshot.reference
        near = None if reference is None else reference.position
        prepared = self._core.prepare_scene(scene, version, near)
        future: Future[int] = Future()

        def take(_cycle: Cycle) -> bool:
            # to free a large scene takes milliseconds: in the worker, not in the cycle
            before = [self._core.scene]
            execution = self._core.use_scene(prepared)
            if execution is not None:
                self._recheck(execution)
            self._worker.submit(before.clear)
            future.set_result(version)
            return True

        self._mailbox.post(take)
        return future

    def interrupt(self, reason: str) -> None:
        """Refuse what was requested so far and has not begun, and end the streams of clients."""
        self._gate.interrupt(reason, self._clock())

    def update(
        self,
        now: float,
        period: float,
        measured: RobotState | None,  # what the drives report; None while that is not whole
        # positions last commanded to the drives in [rad], where it takes over
        begin: Array | None,
        blocked: str,  # why the arm cannot follow, with the remedy; empty when it can
        *,
        # what to report of an arm that followed; by default why it cannot
        explain: Callable[[], Loss] | None = None,
        is_gone: bool = False,  # no drive is left to be brought to rest
        ages: Array | None = None,  # how old the measured values of each joint are in [s]
    ) -> SetPoint | None:
        """Carry out what was commanded, and return the set-point of this cycle.

        It takes the arm over at rest when nothing is in the way. When something comes in the way
        the arm comes to rest, a trajectory on its path, and commands are refused.

        Returns:
            None while the arm does not follow.
        """
        if not (self.is_following or blocked) and measured is not None and begin is not None:
            self._core.reset(begin)
            self._gate.begin(BEGINS, self._clock())
            self.is_following, self._lost = True, ''
        if not self.is_following or measured is None:
            self._idle(now, measured, self._lost or blocked, ages)
            return None
        if blocked and not self._lost:
            self._lost, code = (blocked, GoalCode.INVALID_GOAL) if explain is None else explain()
            self.interrupt(self._lost)
            self._core.fail(self._lost, code)
        if is_gone:
            self._idle(now, measured, self._lost, ages)
            self.is_following, self._lost = False, ''
            return None
        point = self._step(now, period, measured, ages)
        if self._lost and point.source is Source.NONE and not point.state.moving:
            self.is_following, self._lost = False, ''
        return point

    def abandon(self, now: float, reason: str) -> None:
        """End all that was commanded, for a cycle that has failed: none may follow."""
        self.is_following, self._lost = False, ''
        self.interrupt(reason)
        self._motions.clear(reason)
        self._idle(now, self.snapshot.measured, reason, None)

    def _step(
        self, now: float, period: float, measured: RobotState, ages: Array | None
    ) -> SetPoint:
        core, blocked = self._core, self._lost
        self._mailbox.carry_out(Cycle(now, period, blocked))
        point = core.step(now, period, measured)
        self._motions.report_ends()
        self.snapshot = Snapshot(
            now,
            point,
            measured,
            blocked,
            point.source,
            core.paused,
            core.speed,
            self.snapshot.cycles + 1,
            period,
            core.execution,
            ages,
        )
        return point

    def _idle(
        self, now: float, measured: RobotState | None, blocked: str, ages: Array | None
    ) -> None:
        """Pass a cycle in which the arm does not follow; commands are refused."""
        core, before = self._core, self.snapshot
        if before.set_point is not None:
            self.interrupt(blocked)
        core.stands(measured)
        core.abandon(blocked)  # it ended at the latest when the arm came to rest
        self._motions.report_ends()
        self._mailbox.carry_out(Cycle(now, before.period, blocked))
        self.snapshot = Snapshot(
            now,
            None,
            measured,
            blocked,
            paused=core.paused,
            speed=core.speed,
            cycles=before.cycles,
            ages=ages,
        )

    def _rest(self) -> RobotState | None:
        """Return where the arm stands while others have its drives; None where it follows."""
        snapshot = self.snapshot
        return snapshot.reference if snapshot.blocked else None

    def _recheck(self, execution: Execution) -> None:
        """Check the rest of a path in the present scene, in the worker's thread; for the cycle."""
        begin, scene = execution.feedback.time, self._core.scene
        self._worker.submit(lambda: self._check(execution, begin, scene))

    def _check(self, execution: Execution, begin: float, scene: PreparedScene) -> None:
        """Check the rest of a path for contact; in the worker's thread."""
        if scene is not self._core.scene:
            return  # a newer one counts, in which it is checked as well
        try:
            found = None if scene.check is None else execution.contact(scene.check, begin)
            problem = found and (
                f'{" and ".join(found.links)} would collide at {found.time:.2f} s of the'
                ' trajectory: the scene changed; lead it around that'
            )
        except Exception as error:  # noqa: BLE001  # what is not known to be clear ends
            problem = (
                'the scene changed, and the rest of the trajectory could not be checked:'
                f' {type(error).__name__}: {error}'
            )

        def conclude(_cycle: Cycle) -> bool:
            self._core.conclude_check(execution, scene, problem or '')
            return True

        self._mailbox.post(conclude)
