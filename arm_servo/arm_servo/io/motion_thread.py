# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The motion core in a thread of its own, for drives that are commanded over topics."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
import math
import threading
import time

import numpy as np

from arm_model import Array, frozen, RobotState
from arm_trajectory import GoalCode, hard_brake
from realtime_loop import CycleTimer
from robot_primitives import JointSample, JointStateStore

from ..controllers.controller import SetPoint, Source
from ..core.gateway import CommandGateway
from ..report import MotionReport
from .following import FollowingWatch

RESYNC_SILENCE = 0.3
"""Silence of all clients in [s] after which an arm that did not follow accepts commands."""

STOP_TIMEOUT = 3.0  # longest time for the arm to come to rest at the end of the program in [s]


class JointFeedback(JointStateStore):
    """The measured state of an arm, of joint states that name some of its joints.

    :meth:`receive` is for one thread, :meth:`state` for any.
    """

    def __init__(self, joints: Sequence[str], timeout: float) -> None:
        """Begin empty; a position counts no more at the age of the time-out in [s]."""
        super().__init__(joints)
        self._order, self._timeout = list(joints), timeout

    @property
    def time(self) -> float:
        """Steady time since which every joint was received in [s]."""
        return min(-math.inf if each is None else each.time for each in self._latest())

    def state(self, now: float) -> tuple[RobotState | None, str]:
        """Return the measured state, None before it is whole; and why it is no good."""
        latest, blocked = self._latest(), ''
        silent = [
            joint
            for joint, each in zip(self._order, latest, strict=True)
            if each is None or now - each.time > self._timeout
        ]
        if silent:
            blocked = (
                f'no joint states of {", ".join(silent)} for {self._timeout:g} s;'
                ' does their driver run, and publish finite numbers?'
            )
        whole = [each for each in latest if each is not None]
        if len(whole) < len(latest):
            return None, blocked
        speeds = [each.velocity if math.isfinite(each.velocity) else 0.0 for each in whole]
        measured = RobotState(
            frozen([each.position for each in whole]), frozen(speeds), np.zeros(len(whole))
        )
        return measured, blocked

    def _latest(self) -> list[JointSample | None]:
        return [self.sample(joint) for joint in self._order]


class MotionCycle:
    """What is done in a cycle; reads no clock.

    Attributes:
        closing: Why the arm comes to rest for good; empty before the end.
    """

    def __init__(
        self,
        gateway: CommandGateway,
        feedback: JointFeedback,
        output: Callable[[SetPoint], None],
        watch: FollowingWatch,
    ) -> None:
        """Wait for the arm.

        Args:
            output: Takes the set-points while something moves, and the last at rest.
        """
        self._gateway, self._feedback, self._output = gateway, feedback, output
        self._state = RobotState.at_rest(np.zeros(len(gateway.model)))
        self._watch = watch
        self.closing = ''
        self._compared = -math.inf
        self._failure, self._failed = '', -math.inf
        self._quiet = True

    @property
    def at_rest(self) -> bool:
        """Whether nothing moves."""
        return self._quiet

    def step(self, now: float, period: float) -> None:
        """Run a cycle."""
        try:
            self._step(now, period)
        except Exception as error:
            self._gateway.abandon(now, f'the motion core raised {type(error).__name__}: {error}')
            raise

    def _step(self, now: float, period: float) -> None:
        measured, blocked = self._feedback.state(now)
        blocked, code = self.closing or blocked or self._kept(now), GoalCode.INVALID_GOAL
        if not blocked and measured is not None:
            if not self._gateway.is_following:
                self._watch.begin(measured.position)
            blocked, code = self._compare(measured.position, now), GoalCode.PATH_TOLERANCE_VIOLATED
        point = self._gateway.update(
            now,
            period,
            measured,
            None if measured is None else measured.position,
            blocked,
            explain=lambda: (blocked, code),
        )
        if point is not None:
            self._put(point)

    def brake(self, period: float) -> None:
        """Slow the last set-point down, without the core; for when the core has failed."""
        self._state = hard_brake(self._state, self._gateway.model.limits, period)
        self._output(SetPoint(self._state, Source.NONE, MotionReport()))
        self._quiet = not self._state.moving

    def _kept(self, now: float) -> str:
        """Return why the arm did not follow, as long as somebody goes on to command it."""
        if now - max(self._failed, self._gateway.refused) > RESYNC_SILENCE:
            self._failure = ''
        return self._failure

    def _compare(self, position: Array, now: float) -> str:
        """Begin where others have moved the arm at rest; say when it does not follow."""
        if self._watch.moved(position, quiet=self._quiet):
            self._gateway.reset(position)
            self._watch.begin(position)
        if self._quiet:
            return ''
        if self._feedback.time == self._compared:  # nothing new was received
            return ''
        self._compared = self._feedback.time
        self._failure, self._failed = self._watch.problem(position), now
        return self._failure

    def _put(self, point: SetPoint) -> None:
        self._state = point.state
        self._watch.command(self._state.position)
        idle = point.source is Source.NONE and not point.state.moving
        if not (idle and self._quiet):
            self._output(point)
        self._quiet = idle


class MotionThread:
    """Runs cycles at absolute deadlines of the monotonic clock; after a stall it skips some.

    Attributes:
        error: What a cycle has raised; the arm was braked, and no cycle follows.
        ended: Set when the last cycle is over.
    """

    def __init__(
        self, cycle: MotionCycle, period: float, begin: Callable[[], None] = lambda: None
    ) -> None:
        """Prepare.

        Args:
            begin: Called once in the thread, before the first cycle.
        """
        self.error: Exception | None = None
        self.ended = threading.Event()
        self._cycle, self._period = cycle, period
        self._begin = begin
        self._failed: Callable[[], None] = lambda: None
        self._ending = threading.Event()
        self._until = math.inf
        self._thread = threading.Thread(target=self._run, name='motion', daemon=True)

    def start(self, failed: Callable[[], None] = lambda: None) -> None:
        """Begin to run.

        Args:
            failed: Called in the thread when a cycle has raised, see :attr:`error`.
        """
        self._failed = failed
        self._thread.start()

    def end(self) -> None:
        """Bring the arm to rest and take no more commands; the thread ends then."""
        self._cycle.closing = 'the program ends'
        self._ending.set()

    def stop(self) -> None:
        """Bring the arm to rest, and wait for the end."""
        self.end()
        if self._thread.is_alive():
            self._thread.join(STOP_TIMEOUT + 1.0)

    def _run(self) -> None:
        try:
            self._begin()
            self._cycles(self._cycle.step, self._ends)
        except Exception as error:  # noqa: BLE001  # the program logs it, and ends
            self.error = error
            self._failed()
            with suppress(Exception):  # what has failed may be the output
                begin = time.monotonic()
                self._cycles(
                    lambda _, period: self._cycle.brake(period),
                    lambda now: self._cycle.at_rest or now > begin + STOP_TIMEOUT,
                )
        finally:
            self.ended.set()

    def _ends(self, now: float) -> bool:
        if not self._ending.is_set():
            return False
        self._until = min(self._until, now + STOP_TIMEOUT)
        return self._cycle.at_rest or now > self._until

    def _cycles(self, step: Callable[[float, float], None], ends: Callable[[float], bool]) -> None:
        timer = CycleTimer(self._period, time.monotonic())
        while not ends(now := time.monotonic()):
            step(timer.begin(now).time, self._period)
            time.sleep(max(0.0, timer.deadline - time.monotonic()))
