# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Motion core in its own thread, for drives that are commanded over topics.

It monitors whether the arm follows the commands, allowing for delayed drives and joint states.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
import math
import threading
import time

import numpy as np

from arm_model import Array, frozen, JointLimits, RobotState
from arm_trajectory import GoalCode, hard_brake
from realtime_loop import CycleTimer
from robot_primitives import JointSample, JointStateStore, setting

from .controllers.controller import MotionReport, SetPoint, Source
from .core.gateway import CommandGateway

REST_TOLERANCE = 0.002
"""Greatest drift in [rad] of an arm at rest; more means that something else moved it."""

MEAN_GAIN = 0.1  # share of a new measurement in the mean and in the noise of an arm at rest

NOISE_ALLOWANCE, MEAN_ALLOWANCE = 8.0, 2.0
"""Allowed deviations of one measurement and of the mean at rest, as multiples of the noise."""

ARRIVAL_TOLERANCE = 0.02
"""Allowed deviation in [rad] from recent commands while the arm may still be arriving."""


@dataclass(frozen=True, slots=True)
class FollowingLimits:
    """Limits beyond which an arm counts as not following."""

    following_error_limit: float = setting(
        0.2,
        0.0,
        10.0,
        'distance of a joint from where it was sent at which the arm comes to rest [rad];'
        ' 0 is any',
    )
    following_delay: float = setting(0.2, 0.0, 1.0, 'how late it may be where it was sent [s]')


class FollowingWatch:
    """Compares measured positions with all commands of the last ``following_delay``.

    An arm that follows late is somewhere between these commands, so its error is zero at any
    speed; an arm that does not follow falls behind.
    """

    def __init__(self, joints: JointLimits, limits: FollowingLimits, period: float) -> None:
        self._joints = joints
        self._limits = limits
        self._commands = np.zeros((math.ceil(limits.following_delay / period) + 1, len(joints)))
        self._turn = 0
        self._quiet = math.ceil(limits.following_delay / period)
        self._still = 0
        self._rest = self._mean = self._last = self._commands[0]
        self._noise = np.zeros(len(joints))

    def begin(self, positions: Array) -> None:
        """Start with the arm at rest at the given positions."""
        self._commands[:] = positions
        self._rest = self._mean = self._last = positions

    def command(self, positions: Array) -> None:
        """Record the command of a cycle."""
        self._turn = (self._turn + 1) % len(self._commands)
        self._commands[self._turn] = positions

    def errors(self, measured: Array) -> Array:
        """Return the distance in [rad] of each joint from the range of its recent commands."""
        measured = self._unwound(measured, self._commands[self._turn])
        lower, upper = self._commands.min(axis=0), self._commands.max(axis=0)
        errors: Array = np.maximum(np.maximum(lower - measured, measured - upper), 0.0)
        return errors

    def moved(self, measured: Array, *, quiet: bool) -> bool:
        """Return whether something else has moved the arm at rest; call once per cycle.

        Drives may rest slightly off their command, so the reference is the measured rest position.
        The noise of the encoders is estimated at rest.
        """
        self._still = self._still + 1 if quiet else 0
        if self._still <= 1:
            self._mean = self._last = measured
        allowed = np.maximum(REST_TOLERANCE, NOISE_ALLOWANCE * self._noise)
        self._learn(measured)
        if self._still <= self._quiet:
            self._rest = self._mean
            return quiet and bool(self.errors(measured).max() > ARRIVAL_TOLERANCE)
        aside = np.abs(self._unwound(measured, self._rest) - self._rest)
        drifted = np.abs(self._mean - self._rest)
        return bool(
            np.any(aside > allowed)
            or np.any(drifted > np.maximum(REST_TOLERANCE, MEAN_ALLOWANCE * self._noise))
        )

    def _learn(self, measured: Array) -> None:
        """Update the mean and the noise by a measurement."""
        near = self._unwound(measured, self._last)
        self._noise = self._noise + MEAN_GAIN * (np.abs(near - self._last) - self._noise)
        self._last = near
        self._mean = self._mean + MEAN_GAIN * (self._unwound(measured, self._mean) - self._mean)

    def _unwound(self, measured: Array, near: Array) -> Array:
        """Add whole turns to continuous joints."""
        return near - self._joints.error(near, measured)

    def problem(self, measured: Array) -> str:
        """Describe the joint that does not follow; empty when all do."""
        errors = self.errors(measured)
        worst = int(np.argmax(errors))
        if not 0.0 < self._limits.following_error_limit < errors[worst]:
            return ''
        joint = self._joints.names[worst]
        return (
            f'{joint} does not follow: it is {errors[worst]:.3f} rad from where it was sent; does'
            ' its controller take set-points, and is its way free? Let go, and command again'
        )


RESYNC_SILENCE = 0.3
"""Time in [s] without commands after which an arm that did not follow accepts them again."""

STOP_TIMEOUT = 3.0  # longest time for the arm to come to rest at the end of the program in [s]


class JointFeedback(JointStateStore):
    """Measured state of an arm, collected from joint states of some of its joints each.

    Call :meth:`receive` in one thread; :meth:`state` is thread-safe.
    """

    def __init__(self, joints: Sequence[str], timeout: float) -> None:
        """Start without samples; a position expires at the age ``timeout`` in [s]."""
        super().__init__(joints)
        self._order, self._timeout = list(joints), timeout

    @property
    def time(self) -> float:
        """Steady time in [s] of the oldest joint sample; -inf if one is missing."""
        return min(-math.inf if each is None else each.time for each in self._latest())

    def state(self, now: float) -> tuple[RobotState | None, str]:
        """Return the state (None while incomplete), and why it is unusable (empty if usable)."""
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
    """Executes one control cycle; reads no clock."""

    def __init__(
        self,
        gateway: CommandGateway,
        feedback: JointFeedback,
        # receives the set-points during motion, and the last one at rest
        output: Callable[[SetPoint], None],
        watch: FollowingWatch,
    ) -> None:
        self._gateway, self._feedback, self._output = gateway, feedback, output
        self._state = RobotState.at_rest(np.zeros(len(gateway.model)))
        self._watch = watch
        self.closing = ''  # why the arm comes to rest for good; empty before the end
        self._compared = -math.inf
        self._failure, self._failed = '', -math.inf
        self.at_rest = True  # whether nothing moves

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
        """Decelerate from the last set-point without the core, after the core has failed."""
        self._state = hard_brake(self._state, self._gateway.model.limits, period)
        self._output(SetPoint(self._state, Source.NONE, MotionReport()))
        self.at_rest = not self._state.moving

    def _kept(self, now: float) -> str:
        """Return why the arm did not follow, until clients are silent for RESYNC_SILENCE."""
        if now - max(self._failed, self._gateway.refused) > RESYNC_SILENCE:
            self._failure = ''
        return self._failure

    def _compare(self, position: Array, now: float) -> str:
        """Resynchronise if something else moved the arm at rest; return why it does not follow."""
        if self._watch.moved(position, quiet=self.at_rest):
            self._gateway.reset(position)
            self._watch.begin(position)
        if self.at_rest:
            return ''
        if self._feedback.time == self._compared:  # no new sample
            return ''
        self._compared = self._feedback.time
        self._failure, self._failed = self._watch.problem(position), now
        return self._failure

    def _put(self, point: SetPoint) -> None:
        self._state = point.state
        self._watch.command(self._state.position)
        idle = point.source is Source.NONE and not point.state.moving
        if not (idle and self.at_rest):
            self._output(point)
        self.at_rest = idle


class MotionThread:
    """Runs cycles at absolute deadlines of the monotonic clock; skips cycles after a stall."""

    def __init__(
        self, cycle: MotionCycle, period: float, begin: Callable[[], None] = lambda: None
    ) -> None:
        """Create the thread, which calls ``begin`` once before the first cycle."""
        # exception raised by a cycle; the arm was braked, and no cycle follows
        self.error: Exception | None = None
        self.ended = threading.Event()  # set when the last cycle is over
        self._cycle, self._period = cycle, period
        self._begin = begin
        self._failed: Callable[[], None] = lambda: None
        self._ending = threading.Event()
        self._until = math.inf
        self._thread = threading.Thread(target=self._run, name='motion', daemon=True)

    def start(self, failed: Callable[[], None] = lambda: None) -> None:
        """Begin to run."""
        self._failed = failed
        self._thread.start()

    def end(self) -> None:
        """Bring the arm to rest, accept no more commands, and let the thread end."""
        self._cycle.closing = 'the program ends'
        self._ending.set()

    def stop(self) -> None:
        """Bring the arm to rest, and wait for the thread to end."""
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
            with suppress(Exception):  # the output itself may have failed
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
