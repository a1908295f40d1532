# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Where any thread gives commands to the motion core, and reads what it does.

One mailbox leads to the cycle, and every command takes a number when it is requested. A stop
counts from the moment of the call: whatever was requested before it is refused at every later
step, so no stop is overtaken by what was under way.

Every motion goes the same way: it is requested in any thread, prepared beside the cycle from the
state that the cycle hands out, and begun in the cycle.
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
"""Time that preparing may take for any trajectory in [s]; see Preparation for the figures."""

PREPARATION_TIME_PER_POINT = 5e-4  # time that preparing may take for each point in [s]

PREPARATION_TIME_PER_SECOND = 5e-3
"""Time that looking for collisions may take for each second of the path in [s]."""

MAX_CHECKED_DURATION = 100.0  # part of a trajectory for whose check a begin in motion waits in [s]

MAX_FORESIGHT = 0.03
"""Time over which a jog or a single target is foreseen in [s]; later it may have turned."""

MIN_CYCLES_AHEAD = 3  # least cycles from the basis to the begin of a motion that is foreseen

MAX_ATTEMPTS = 3
"""How often a motion is prepared where others move the arm, or the scene changes, meanwhile."""

REST_MARGIN = 1.0
"""How much longer than it brakes from full speed a jogged arm may take to come to rest for a
trajectory in [s]."""

MAX_LAG = 0.1  # longest lag to which a trajectory of a stream is delayed in [s]

CANCELED = Outcome(GoalCode.SUCCESSFUL, 'canceled before it began', canceled=True)
NOTHING = Outcome(GoalCode.SUCCESSFUL, 'a displacement by nothing')

BEGINS = 'the arm has just begun to follow'

TOGETHER = 1.0
"""Trajectories of a topic that follow each other within so many [s] are a stream; so long it has
to be silent before it can be let in again."""

GONE_AFTER = 10.0  # silence after which who had to let go has done so in [s]

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
"""Clients that send streams: those that jog, and the topic of trajectories."""

Loss = tuple[str, GoalCode]  # why an arm that followed does not go on, and the code of its motion


@dataclass(frozen=True, slots=True, eq=False)
class Cycle:
    """What an order sees of its cycle."""

    now: float  # steady time in [s]
    period: float  # time to the next cycle in [s]
    blocked: str  # why the arm takes no commands; empty when it does


class Turn(Enum):
    """Where the way of a motion goes on."""

    CYCLE = 'in the next cycle'
    WORKER = 'in the thread that plans and checks'


MotionSequence = Generator[Turn, Cycle, None]
"""The steps of a motion to its begin. It yields where it goes on, and gets the cycle there."""


@dataclass(slots=True, eq=False)
class MotionCommand:
    """A motion from its request to its end."""

    request: MotionRequest  # what is asked
    number: int  # its place among all commands and stops
    requested: float  # steady time of the request in [s]
    stream: Hashable = None  # where each newer one replaces those that wait; None for nowhere
    # the sum of displacements that it added to, which counts where this one is refused
    before: MotionCommand | None = None
    takes_drives: bool = True  # whether it gets back drives that others have
    # its execution, or None for a single target, once it began; else why it is refused
    future: Future[Execution | None] = field(default_factory=Future)
    # how it ended, whatever became of it; set once, at the latest when the cycle fails
    ended: Future[Outcome] = field(default_factory=Future)
    motion: Motion | None = None  # what moves the arm for it, once it began
    is_canceled: bool = False  # whether it is to begin no more
    holds: bool = False  # whether a jog or a target is held for it

    @property
    def execution(self) -> Execution | None:
        """The execution once a trajectory began."""
        return self.motion if isinstance(self.motion, Execution) else None

    @property
    def source(self) -> Source:
        """What moves the arm then."""
        is_trajectory = isinstance(self.request, TrajectoryGoal)
        return Source.TRAJECTORY if is_trajectory else Source.TARGET

    def end(self, outcome: Outcome) -> None:
        """Note how it ended, unless that is known."""
        with suppress(InvalidStateError):
            self.ended.set_result(outcome)


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

        A stop refuses from the moment of the call what was requested before it, a pause what jogs.

        Returns:
            Nothing once it counts; the ArmError with which it was refused.
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
        """Prepare a motion, and begin it when its path is clear.

        Args:
            number: Its place among all commands and stops, where it came before; by default it
                comes now.
            stream: Where it comes from, if it replaces those from there that wait. Displacements
                add up; one that would lead a sum beyond limits is refused alone.
            takes_drives: Whether it gets back drives that others have, where the arm does not
                follow; one that is refused from where the arm stands takes none.
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

    def cancel(self, command: MotionCommand, reason: str) -> None:
        """End a motion: before its begin it does not begin, later the arm comes to rest."""

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
        """Record a command of a client that may send one after the other.

        Raises:
            NotReadyError: The arm has stopped since the client began; it has to let go first.
        """
        if is_zero:
            self._gate.release(source, client)
        elif reason := self._gate.command(source, client, self._clock(), expires):
            raise NotReadyError(reason)

    def renew(self, source: Source) -> None:
        """Treat the next command as a new one: a person has requested it.

        A stream of trajectories that goes on is not let in by that.
        """
        silence = TOGETHER if source is Source.TRAJECTORY else -math.inf
        self._gate.renew(source, self._clock(), silence)

    def interrupt(self, reason: str) -> None:
        """Refuse what was requested so far and has not begun, and end the streams of clients."""
        self._gate.interrupt(reason, self._clock())

    def use_scene(self, scene: PlanningScene) -> None:
        """Use another scene from the next cycle on, for jogs, targets and trajectories.

        It is measured here, beside the cycle, which takes some milliseconds for 100 objects. A
        trajectory under way is checked again, and ends on its path where it would collide.

        Raises:
            SceneError: The scene is of another arm.
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
        """End all that was commanded, for a cycle that has failed: none may follow."""
        self.is_following, self._lost = False, ''
        self.interrupt(reason)
        with self._lock:
            waiting, self._waiting = self._waiting, deque()
        for command in waiting:
            self._refuse(command, NotReadyError(reason))
        self._idle(Cycle(now, 0.0, reason), self.snapshot.measured, None)

    def _idle(self, cycle: Cycle, measured: RobotState | None, ages: Array | None) -> None:
        """Pass a cycle in which the arm does not follow; commands are refused."""
        if self.snapshot.set_point is not None:
            self.interrupt(cycle.blocked)
        # what moved it ended at the latest when the arm came to rest
        self._core.abandon(cycle.blocked, measured)
        self._carry_out(cycle)
        self._publish(cycle, None, measured, ages)

    def _carry_out(self, cycle: Cycle) -> None:
        """Carry out the orders that were there at the begin of the cycle."""
        for _ in range(len(self._orders)):
            self._orders.popleft()(cycle)

    def _publish(
        self,
        cycle: Cycle,
        point: SetPoint | None,
        measured: RobotState | None,
        ages: Array | None,
    ) -> None:
        """Report how motions have ended, and what was done in a cycle."""
        core, now, blocked = self._core, cycle.now, cycle.blocked
        self.snapshot = Snapshot(
            now, point, measured, blocked, core.paused, core.speed, ages, core.execution
        )
        for command in self._begun.copy():  # last: who sees the end finds what follows it
            if command.motion is not None and command.motion.outcome is not None:
                self._begun.remove(command)
                command.end(command.motion.outcome)

    def _check(self, source: Source, number: int) -> None:
        """Refuse what another command or a stop has made void.

        Raises:
            NotReadyError: It is void.
        """
        if reason := self._gate.refusal(source, number):
            raise NotReadyError(reason)

    def _admit(self, source: Source, number: int, since: float, cycle: Cycle) -> None:
        """Refuse a motion that is void before it began, or that the arm cannot follow.

        Raises:
            NotReadyError: It is refused.
        """
        self._check(source, number)
        if cycle.blocked:
            self.refused = cycle.now
            raise NotReadyError(cycle.blocked)
        if (age := cycle.now - since) > MAX_CYCLE_AGE:
            raise NotReadyError(f'the cycle stood still for {age:.2f} s')

    def _rest(self) -> RobotState | None:
        """Return where the arm stands while others have its drives; None where it follows."""
        snapshot = self.snapshot
        return snapshot.reference if snapshot.blocked else None

    def _is_void(self, command: MotionCommand) -> bool:
        """Return whether a motion was canceled or stopped before its begin."""
        return command.is_canceled or bool(self._gate.refusal(command.source, command.number))

    def _sum(
        self, request: DisplacementRequest, replaced: Sequence[MotionCommand]
    ) -> tuple[DisplacementRequest, MotionCommand | None]:
        """Add a displacement to those that it replaces; return the last of them, too.

        Raises:
            CommandError: The sum, behind what is being prepared, leads beyond limits.
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
        """Begin with the next motion, once the one before has begun or was refused."""
        with self._lock:
            if self._preparing is not None or not self._waiting:
                return
            command = self._preparing = self._waiting.popleft()
        self._go_on(command, self._sequence(command))

    def _go_on(
        self, command: MotionCommand, sequence: MotionSequence, cycle: Cycle | None = None
    ) -> None:
        """Go on with a motion, up to where another thread has its turn."""
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
        """Prepare a motion, and begin it; again where the arm or the scene has changed."""
        rest = self._rest()
        if rest is not None:  # one that is refused from where the arm stands takes no drives
            basis = CommandBasis(rest, self._core.scene)
            yield Turn.WORKER
            self._core.plan(command.request, basis)
        self._check(command.source, command.number)
        if command.takes_drives:
            # a stream that begins asks first: the cycle may be quicker
            self._gate.ask(command.source, command.stream, self._clock())
            if not self.get_ready():
                self._gate.ask(command.source, command.stream, -math.inf)
        for _ in range(MAX_ATTEMPTS - 1):
            with suppress(StateMovedError):
                return (yield from self._attempt(command))
        yield from self._attempt(command, is_last=True)

    def _attempt(self, command: MotionCommand, *, is_last: bool = False) -> MotionSequence:
        """Plan and check a motion from the state of a cycle, and begin it in a later one."""
        ordered = self._clock()
        cycle = yield Turn.CYCLE
        self._admit(command.source, command.number, ordered, cycle)
        basis = self._core.basis
        yield Turn.WORKER
        request = command.request
        if isinstance(request, TrajectoryGoal) and self._needs_rest(request, basis):
            # a jog cannot be foreseen for so long; a goal that is refused does not stop it
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
        """Return whether the arm cannot be foreseen while a trajectory is prepared."""
        is_foreseen = basis.source is Source.TRAJECTORY or _is_at_rest(basis)
        return not is_foreseen and _preparation_time(goal) > MAX_FORESIGHT

    def _wait_for_rest(self, command: MotionCommand) -> Generator[Turn, Cycle, Cycle]:
        """Bring the arm to rest for a trajectory; return the cycle in which it stands.

        A jog is held, not ended: it goes on where the trajectory is refused after all.
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
        """Return what is planned of a trajectory, from where, and when that begins in [s]."""
        if basis.source is not Source.TRAJECTORY:
            self._lag = 0.0
        if _is_at_rest(basis) and not goal.age:  # it begins whenever it begins
            return goal, basis, cycle.now
        cycles = max(MIN_CYCLES_AHEAD, math.ceil(_preparation_time(goal) / cycle.period) + 1)
        ahead = cycles * cycle.period
        lag = cycle.now - command.requested + ahead
        if command.stream is not None and basis.source is Source.TRAJECTORY and not goal.age:
            goal = self._in_step(goal, lag, ahead)
        return _aged(goal, lag), basis.foreseen(ahead), cycle.now + ahead

    def _in_step(self, goal: TrajectoryGoal, lag: float, margin: float) -> TrajectoryGoal:
        """Delay a goal of a stream to the lag of those before it, which keeps the speed.

        Each waits for another time until it can begin. Without a margin in [s], by which the lag
        is longer, the arm would have no time to correct what the times of arrival differ by.
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
        """End a motion that does not begin; a jog that was held for it goes on.

        So does the sum of displacements that it added to.
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
        """Go on to the next motion."""
        with self._lock:
            if self._preparing is command:
                self._preparing = None
        self._prepare_next()

    def _recheck(self, execution: Execution) -> None:
        """Check the rest of a path in the present scene, in the worker's thread; for the cycle."""
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
    """Return a goal some time later; one without a stamp begins whenever it begins."""
    return replace(goal, age=goal.age + elapsed) if goal.age else goal


def _preparation_time(goal: TrajectoryGoal) -> float:
    """Return how long it takes at most to prepare a goal in [s]; it is not checked yet."""
    last = goal.points[-1].time if goal.points else 0.0
    duration = last - goal.age if math.isfinite(last) else 0.0
    checked = min(max(duration, 0.0), MAX_CHECKED_DURATION)
    return (
        PREPARATION_TIME
        + PREPARATION_TIME_PER_POINT * len(goal.points)
        + PREPARATION_TIME_PER_SECOND * checked
    )
