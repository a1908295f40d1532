# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Motions from their request to their end: prepared one after the other, begun in the cycle."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Hashable
from concurrent.futures import CancelledError, Executor, Future, InvalidStateError
from contextlib import suppress
from dataclasses import dataclass, field, replace
import math
import threading
from typing import Any

from arm_model import ArmError, CommandError, RobotState
from arm_trajectory import GoalCode, StateMovedError, TrajectoryGoal

from ..controllers.controller import NotReadyError, Outcome, refused, Source
from ..controllers.trajectory import Execution
from .mailbox import Cycle, DisplacementRequest, Mailbox, MotionRequest, StopRequest
from .motion_core import MotionCore
from .preparation import CommandBasis, Motion

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


@dataclass(slots=True, eq=False)
class MotionCommand:
    """A motion from its request to its end."""

    request: MotionRequest  # what is asked
    number: int  # its place among all commands and stops
    requested: float  # steady time of the request in [s]
    get_ready: Callable[[], object] = lambda: None  # gets the drives back
    stream: Hashable = None  # where each newer one replaces those that wait; None for nowhere
    # the sum of displacements that it added to, which counts where this one is refused
    before: MotionCommand | None = None
    # its execution, or None for a single target, once it began; else why it is refused
    future: Future[Execution | None] = field(default_factory=Future)
    # how it ended, whatever became of it; set once, at the latest when the cycle fails
    ended: Future[Outcome] = field(default_factory=Future)
    motion: Motion | None = None  # what moves the arm for it, once it began
    attempts: int = MAX_ATTEMPTS  # how often it may still be prepared
    is_canceled: bool = False  # whether it is to begin no more
    holds: bool = False  # whether a jog or a target is held for it

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


class MotionQueue:
    """Prepares motions in the worker, and has them begin in the cycle.

    :meth:`request` and :meth:`cancel` are for any thread, :meth:`report_ends` and :meth:`clear`
    for the cycle.
    """

    def __init__(
        self,
        core: MotionCore,
        mailbox: Mailbox,
        worker: Executor,
        clock: Callable[[], float],
        *,
        # where the arm stands while others have its drives: from there a motion is tried before
        # the drives are taken from them; None where the arm follows
        rest: Callable[[], RobotState | None],
        # has a trajectory checked in the present scene that was prepared in an old one
        recheck: Callable[[Execution], None],
    ) -> None:
        self._core, self._mailbox = core, mailbox
        self._worker, self._clock, self._rest, self._recheck = worker, clock, rest, recheck
        limits = core.model.limits
        braking = limits.velocity / limits.acceleration + limits.acceleration / limits.jerk
        self._rest_timeout = REST_MARGIN + float(braking.max())
        self._begun: list[MotionCommand] = []  # of the cycle
        self._lock = threading.Lock()  # of the two below; held for a few instructions only
        self._waiting: deque[MotionCommand] = deque()
        self._preparing: MotionCommand | None = None
        self._lag = 0.0  # from the requests of a stream to their motion in [s]; of the worker

    def request(
        self,
        request: MotionRequest,
        get_ready: Callable[[], object] = lambda: None,
        number: int | None = None,
        stream: Hashable = None,
    ) -> MotionCommand:
        """Prepare a motion, and begin it when its path is clear.

        Args:
            get_ready: Gets back drives that others have, where the arm does not follow; called in
                any thread, and only for a motion that is not refused from where the arm stands.
            number: Its place among all commands and stops, where it came before; by default it
                comes now.
            stream: Where it comes from, if it replaces those from there that wait. Displacements
                add up; one that would lead a sum beyond limits is refused alone.
        """
        error: ArmError | None = None
        before: MotionCommand | None = None
        with self._lock:
            number = self._mailbox.gate.number() if number is None else number
            replaced = [each for each in self._waiting if stream and each.stream == stream]
            try:
                for each in replaced:
                    if isinstance(request, DisplacementRequest) and not self._is_void(each):
                        before = each.before if request.is_zero else each
                        get_ready = each.get_ready if request.is_zero else get_ready
                        request = request.beyond(each.request)
                if isinstance(request, DisplacementRequest) and stream:
                    self._check_displacement(request)
            except ArmError as refusal:
                error, replaced, before = refusal, [], None
            for each in replaced:
                self._waiting.remove(each)
            command = MotionCommand(request, number, self._clock(), get_ready, stream, before)
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

        def stop(cycle: Cycle) -> bool:
            if command.motion is not None:
                self._core.apply(StopRequest(reason, motion=command.motion), cycle.now)
            return True

        # the mark first: a commit that has missed it comes before the order
        command.is_canceled = True
        if command.future.cancel():
            command.end(CANCELED)
        self._mailbox.post(stop)

    def clear(self, reason: str) -> None:
        """Refuse all that waits, for a cycle that has failed: its turn does not come."""
        with self._lock:
            waiting, self._waiting = self._waiting, deque()
        for command in waiting:
            self._refuse(command, NotReadyError(reason))

    def report_ends(self) -> None:
        """Report how motions have ended."""
        for command in self._begun.copy():
            if command.motion is None or command.motion.outcome is not None:
                self._begun.remove(command)
                command.end((command.motion and command.motion.outcome) or NOTHING)

    def _is_void(self, command: MotionCommand) -> bool:
        """Return whether a motion was canceled or stopped before its begin."""
        return command.is_canceled or bool(
            self._mailbox.gate.refusal(command.source, command.number)
        )

    def _check_displacement(self, request: DisplacementRequest) -> None:
        """Check that it stays within limits, behind the one that is being prepared.

        Raises:
            CommandError: It leads beyond them.
        """
        if request.is_zero:
            return
        now = self._preparing
        if now is not None and now.motion is None and not self._is_void(now):
            request = request.beyond(now.request)
        with suppress(NotReadyError):  # where the arm is not known yet, that is refused later
            self._core.check_displacement(request, self._rest())

    def _prepare_next(self) -> None:
        """Begin with the next motion, once the one before has begun or was refused."""
        with self._lock:
            if self._preparing is not None or not self._waiting:
                return
            command = self._preparing = self._waiting.popleft()
        rest = self._rest()
        if rest is None:
            self._get_ready(command)
        else:
            basis = CommandBasis(rest, self._core.scene)
            self._submit(command, lambda: self._try_out(command, basis))

    def _submit(self, command: MotionCommand, step: Callable[[], None]) -> None:
        self._worker.submit(lambda: self._guarded(command, step))

    def _try_out(self, command: MotionCommand, basis: CommandBasis) -> None:
        """Prepare a motion from where the arm stands: one that is refused takes no drives."""
        self._core.plan(command.request, basis)
        self._get_ready(command)

    def _get_ready(self, command: MotionCommand) -> None:
        """Get the drives back for a motion, unless it is void already."""

        def get_ready() -> None:
            self._mailbox.check(command.source, command.number)
            command.get_ready()

        if self._guarded(command, get_ready):
            self._order_basis(command)

    def _order_basis(self, command: MotionCommand) -> None:
        ordered = self._clock()

        def hand_out(cycle: Cycle) -> bool:
            self._guarded(command, lambda: self._hand_out(command, ordered, cycle))
            return True

        self._mailbox.post(hand_out)

    def _hand_out(self, command: MotionCommand, since: float, cycle: Cycle) -> None:
        """Prepare a motion from the state of this cycle."""
        self._mailbox.admit(command.source, command.number, since, cycle)
        basis = self._core.basis
        self._submit(command, lambda: self._prepare(command, basis, cycle))

    def _prepare(self, command: MotionCommand, basis: CommandBasis, cycle: Cycle) -> None:
        """Plan and check a motion; in the worker's thread."""
        request = command.request
        if not isinstance(request, TrajectoryGoal):
            self._order_begin(command, basis, self._core.plan(request, basis), cycle.now)
            return
        elapsed = cycle.now - command.requested
        at_rest = not basis.state.moving and basis.source is Source.NONE
        if basis.source is not Source.TRAJECTORY:
            self._lag = 0.0
        if at_rest and not request.age:  # it begins whenever it begins
            self._order_begin(command, basis, self._core.plan(request, basis), cycle.now)
            return
        needed = _preparation_time(request)
        if not at_rest and basis.source is not Source.TRAJECTORY and needed > MAX_FORESIGHT:
            # a jog cannot be foreseen for so long; a goal that is refused does not stop it
            rest = replace(basis, state=RobotState.at_rest(basis.state.position))
            self._core.plan(_aged(request, elapsed), rest)
            self._order_rest(command)
            return
        cycles = max(MIN_CYCLES_AHEAD, math.ceil(needed / cycle.period) + 1)
        ahead = cycles * cycle.period
        if command.stream is not None and basis.source is Source.TRAJECTORY and not request.age:
            request = self._in_step(request, elapsed + ahead, ahead)
        basis = basis.foreseen(ahead)
        motion = self._core.plan(_aged(request, elapsed + ahead), basis)
        self._order_begin(command, basis, motion, cycle.now + ahead)

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

    def _order_rest(self, command: MotionCommand) -> None:
        """Bring the arm to rest for a trajectory, and prepare it from there.

        A jog is held, not ended: it goes on where the trajectory is refused after all.
        """
        ordered = self._clock()

        def rest(cycle: Cycle) -> bool:
            since = cycle.now if command.holds else ordered
            if not self._guarded(
                command, lambda: self._mailbox.admit(command.source, command.number, since, cycle)
            ):
                return True
            if not command.holds:
                self._core.hold()
                command.holds = True
            if self._core.basis.source is Source.NONE and not self._core.state.moving:
                self._guarded(command, lambda: self._hand_out(command, cycle.now, cycle))
                return True
            if cycle.now - ordered <= self._rest_timeout:
                return False
            self._refuse(
                command,
                NotReadyError(
                    'the arm does not come to rest for the trajectory; end the commands that'
                    ' jog it'
                ),
            )
            return True

        self._mailbox.post(rest)

    def _order_begin(
        self, command: MotionCommand, basis: CommandBasis, motion: Motion | None, planned: float
    ) -> None:
        """Begin a motion at the time for which it was planned, or as soon as possible."""
        self._mailbox.check(command.source, command.number)  # no cycle may come that does
        ordered = max(self._clock(), planned)

        def begin(cycle: Cycle) -> None:
            self._mailbox.admit(command.source, command.number, ordered, cycle)
            if motion is not None:  # a scene that changes all the time holds none up
                late, again = cycle.now - planned, command.attempts == 1
                self._core.begin(motion, basis, late, in_any_scene=again)
            command.motion = motion
            if basis.scene is not self._core.scene and command.execution is not None:
                self._recheck(command.execution)
            self._begun.append(command)
            # canceled in this moment: the order behind it stops it
            with suppress(InvalidStateError):
                command.future.set_result(command.execution)

        def commit(cycle: Cycle) -> bool:
            if planned > cycle.now + 0.5 * cycle.period and not cycle.blocked:
                return False
            if self._guarded(command, lambda: begin(cycle)):
                self._end(command)
            return True

        self._mailbox.post(commit)

    def _guarded(self, command: MotionCommand, step: Callable[[], Any]) -> bool:
        """Run a step of a motion; return whether it was accepted."""
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
        """End a motion that does not begin; a jog that was held for it goes on.

        So does the sum of displacements that it added to.
        """

        def go_on(_cycle: Cycle) -> bool:
            self._core.hold(is_held=False)
            return True

        if command.holds:
            self._mailbox.post(go_on)
        with suppress(InvalidStateError):  # canceled already
            if isinstance(error, CancelledError):
                command.future.cancel()
            else:
                command.future.set_exception(error)
        command.end(CANCELED if isinstance(error, CancelledError) else refused(error))
        each = command.before
        if each and isinstance(error, CommandError) and not isinstance(error, StateMovedError):
            with self._lock:
                self._waiting.appendleft(
                    MotionCommand(
                        each.request,
                        each.number,
                        each.requested,
                        each.get_ready,
                        each.stream,
                        each.before,
                    )
                )
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
