# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Thread-safe access to the motion core: commands in, snapshots out.

One queue leads to the cycle, and every command gets a sequence number when it is requested. A
stop takes effect at the call: every later step refuses the commands requested before it, so no
pending command overtakes a stop.

Every motion is requested in any thread, prepared outside the cycle from a state that the cycle
provides, and started in the cycle.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator, Hashable, Sequence
from concurrent.futures import (
    CancelledError,
    Executor,
    Future,
    InvalidStateError,
    ThreadPoolExecutor,
)
from contextlib import suppress
from dataclasses import dataclass, field, replace
from enum import Enum
import math
import threading
import time

from arm_model import ArmError, Array, CommandError, PlanningScene, RobotModel, RobotState
from arm_trajectory import GoalCode, StateMovedError, TrajectoryGoal
from robot_primitives import StreamGate, StreamRules

from ..controllers.controller import (
    JOGGING,
    MOTIONS,
    NotReadyError,
    Outcome,
    refused,
    SetPoint,
    Source,
)
from ..controllers.trajectory import Execution
from .motion_core import MotionCore
from .preparation import CommandBasis, Motion
from .requests import (
    check_request,
    DisplacementRequest,
    ImmediateRequest,
    JogRequest,
    MAX_CYCLE_AGE,
    MotionRequest,
    moves_nothing,
    PauseRequest,
    Snapshot,
    StopRequest,
)

MAX_QUEUED_JOGS = 1000  # jog commands that may wait for the cycle
MAX_QUEUED_MOTIONS = 50  # motions that may wait to be prepared

PREPARATION_TIME = 5e-3
"""Time in [s] allowed for preparing any trajectory; see Preparation for measured times."""

PREPARATION_TIME_PER_POINT = 5e-4  # additional time for each point in [s]

PREPARATION_TIME_PER_SECOND = 5e-3
"""Time in [s] allowed for collision checking per second of the path."""

MAX_CHECKED_DURATION = 100.0  # path time whose check a start from motion waits for in [s]

MAX_FORESIGHT = 0.03
"""Longest prediction of a jog or a single target in [s]; later it may have changed."""

MIN_CYCLES_AHEAD = 3  # least cycles from the basis to the predicted start of a motion

MAX_ATTEMPTS = 3
"""Attempts to prepare a motion while other commands move the arm or the scene changes."""

REST_MARGIN = 1.0
"""Time in [s] that a jogged arm may take to come to rest for a trajectory, in addition to its
braking time from full speed."""

MAX_LAG = 0.1  # longest lag to which trajectories of a stream are delayed in [s]

CANCELED = Outcome(GoalCode.SUCCESSFUL, 'canceled before it began', canceled=True)
NOTHING = Outcome(GoalCode.SUCCESSFUL, 'a displacement by nothing')

BEGINS = 'the arm has just begun to follow'

TOGETHER = 1.0
"""Longest time in [s] between trajectories of one stream on a topic; an interrupted stream must be
silent for as long before it is accepted again."""

GONE_AFTER = 10.0  # silence that counts as a release by the client in [s]

RULES = {
    Source.JOG: StreamRules(
        'a jog that was held before moves nothing: release and jog again, with a command of zero'
        f' between (silence counts after {GONE_AFTER:g} s only), or call ~/start_servo',
        gone_after=GONE_AFTER,
    ),
    Source.TRAJECTORY: StreamRules(
        'a stream of trajectories does not go on after that: send none for'
        f' {TOGETHER:g} s, then an empty one, or none for {GONE_AFTER:g} s',
        together=TOGETHER,
        let_go=GONE_AFTER,
        gone_after=GONE_AFTER,
        begin_margin=5.0,  # in which drives are got back
    ),
}
"""Rules for clients that send streams: jogging clients, and the trajectory topic."""

Loss = tuple[str, GoalCode]  # why the arm stopped following, and the result code of its motion


@dataclass(frozen=True, slots=True, eq=False)
class Cycle:
    """Context of a queued order: the cycle that executes it."""

    now: float  # steady time in [s]
    period: float  # time to the next cycle in [s]
    blocked: str  # why the arm takes no commands; empty when it does


class Turn(Enum):
    """Where the next step of a motion runs."""

    CYCLE = 'in the next cycle'
    WORKER = 'in the thread that plans and checks'


MotionSequence = Generator[Turn, Cycle, None]
"""Steps from a request to its start: yields the thread to continue in, receives the cycle."""


@dataclass(slots=True, eq=False)
class MotionCommand:
    """A motion from its request to its end."""

    request: MotionRequest  # the requested motion
    number: int  # sequence number among all commands and stops
    requested: float  # steady time of the request in [s]
    stream: Hashable = None  # stream in which a newer motion replaces waiting ones; or None
    # the sum of displacements before this one was added; restored if this one is refused
    before: MotionCommand | None = None
    takes_drives: bool = True  # whether it takes back drives from others
    # once started: its execution, or None for a single target; else the error that refused it
    future: Future[Execution | None] = field(default_factory=Future)
    # its outcome in every case; set once, at the latest when the cycle fails
    ended: Future[Outcome] = field(default_factory=Future)
    motion: Motion | None = None  # its motion, once started
    is_canceled: bool = False  # whether it was canceled and must not start
    holds: bool = False  # whether a jog or a target is held for it

    @property
    def execution(self) -> Execution | None:
        """The execution of a trajectory that has started; else None."""
        return self.motion if isinstance(self.motion, Execution) else None

    @property
    def source(self) -> Source:
        """The source that moves the arm for this command."""
        is_trajectory = isinstance(self.request, TrajectoryGoal)
        return Source.TRAJECTORY if is_trajectory else Source.TARGET

    def end(self, outcome: Outcome) -> None:
        """Set the outcome, unless it is already set."""
        with suppress(InvalidStateError):
            self.ended.set_result(outcome)


def start_worker() -> Executor:
    """Create an executor with a running thread, so that the cycle need not start one."""
    worker = ThreadPoolExecutor(1, thread_name_prefix='motion preparation')
    worker.submit(lambda: None)  # an executor starts its thread with the first piece of work
    return worker


class CommandGateway:
    """Queues commands from any thread for one motion core; the cycle's thread executes them.

    Call :meth:`update`, :meth:`reset` and :meth:`abandon`, and use the kinematics of the core's
    model, only in the cycle; all else is thread-safe. Times are steady times in [s].
    """

    def __init__(
        self, core: MotionCore, worker: Executor, clock: Callable[[], float] = time.monotonic
    ) -> None:
        """Take ownership of the core; ``clock`` is the clock of the cycle."""
        self.model: RobotModel = core.model  # the arm
        # what the core did in the last cycle
        self.snapshot = Snapshot(0.0, None, None, 'the cycle has not begun yet')
        self.is_following = False  # whether the arm is commanded, also to bring it to rest
        # when a motion was refused last, as the arm did not follow, in [s]
        self.refused = -math.inf
        self.keep_apart = core.keep_apart  # before the first cycle
        self.reset = core.reset  # where others have moved the arm while it was at rest
        # gets back drives that others have, for what is not refused, in any thread; returns
        # whether there were any
        self.get_ready: Callable[[], bool] = lambda: False
        self._lost = ''  # why an arm that followed comes to rest
        self._core, self._worker, self._clock = core, worker, clock
        # refuses what a stop or a newer command has made void
        self._gate = StreamGate[Source](MOTIONS, RULES)
        self.number = self._gate.number  # the place of a command that comes now among all
        self._orders: deque[Callable[[Cycle], object]] = deque()  # for the cycle
        self._begun: list[MotionCommand] = []  # of the cycle
        self._lock = threading.Lock()  # of the two below; held for a few instructions only
        self._waiting: deque[MotionCommand] = deque()
        self._preparing: MotionCommand | None = None
        self._lag = 0.0  # from the requests of a stream to their motion in [s]; of the worker
        limits = core.model.limits
        braking = limits.velocity / limits.acceleration + limits.acceleration / limits.jerk
        self._rest_timeout = REST_MARGIN + float(braking.max())

    def command(self, request: ImmediateRequest) -> Future[None]:
        """Apply a jog, a stop, a pause or a speed override from the next cycle on.

        From the call on, a stop refuses all earlier requests, a pause earlier jogs and targets.

        Returns:
            A future that completes when the request is applied, or carries the ArmError.
        """
        future: Future[None] = Future()
        number = self._gate.number()  # first: a stop during what follows counts
        moves = isinstance(request, JogRequest) and not request.is_zero
        try:
            check_request(self.model, request)
            if isinstance(request, JogRequest):
                self._check_jog(request)
            if moves:
                self.get_ready()
        except ArmError as error:
            future.set_exception(error)
            return future
        since = self._clock()
        if isinstance(request, StopRequest):
            self._gate.stop(request.sources or MOTIONS, request.reason)
        elif isinstance(request, PauseRequest) and request.is_paused:
            self._gate.stop(JOGGING, 'the arm was paused')

        def commit(cycle: Cycle) -> None:
            try:
                if moves:
                    self._admit(Source.JOG, number, since, cycle)
                self._core.apply(request, cycle.now)
            except Exception as error:  # noqa: BLE001  # its future carries it
                future.set_exception(error)
                return
            if moves:  # the newest command counts: older ones never begin
                self._gate.stop((Source.TARGET, Source.TRAJECTORY), 'a jog took over', number)
            future.set_result(None)

        self._orders.append(commit)
        return future

    def _check_jog(self, request: JogRequest) -> None:
        if len(self._orders) >= MAX_QUEUED_JOGS:
            raise NotReadyError(f'{MAX_QUEUED_JOGS} commands wait for the cycle')
        client, is_zero = request.client, request.is_zero
        self.stream(Source.JOG, client, is_zero=is_zero, expires=request.expires)

    def request(
        self,
        request: MotionRequest,
        number: int | None = None,
        stream: Hashable = None,
        *,
        takes_drives: bool = True,
    ) -> MotionCommand:
        """Queue a motion: prepare it, and start it if its path is clear.

        Args:
            number: Sequence number, if it was drawn earlier from :attr:`number`; by default the
                next one.
            stream: Its stream; the motion replaces waiting ones of this stream. Displacements add
                up; one whose sum exceeds the limits is refused alone.
            takes_drives: Whether to take back drives from others when the arm does not follow; a
                motion that is refused at the current position takes none.
        """
        error: ArmError | None = None
        before: MotionCommand | None = None
        with self._lock:
            number = self._gate.number() if number is None else number
            replaced = [each for each in self._waiting if stream and each.stream == stream]
            try:
                if moves_nothing(self.model, request):
                    command = MotionCommand(request, number, self._clock())
                    command.future.set_result(None)
                    command.end(NOTHING)
                    return command
                if isinstance(request, DisplacementRequest) and stream:
                    request, before = self._sum(request, replaced)
            except ArmError as refusal:
                error, replaced, before = refusal, [], None
            for each in replaced:
                self._waiting.remove(each)
            command = MotionCommand(request, number, self._clock(), stream, before, takes_drives)
            if len(self._waiting) >= MAX_QUEUED_MOTIONS:
                error = error or NotReadyError(
                    f'{MAX_QUEUED_MOTIONS} motions wait already; send them more slowly'
                )
            if error is None:
                self._waiting.append(command)
        for each in replaced:
            self._refuse(each, CancelledError())
        if error is not None:
            self._refuse(command, error)
        self._prepare_next()
        return command

    @property
    def is_preparing(self) -> bool:
        """Whether a requested motion has neither started nor been refused yet."""
        with self._lock:
            return self._preparing is not None or bool(self._waiting)

    def cancel(self, command: MotionCommand, reason: str) -> None:
        """Cancel a motion: if it has not started, drop it; else bring the arm to rest."""

        def stop(cycle: Cycle) -> None:
            if command.motion is not None:
                self._core.apply(StopRequest(reason, motion=command.motion), cycle.now)

        # the mark first: a commit that has missed it comes before the order
        command.is_canceled = True
        if command.future.cancel():
            command.end(CANCELED)
        self._orders.append(stop)

    def stream(
        self,
        source: Source,
        client: Hashable,
        *,
        is_zero: bool = False,  # whether it commands standing still, with which the client lets go
        # steady time until which it moves the arm in [s]; by default not beyond now
        expires: float = -math.inf,
    ) -> None:
        """Record a command of a client that may send a stream of them.

        Raises:
            NotReadyError: The arm was stopped during the stream; the client must release first.
        """
        if is_zero:
            self._gate.release(source, client)
        elif reason := self._gate.command(source, client, self._clock(), expires):
            raise NotReadyError(reason)

    def renew(self, source: Source) -> None:
        """Accept the next command as the start of a new stream, because a person requested it.

        An ongoing stream of trajectories stays refused.
        """
        silence = TOGETHER if source is Source.TRAJECTORY else -math.inf
        self._gate.renew(source, self._clock(), silence)

    def interrupt(self, reason: str) -> None:
        """Refuse all requests that have not started, and end the streams of clients."""
        self._gate.interrupt(reason, self._clock())

    def use_scene(self, scene: PlanningScene) -> None:
        """Apply a new scene from the next cycle on, for jogs, targets and trajectories.

        This thread measures the scene, which takes some milliseconds for 100 objects. A running
        trajectory is checked again, and stops on its path if it would collide.

        Raises:
            SceneError: The scene belongs to another arm.
        """
        reference = self.snapshot.reference
        near = None if reference is None else reference.position
        prepared = self._core.prepare_scene(scene, near)

        def take(_cycle: Cycle) -> None:
            # to free a large scene takes milliseconds: in the worker, not in the cycle
            before = [self._core.scene]
            execution = self._core.use_scene(prepared)
            if execution is not None:
                self._recheck(execution)
            self._worker.submit(before.clear)

        self._orders.append(take)

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
        """Execute the queued commands, and return the set-point of this cycle.

        It takes over the arm at rest when ``blocked`` is empty. When ``blocked`` is set, the arm
        comes to rest (a trajectory on its path) and commands are refused.

        Returns:
            The set-point; None while the arm does not follow.
        """
        if not (self.is_following or blocked) and measured is not None and begin is not None:
            self._core.reset(begin)
            self._gate.begin(BEGINS, self._clock())
            self.is_following, self._lost = True, ''
        if not self.is_following or measured is None:
            self._idle(Cycle(now, period, self._lost or blocked), measured, ages)
            return None
        if blocked and not self._lost:
            self._lost, code = (blocked, GoalCode.INVALID_GOAL) if explain is None else explain()
            self.interrupt(self._lost)
            self._core.fail(self._lost, code)
        cycle = Cycle(now, period, self._lost)
        if is_gone:
            self._idle(cycle, measured, ages)
            self.is_following, self._lost = False, ''
            return None
        self._carry_out(cycle)
        point = self._core.step(now, period, measured)
        self._publish(cycle, point, measured, ages)
        if self._lost and point.source is Source.NONE and not point.state.moving:
            self.is_following, self._lost = False, ''
        return point

    def abandon(self, now: float, reason: str) -> None:
        """End all commands after the cycle has failed; another cycle may never run."""
        self.is_following, self._lost = False, ''
        self.interrupt(reason)
        with self._lock:
            waiting, self._waiting = self._waiting, deque()
        for command in waiting:
            self._refuse(command, NotReadyError(reason))
        self._idle(Cycle(now, 0.0, reason), self.snapshot.measured, None)

    def _idle(self, cycle: Cycle, measured: RobotState | None, ages: Array | None) -> None:
        """Run a cycle in which the arm does not follow; refuse commands."""
        if self.snapshot.set_point is not None:
            self.interrupt(cycle.blocked)
        # what moved it ended at the latest when the arm came to rest
        self._core.abandon(cycle.blocked, measured)
        self._carry_out(cycle)
        self._publish(cycle, None, measured, ages)

    def _carry_out(self, cycle: Cycle) -> None:
        """Execute the orders that were queued at the start of the cycle."""
        for _ in range(len(self._orders)):
            self._orders.popleft()(cycle)

    def _publish(
        self,
        cycle: Cycle,
        point: SetPoint | None,
        measured: RobotState | None,
        ages: Array | None,
    ) -> None:
        """Publish the snapshot of the cycle and the outcomes of motions that have ended."""
        core, now, blocked = self._core, cycle.now, cycle.blocked
        self.snapshot = Snapshot(
            now, point, measured, blocked, core.paused, core.speed, ages, core.execution
        )
        for command in self._begun.copy():  # last: who sees the end finds what follows it
            if command.motion is not None and command.motion.outcome is not None:
                self._begun.remove(command)
                command.end(command.motion.outcome)

    def _check(self, source: Source, number: int) -> None:
        """Check that no later command or stop has superseded a command.

        Raises:
            NotReadyError: The command is superseded.
        """
        if reason := self._gate.refusal(source, number):
            raise NotReadyError(reason)

    def _admit(self, source: Source, number: int, since: float, cycle: Cycle) -> None:
        """Check that a motion is not superseded and that the arm can follow.

        Raises:
            NotReadyError: The motion is refused.
        """
        self._check(source, number)
        if cycle.blocked:
            self.refused = cycle.now
            raise NotReadyError(cycle.blocked)
        if (age := cycle.now - since) > MAX_CYCLE_AGE:
            raise NotReadyError(f'the cycle stood still for {age:.2f} s')

    def _rest(self) -> RobotState | None:
        """Return where the arm stands while it does not follow; None while it follows."""
        snapshot = self.snapshot
        return snapshot.reference if snapshot.blocked else None

    def _is_void(self, command: MotionCommand) -> bool:
        """Return whether a motion was canceled or stopped before its start."""
        return command.is_canceled or bool(self._gate.refusal(command.source, command.number))

    def _sum(
        self, request: DisplacementRequest, replaced: Sequence[MotionCommand]
    ) -> tuple[DisplacementRequest, MotionCommand | None]:
        """Add a displacement to those that it replaces; return the sum and the last one replaced.

        Raises:
            CommandError: The sum, added to the motion in preparation, exceeds the limits.
        """
        before = None
        for each in replaced:
            if not self._is_void(each):
                before, request = each, request.beyond(each.request)
        now, whole = self._preparing, request
        if now is not None and now.motion is None and not self._is_void(now):
            whole = request.beyond(now.request)
        with suppress(NotReadyError):  # where the arm is not known yet, that is refused later
            self._core.check_displacement(whole, self._rest())
        return request, before

    def _prepare_next(self) -> None:
        """Prepare the next motion, unless another one is still in preparation."""
        with self._lock:
            if self._preparing is not None or not self._waiting:
                return
            command = self._preparing = self._waiting.popleft()
        self._go_on(command, self._sequence(command))

    def _go_on(
        self, command: MotionCommand, sequence: MotionSequence, cycle: Cycle | None = None
    ) -> None:
        """Advance a motion until another thread must continue it."""
        try:
            if command.is_canceled:
                raise CancelledError  # noqa: TRY301
            turn = next(sequence) if cycle is None else sequence.send(cycle)
        except StopIteration:
            self._end(command)
        except (Exception, CancelledError) as error:  # noqa: BLE001  # its future carries it
            self._refuse(command, error)
        else:
            if turn is Turn.WORKER:
                self._worker.submit(self._go_on, command, sequence)
            else:
                self._orders.append(lambda cycle: self._go_on(command, sequence, cycle))

    def _sequence(self, command: MotionCommand) -> MotionSequence:
        """Prepare and start a motion; retry if the arm or the scene has changed."""
        rest = self._rest()
        if rest is not None:  # one that is refused from where the arm stands takes no drives
            basis = CommandBasis(rest, self._core.scene)
            yield Turn.WORKER
            self._core.plan(command.request, basis)
        self._check(command.source, command.number)
        if command.takes_drives:
            # check a new stream first: the cycle may be quicker
            self._gate.ask(command.source, command.stream, self._clock())
            if not self.get_ready():
                self._gate.ask(command.source, command.stream, -math.inf)
        for _ in range(MAX_ATTEMPTS - 1):
            with suppress(StateMovedError):
                return (yield from self._attempt(command))
        yield from self._attempt(command, is_last=True)

    def _attempt(self, command: MotionCommand, *, is_last: bool = False) -> MotionSequence:
        """Plan and check a motion from the state of one cycle, and start it in a later one."""
        ordered = self._clock()
        cycle = yield Turn.CYCLE
        self._admit(command.source, command.number, ordered, cycle)
        basis = self._core.basis
        yield Turn.WORKER
        request = command.request
        if isinstance(request, TrajectoryGoal) and self._needs_rest(request, basis):
            # a jog cannot be predicted for so long; a refused goal does not stop it
            here = replace(basis, state=RobotState.at_rest(basis.state.position))
            self._core.plan(_aged(request, cycle.now - command.requested), here)
            cycle = yield from self._wait_for_rest(command)
            basis = self._core.basis
            yield Turn.WORKER
        planned = cycle.now
        if isinstance(request, TrajectoryGoal):
            request, basis, planned = self._timed(command, request, basis, cycle)
        motion = self._core.plan(request, basis)
        self._check(command.source, command.number)  # no cycle may come that does
        ordered = max(self._clock(), planned)
        cycle = yield Turn.CYCLE
        while planned > cycle.now + 0.5 * cycle.period and not cycle.blocked:
            cycle = yield Turn.CYCLE
        self._admit(command.source, command.number, ordered, cycle)
        # a scene that changes all the time holds none up
        self._core.begin(motion, basis, cycle.now - planned, in_any_scene=is_last)
        command.motion = motion
        if basis.scene is not self._core.scene and command.execution is not None:
            self._recheck(command.execution)
        self._begun.append(command)
        # canceled in this moment: the order behind it stops it
        with suppress(InvalidStateError):
            command.future.set_result(command.execution)

    def _needs_rest(self, goal: TrajectoryGoal, basis: CommandBasis) -> bool:
        """Return whether preparation takes longer than the motion of the arm can be predicted."""
        is_foreseen = basis.source is Source.TRAJECTORY or _is_at_rest(basis)
        return not is_foreseen and _preparation_time(goal) > MAX_FORESIGHT

    def _wait_for_rest(self, command: MotionCommand) -> Generator[Turn, Cycle, Cycle]:
        """Bring the arm to rest for a trajectory; return the cycle in which it stands.

        A jog is held, not ended: it resumes if the trajectory is refused.
        """
        ordered = self._clock()
        cycle = yield Turn.CYCLE
        self._admit(command.source, command.number, ordered, cycle)
        self._core.hold()
        command.holds = True
        while not _is_at_rest(self._core.basis):
            if cycle.now - ordered > self._rest_timeout:
                raise NotReadyError(
                    'the arm does not come to rest for the trajectory; end the commands that'
                    ' jog it'
                )
            cycle = yield Turn.CYCLE
            self._admit(command.source, command.number, cycle.now, cycle)
        return cycle

    def _timed(
        self, command: MotionCommand, goal: TrajectoryGoal, basis: CommandBasis, cycle: Cycle
    ) -> tuple[TrajectoryGoal, CommandBasis, float]:
        """Return the goal to plan, the basis to plan from, and the steady start time in [s]."""
        if basis.source is not Source.TRAJECTORY:
            self._lag = 0.0
        if _is_at_rest(basis) and not goal.age:  # it may start at any time
            return goal, basis, cycle.now
        cycles = max(MIN_CYCLES_AHEAD, math.ceil(_preparation_time(goal) / cycle.period) + 1)
        ahead = cycles * cycle.period
        lag = cycle.now - command.requested + ahead
        if command.stream is not None and basis.source is Source.TRAJECTORY and not goal.age:
            goal = self._in_step(goal, lag, ahead)
        return _aged(goal, lag), basis.foreseen(ahead), cycle.now + ahead

    def _in_step(self, goal: TrajectoryGoal, lag: float, margin: float) -> TrajectoryGoal:
        """Delay a goal of a stream to the lag of the previous goals, which keeps the speed.

        The goals of a stream wait for different times until they can start. ``margin`` in [s]
        extends the lag, so that the arm has time to compensate for this jitter.
        """
        self._lag = max(self._lag, min(lag + margin, MAX_LAG))
        wait = max(self._lag - lag, 0.0)
        points = [
            replace(each, time=each.time + wait)
            if each.time > 0.0
            else each  # one of 0 has passed
            for each in goal.points
        ]
        return replace(goal, points=points)

    def _refuse(self, command: MotionCommand, error: BaseException) -> None:
        """End a motion that does not start; resume the jog that was held for it.

        Requeue the sum of displacements that the motion was added to.
        """
        if command.holds:
            self._orders.append(lambda _: self._core.hold(is_held=False))
        with suppress(InvalidStateError):  # canceled already
            if isinstance(error, CancelledError):
                command.future.cancel()
            else:
                command.future.set_exception(error)
        command.end(CANCELED if isinstance(error, CancelledError) else refused(error))
        before = command.before
        if before and isinstance(error, CommandError) and not isinstance(error, StateMovedError):
            with self._lock:
                self._waiting.appendleft(replace(before, future=Future(), ended=Future()))
        self._end(command)

    def _end(self, command: MotionCommand) -> None:
        """Finish preparing a motion, and prepare the next one."""
        with self._lock:
            if self._preparing is command:
                self._preparing = None
        self._prepare_next()

    def _recheck(self, execution: Execution) -> None:
        """Let the worker check the rest of a path in the present scene. Call in the cycle."""
        begin, scene = execution.feedback.time, self._core.scene

        def check() -> None:
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
            self._orders.append(
                lambda _: self._core.conclude_check(execution, scene, problem or '')
            )

        self._worker.submit(check)


def _is_at_rest(basis: CommandBasis) -> bool:
    return basis.source is Source.NONE and not basis.state.moving


def _aged(goal: TrajectoryGoal, elapsed: float) -> TrajectoryGoal:
    """Return a goal with its age increased by ``elapsed``; a goal without stamp is unchanged."""
    return replace(goal, age=goal.age + elapsed) if goal.age else goal


def _preparation_time(goal: TrajectoryGoal) -> float:
    """Return the longest time to prepare an unchecked goal in [s]."""
    last = goal.points[-1].time if goal.points else 0.0
    duration = last - goal.age if math.isfinite(last) else 0.0
    checked = min(max(duration, 0.0), MAX_CHECKED_DURATION)
    return (
        PREPARATION_TIME
        + PREPARATION_TIME_PER_POINT * len(goal.points)
        + PREPARATION_TIME_PER_SECOND * checked
    )
