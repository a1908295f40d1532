# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Where any thread gives commands to the motion core, and reads what it does.

Every motion goes the same way: it is requested in any thread, prepared beside the cycle from the
state that the cycle hands out, and committed in the cycle. A stop counts from the moment of the
call: whatever was requested before it is refused at every later step, so no stop is overtaken by
what was under way.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import (
    CancelledError,
    Executor,
    Future,
    InvalidStateError,
    ThreadPoolExecutor,
)
from contextlib import suppress
from dataclasses import dataclass, field, replace
from itertools import count
import math
import threading
import time
from typing import Any

from arm_model import ArmError, Array, RobotModel, RobotState
from arm_trajectory import GoalCode, StateMovedError, TrajectoryGoal

from ..exceptions import NotReadyError
from .arbiter import Motion
from .execution import Execution
from .motion_core import MotionCore
from .outcome import Outcome, refused
from .preparation import CommandBasis, Prepared
from .requests import ImmediateRequest, JogRequest, MotionRequest, PauseRequest, StopRequest
from .set_point import SetPoint, Source
from .snapshot import MAX_CYCLE_AGE, Snapshot

MAX_QUEUED_JOGS = 1000
"""Jog commands that may wait for the cycle."""

MAX_QUEUED_MOTIONS = 50
"""Motions that may wait to be prepared."""

PREPARATION_TIME = 5e-3
"""Time that preparing may take for any trajectory in [s]; see Preparation for the figures."""

PREPARATION_TIME_PER_POINT = 5e-4
"""Time that preparing may take for each point in [s]."""

PREPARATION_TIME_PER_SECOND = 5e-3
"""Time that looking for collisions may take for each second of the path in [s]."""

MAX_CHECKED_DURATION = 100.0
"""Part of a trajectory for whose check a begin in motion waits in [s]."""

MAX_FORESIGHT = 0.03
"""Time over which a jog or a single target is foreseen in [s]; later it may have turned."""

MIN_CYCLES_AHEAD = 3
"""Least cycles from the basis to the begin of a motion that is foreseen."""

MAX_ATTEMPTS = 3
"""How often a trajectory is prepared where others move the arm meanwhile."""

REST_TIMEOUT = 1.0
"""Time in which a jogged arm must come to rest for a trajectory in [s]."""

JOGGING = (Source.JOG, Source.TARGET)
"""What the servo commands."""

MOTIONS = (*JOGGING, Source.TRAJECTORY)

CANCELED = Outcome(GoalCode.SUCCESSFUL, 'canceled before it began', canceled=True)
NOTHING = Outcome(GoalCode.SUCCESSFUL, 'a displacement by nothing')


@dataclass(slots=True, eq=False)
class MotionCommand:
    """A motion from its request to its end.

    Attributes:
        request: What is asked.
        number: Its place among all commands and stops.
        requested: Steady time of the request in [s].
        future: Its execution, or None for a single target, once it began; else why it is refused.
        ended: How it ended, whatever became of it; set once, at the latest when the cycle fails.
        motion: What moves the arm for it, once it began.
    """

    request: MotionRequest
    number: int
    requested: float
    future: Future[Execution | None] = field(default_factory=Future)
    ended: Future[Outcome] = field(default_factory=Future)
    motion: Motion | None = None
    attempts: int = MAX_ATTEMPTS
    is_canceled: bool = False

    @property
    def execution(self) -> Execution | None:
        """The execution once a trajectory began."""
        return self.motion if isinstance(self.motion, Execution) else None

    def end(self, outcome: Outcome) -> None:
        """Note how it ended, unless that is known."""
        with suppress(InvalidStateError):
            self.ended.set_result(outcome)

    @property
    def source(self) -> Source:
        """What moves the arm then."""
        is_trajectory = isinstance(self.request, TrajectoryGoal)
        return Source.TRAJECTORY if is_trajectory else Source.TARGET


@dataclass(frozen=True, slots=True, eq=False)
class _Cycle:
    """What an order of the queue sees of its cycle."""

    now: float
    period: float
    blocked: str


_Order = Callable[[_Cycle], bool]
"""Carried out in a cycle; False for again in the next one."""


def start_worker() -> Executor:
    """Start the thread that prepares motions; the cycle hands over to it, and starts none."""
    worker = ThreadPoolExecutor(1, thread_name_prefix='motion preparation')
    worker.submit(lambda: None)  # an executor starts its thread with the first piece of work
    return worker


class CommandGateway:
    """Commands to one motion core from any thread, carried out by the thread that steps it.

    The commands and :attr:`snapshot`, :attr:`model` are for any thread; :meth:`begin`,
    :meth:`step`, :meth:`fail` and :meth:`idle` for the cycle. The kinematics of the core's model
    belong to the cycle too. Times are steady times in [s].

    Attributes:
        model: The arm.
        refused: When a motion was refused last, as the arm did not follow.
    """

    def __init__(
        self,
        core: MotionCore,
        worker: Executor,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Wait for the arm.

        Args:
            core: The core; from here on it is the gateway's.
            worker: Prepares motions, one after the other; see :func:`start_worker`.
            clock: Steady time, the one of the cycle.
        """
        self.model: RobotModel = core.model
        self.refused = -math.inf
        self._core = core
        self._clock = clock
        self._worker = worker
        self._orders: deque[_Order] = deque()
        self._snapshot = Snapshot(0.0, None, None, 'the cycle has not begun yet')
        self._begun: list[MotionCommand] = []  # of the cycle
        self._lock = threading.Lock()  # of the four below; held for a few instructions only
        self._numbers = count(1)
        self._void_up_to: dict[Source, tuple[int, str]] = dict.fromkeys(MOTIONS, (0, ''))
        self._waiting: deque[MotionCommand] = deque()
        self._preparing: MotionCommand | None = None

    @property
    def snapshot(self) -> Snapshot:
        """What the core did in the last cycle."""
        return self._snapshot

    def command(self, request: ImmediateRequest) -> Future[None]:
        """Have a jog, a stop, a pause or a speed override count from the next cycle on.

        A stop refuses from the moment of the call what was requested before it, a pause what jogs.

        Args:
            request: The request.

        Returns:
            Nothing once it counts; the ArmError with which it was refused.
        """
        future: Future[None] = Future()
        try:
            prepared = self._core.prepare(request)
            if isinstance(request, JogRequest) and len(self._orders) >= MAX_QUEUED_JOGS:
                raise NotReadyError(f'{MAX_QUEUED_JOGS} commands wait for the cycle')
        except ArmError as error:
            future.set_exception(error)
            return future
        with self._lock:
            number, since = next(self._numbers), self._clock()
        if isinstance(request, StopRequest):
            self._void(request.sources or MOTIONS, request.reason)
        elif isinstance(request, PauseRequest) and request.is_paused:
            self._void(JOGGING, 'the arm was paused')

        def commit(cycle: _Cycle) -> bool:
            try:
                if isinstance(request, JogRequest) and not self._core.ignores(request):
                    self._admit(Source.JOG, number, since, cycle)
                self._core.commit(prepared, cycle.now)
            except Exception as error:  # noqa: BLE001  # its future carries it
                future.set_exception(error)
                return True
            if isinstance(request, JogRequest) and not request.is_zero:
                # the newest command counts: older ones never begin
                self._void((Source.TARGET, Source.TRAJECTORY), 'a jog took over', number)
            future.set_result(None)
            return True

        self._orders.append(commit)
        return future

    def request(self, request: MotionRequest) -> MotionCommand:
        """Have a motion prepared, and begun when it is found to be clear.

        Args:
            request: What is asked.
        """
        with self._lock:
            command = MotionCommand(request, next(self._numbers), self._clock())
            is_full = len(self._waiting) >= MAX_QUEUED_MOTIONS
            if not is_full:
                self._waiting.append(command)
        if is_full:
            error = NotReadyError(
                f'{MAX_QUEUED_MOTIONS} motions wait already; send them more slowly'
            )
            self._refuse(command, error)
        self._prepare_next()
        return command

    def cancel(self, command: MotionCommand, reason: str) -> None:
        """End a motion: before its begin it does not begin, later the arm comes to rest.

        Args:
            command: The motion.
            reason: Why, for the outcome of a trajectory.
        """

        def stop(cycle: _Cycle) -> bool:
            if command.motion is not None:
                self._stop_now(StopRequest(reason, motion=command.motion), cycle)
            return True

        # the mark first: a commit that has missed it comes before the order
        command.is_canceled = True
        if command.future.cancel():
            command.end(CANCELED)
        self._orders.append(stop)

    def _stop_now(self, request: StopRequest, cycle: _Cycle) -> None:
        self._core.commit(self._core.prepare(request), cycle.now)

    def begin(self, positions: Array) -> None:
        """Begin to command the arm where it stands.

        Args:
            positions: Positions last commanded to the drives in [rad].
        """
        self._core.reset(positions)

    def step(
        self,
        now: float,
        period: float,
        measured: RobotState,
        blocked: str,
        ages: Array | None = None,
    ) -> SetPoint:
        """Carry out what was commanded, and return the set-point of this cycle.

        Args:
            now: Steady time.
            period: Time to the next cycle in [s].
            measured: Measured state.
            blocked: Why the arm comes to rest and takes no commands; empty when it does.
            ages: How old the measured values of each joint are in [s].
        """
        self._carry_out(_Cycle(now, period, blocked))
        set_point = self._core.step(now, period, measured)
        self._report_ends()
        self._snapshot = Snapshot(
            now,
            set_point,
            measured,
            blocked,
            set_point.source,
            self._core.paused,
            self._core.speed,
            self._snapshot.cycles + 1,
            period,
            self._core.execution,
            ages,
        )
        return set_point

    def fail(self, reason: str, code: GoalCode = GoalCode.INVALID_GOAL) -> None:
        """Bring the arm to rest, a trajectory on its path; the motion ends with the reason.

        Args:
            reason: What has gone wrong, and where.
            code: Code of the motion's outcome.
        """
        self._void(MOTIONS, reason)
        self._core.fail(reason, code)

    def idle(
        self, now: float, measured: RobotState | None, blocked: str, ages: Array | None = None
    ) -> None:
        """Pass a cycle in which the arm does not follow; commands are refused.

        Args:
            now: Steady time.
            measured: Measured state, when it is known.
            blocked: Why, with the remedy.
            ages: How old the measured values of each joint are in [s].
        """
        if self._snapshot.set_point is not None:
            self._void(MOTIONS, blocked)
        self._core.abandon(blocked)  # it ended at the latest when the arm came to rest
        self._report_ends()
        self._carry_out(_Cycle(now, self._snapshot.period, blocked))
        self._snapshot = Snapshot(
            now,
            None,
            measured,
            blocked,
            paused=self._core.paused,
            speed=self._core.speed,
            cycles=self._snapshot.cycles,
            ages=ages,
        )

    def abandon(self, now: float, reason: str) -> None:
        """End all that was commanded, for a cycle that has failed: none may follow.

        Args:
            now: Steady time.
            reason: What has failed, with the remedy.
        """
        self._void(MOTIONS, reason)
        with self._lock:  # their turn does not come
            waiting, self._waiting = self._waiting, deque()
        for command in waiting:
            self._refuse(command, NotReadyError(reason))
        self.idle(now, self._snapshot.measured, reason)

    def _void(self, sources: Iterable[Source], reason: str, number: int | None = None) -> None:
        """Refuse what was requested for some sources before a number; by default so far."""
        with self._lock:
            number = next(self._numbers) if number is None else number
            for source in sources:
                if self._void_up_to[source][0] < number:
                    self._void_up_to[source] = number, reason

    def _check_void(self, source: Source, number: int) -> None:
        """Refuse what another command or a stop has made void."""
        up_to, reason = self._void_up_to[source]
        if number < up_to:
            raise NotReadyError(f'stopped before it had begun: {reason}')

    def _report_ends(self) -> None:
        """Report how motions have ended."""
        for command in self._begun.copy():
            if command.motion is None or command.motion.outcome is not None:
                self._begun.remove(command)
                command.end((command.motion and command.motion.outcome) or NOTHING)

    def _carry_out(self, cycle: _Cycle) -> None:
        for _ in range(len(self._orders)):
            order = self._orders.popleft()
            if not order(cycle):
                self._orders.append(order)

    def _admit(self, source: Source, number: int, since: float, cycle: _Cycle) -> None:
        """Refuse a motion that is void before it began, or that the arm cannot follow."""
        self._check_void(source, number)
        if cycle.blocked:
            self.refused = cycle.now
            raise NotReadyError(cycle.blocked)
        if (age := cycle.now - since) > MAX_CYCLE_AGE:
            raise NotReadyError(f'the cycle stood still for {age:.2f} s')

    def _prepare_next(self) -> None:
        """Begin with the next motion, once the one before has begun or was refused."""
        with self._lock:
            if self._preparing is not None or not self._waiting:
                return
            command = self._preparing = self._waiting.popleft()
        self._order_basis(command)

    def _order_basis(self, command: MotionCommand) -> None:
        ordered = self._clock()

        def hand_out(cycle: _Cycle) -> bool:
            self._guarded(command, lambda: self._hand_out(command, ordered, cycle))
            return True

        self._orders.append(hand_out)

    def _hand_out(self, command: MotionCommand, since: float, cycle: _Cycle) -> None:
        """Have a motion prepared from the state of this cycle."""
        self._admit(command.source, command.number, since, cycle)
        basis = self._core.basis
        self._worker.submit(
            lambda: self._guarded(command, lambda: self._prepare(command, basis, cycle))
        )

    def _prepare(self, command: MotionCommand, basis: CommandBasis, cycle: _Cycle) -> None:
        """Plan and check a motion; in the worker's thread."""
        request = command.request
        if not isinstance(request, TrajectoryGoal):
            self._order_commit(command, self._core.prepare(request, basis), cycle.now)
            return
        elapsed = cycle.now - command.requested
        at_rest = not basis.state.moving and basis.source is Source.NONE
        if at_rest and not request.age:  # it begins whenever it begins
            self._order_commit(command, self._core.prepare(request, basis), cycle.now)
            return
        needed = _preparation_time(request)
        if not at_rest and basis.source is not Source.TRAJECTORY and needed > MAX_FORESIGHT:
            # nobody can foresee a jog for so long; a goal that is refused does not stop it
            rest = replace(basis, state=RobotState.at_rest(basis.state.position))
            self._core.prepare(_aged(request, elapsed), rest)
            self._order_rest(command)
            return
        cycles = max(MIN_CYCLES_AHEAD, math.ceil(needed / cycle.period) + 1)
        ahead = cycles * cycle.period
        prepared = self._core.prepare(_aged(request, elapsed + ahead), basis.foreseen(ahead))
        self._order_commit(command, prepared, cycle.now + ahead)

    def _order_rest(self, command: MotionCommand) -> None:
        """Bring the arm to rest for a trajectory, and prepare it from there."""
        ordered = self._clock()
        is_stopped = False

        def rest(cycle: _Cycle) -> bool:
            nonlocal is_stopped
            since = cycle.now if is_stopped else ordered
            if not self._guarded(
                command,
                lambda: self._admit(command.source, command.number, since, cycle),
            ):
                return True
            if not is_stopped:
                self._stop_now(StopRequest('a trajectory takes over'), cycle)
                is_stopped = True
            if self._core.source is Source.NONE and not self._core.state.moving:
                self._guarded(command, lambda: self._hand_out(command, cycle.now, cycle))
                return True
            if cycle.now - ordered <= REST_TIMEOUT:
                return False
            self._refuse(
                command,
                NotReadyError(
                    'the arm does not come to rest for the trajectory; end the commands that'
                    ' jog it'
                ),
            )
            return True

        self._orders.append(rest)

    def _order_commit(self, command: MotionCommand, prepared: Prepared, planned: float) -> None:
        """Have a motion begin at the time for which it was planned, or as soon as can be."""
        self._check_void(command.source, command.number)  # no cycle may come that does
        ordered = max(self._clock(), planned)

        def begin(cycle: _Cycle) -> None:
            self._admit(command.source, command.number, ordered, cycle)
            self._core.commit(prepared, cycle.now, cycle.now - planned)
            command.motion = prepared.motion
            self._begun.append(command)
            # canceled in this moment: the order behind it stops it
            with suppress(InvalidStateError):
                command.future.set_result(command.execution)

        def commit(cycle: _Cycle) -> bool:
            if planned > cycle.now + 0.5 * cycle.period and not cycle.blocked:
                return False
            if self._guarded(command, lambda: begin(cycle)):
                self._end(command)
            return True

        self._orders.append(commit)

    def _guarded(self, command: MotionCommand, step: Callable[[], Any]) -> bool:
        """Take a step of a motion; return whether it was not refused."""
        try:
            if command.is_canceled:
                raise CancelledError  # noqa: TRY301
            step()
        except StateMovedError as error:
            command.attempts -= 1
            if command.attempts > 0:
                self._order_basis(command)
            else:
                self._refuse(command, error)
            return False
        except (Exception, CancelledError) as error:  # noqa: BLE001  # its future carries it
            self._refuse(command, error)
            return False
        return True

    def _refuse(self, command: MotionCommand, error: BaseException) -> None:
        """End a motion that does not begin."""
        with suppress(InvalidStateError):  # canceled already
            if isinstance(error, CancelledError):
                command.future.cancel()
            else:
                command.future.set_exception(error)
        command.end(CANCELED if isinstance(error, CancelledError) else refused(error))
        self._end(command)

    def _end(self, command: MotionCommand) -> None:
        """Go on to the next motion."""
        with self._lock:
            if self._preparing is command:
                self._preparing = None
        self._prepare_next()


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
