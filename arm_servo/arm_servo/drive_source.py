# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Motion source for arm_canopen that steps the motion core in the CANopen cycle."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Future
import math

import numpy as np

from arm_canopen import AxisFeedback, MotionSource, Refusal, RefusalCause, Setpoint
from arm_model import Array, frozen, RobotState
from arm_trajectory import GoalCode

from .controllers.controller import Source
from .core.gateway import CommandGateway

POWER = 'look after its power and its cable'
MODE = 'call its ~/cyclic_position_mode or ~/interpolated_position_mode'
COMMAND = 'the next command takes it back'
NOT_ATTACHED = f'was not attached yet; {COMMAND}'

UNUSED = f'is ready; {COMMAND}'
PREPARATIONS = (RefusalCause.COMMANDED, RefusalCause.MODE_SELECTED)
"""Release causes of clients that prepare a drive before motion."""

REMEDIES: Mapping[RefusalCause, str] = {
    RefusalCause.OFFLINE: POWER,
    RefusalCause.NOT_OPERATIONAL: 'call its ~/init',
    RefusalCause.STATE_UNKNOWN: POWER,
    RefusalCause.SILENT: POWER,
    RefusalCause.FAULT: 'call its ~/recover',
    RefusalCause.NOT_ENABLED: 'call its ~/init',
    RefusalCause.MODE_CHANGE: MODE,
    RefusalCause.OTHER_MODE: MODE,
    RefusalCause.MODE_SELECTED: f'{COMMAND} in mode 7 or 8',
    RefusalCause.HALTED: COMMAND,
    RefusalCause.SINGLE_TARGET: f'wait until it stands, or call its ~/halt; then {COMMAND}',
    RefusalCause.OTHER_SOURCE: COMMAND,
    RefusalCause.COMMANDED: COMMAND,
    RefusalCause.NOT_FOLLOWING: 'free its way; the next command takes it back',
    RefusalCause.CYCLE_FAILED: 'see the log; the next command takes it back',
    RefusalCause.SETPOINT_REFUSED: 'see the log; the next command takes it back',
    RefusalCause.SHUTDOWN: 'start the master again',
}

SILENT = RefusalCause.SILENT
SILENT_AGE_FACTOR = 0.5
"""Share of the age of a silent drive above which another drive counts as silent, too."""

PLURAL = {
    'is': 'are',
    'has': 'have',
    'was': 'were',
    'does': 'do',
    'moves': 'move',
    'takes': 'take',
}
"""Plural of the verbs that begin a reason, for several drives."""

OBJECTS = {' its ': ' their ', 'takes it': 'takes them', 'it stands': 'they stand'}
"""Plural of pronouns in a reason, for several drives."""

Released = Mapping[str, Refusal | str]  # released drives, with the reason


def why_not(feedback: Sequence[AxisFeedback], released: Released) -> str:
    """Return why the arm cannot follow now; empty when it can."""
    if not released and all(axis.followable and axis.refusal is None for axis in feedback):
        return ''
    return _sentence(
        (axis.name, axis.refusal or released.get(axis.name)) for axis in feedback
    ) or _sentence((axis.name, UNKNOWN) for axis in feedback if not axis.followable)


def too_fast(feedback: Sequence[AxisFeedback], velocities: Array) -> str:
    """Return a message naming joints with limits above their drive's; empty for none.

    A drive refuses a path above its speed limit half-way, so the arm stops off the path.
    """
    words = (
        'is limited to {:.4g} per second by 0x607F, and limits.yaml allows {:.4g}; lower'
        ' max_velocity there, or raise 0x607F in the sdo list of bus.yml'
    )
    pairs = zip(feedback, velocities, strict=True)
    return _sentence(
        (axis.name, words.format(axis.speed_limit, velocity))
        for axis, velocity in pairs
        if velocity > axis.speed_limit
    )


def what_happened(feedback: Sequence[AxisFeedback], released: Released) -> tuple[str, GoalCode]:
    """Return why the arm stopped following, and the result code of its trajectory.

    The reason why a drive was released is the cause; its present state may be a consequence.
    """
    causes: list[tuple[str, Refusal | str | None]] = [
        (axis.name, released.get(axis.name) or axis.refusal) for axis in feedback
    ]
    silent = (each for each in feedback if each.refusal and each.refusal.cause is SILENT)
    oldest = max((axis.age for axis in silent), default=math.inf)
    for number, axis in enumerate(feedback):
        # a common cause of several silent drives shows on some of them a few cycles later
        if causes[number][1] is None and axis.age > SILENT_AGE_FACTOR * oldest:
            detail = f'the last is {axis.age:.1f} s old'
            causes[number] = axis.name, Refusal(SILENT, detail)
    is_behind = any(
        isinstance(cause, Refusal) and cause.cause is RefusalCause.NOT_FOLLOWING
        for _, cause in causes
    )
    code = GoalCode.PATH_TOLERANCE_VIOLATED if is_behind else GoalCode.INVALID_GOAL
    return _sentence(causes) or why_not(feedback, released), code


UNKNOWN = 'accepts no set-points; see the log of the master'


def _sentence(causes: Iterable[tuple[str, Refusal | str | None]]) -> str:
    """Return the causes as one message, grouping drives with the same cause."""
    names: dict[str, list[str]] = {}
    for name, cause in causes:
        if cause is not None:
            names.setdefault(_words(cause), []).append(name)
    return '; '.join(
        f'{", ".join(axes)} {reason if len(axes) == 1 else _of_several(reason)}'
        for reason, axes in names.items()
    )


def _words(cause: Refusal | str) -> str:
    if isinstance(cause, str):
        return cause
    return f'{cause}; {REMEDIES[cause.cause]}'


def _of_several(reason: str) -> str:
    """Convert a reason for one drive to the plural."""
    verb, rest = reason.split(' ', 1)
    for one, many in OBJECTS.items():
        rest = rest.replace(one, many)
    return f'{PLURAL.get(verb, verb)} {rest}'


class DriveSource:
    """Commands the drives of an arm; a :class:`arm_canopen.MotionSource`.

    It follows while every drive can. If one drops out, the others stop on the path, and the
    outcome of a trajectory names the drive. Then it takes over the arm at the drives' set-points:
    at once if no drive was released, else when the source is attached again.
    """

    def __init__(
        self,
        gateway: CommandGateway,
        # attaches a source to the bus before the next cycle, without blocking
        attach: Callable[[MotionSource], Future[None]],
    ) -> None:
        self._attach = attach
        gateway.get_ready = self.get_ready
        self._gateway = gateway  # it is stepped here only
        self._axes = list(gateway.model.joints)
        self._released: dict[str, Refusal | str] = dict.fromkeys(self._axes, NOT_ATTACHED)
        self._left: set[str] = set()  # drives that dropped out since all of them followed
        self._has_moved = False  # for any client

    @property
    def axes(self) -> Sequence[str]:
        """Names of the drives, which are those of the joints."""
        return self._axes

    def get_ready(self) -> bool:
        """Attach the released drives again. Thread-safe and non-blocking.

        If that fails, the drives stay released, and the next command tries again.

        Returns:
            Whether any drive was released.
        """
        before = self._released
        if not before:
            return False
        self._released = {}  # before, so that a drive which is taken away right after is known

        def finish(future: Future[None]) -> None:
            if future.cancelled() or future.exception() is not None:
                self._released = {**before, **self._released}

        self._attach(self).add_done_callback(finish)
        return True

    def released(self, axis: str, refusal: Refusal) -> None:
        """Bring the arm to rest, and send no set-points until attached again.

        Refuse all earlier requests, including those that would attach the drive again.
        """
        # a drive that was initialized, or got its mode, before the first motion had no client
        is_prepared = refusal.cause in PREPARATIONS and not self._has_moved
        self._released = {axis: UNUSED if is_prepared else refusal, **self._released}
        self._gateway.interrupt(_sentence([(axis, refusal)]))

    def update(
        self, now: float, period: float, feedback: Sequence[AxisFeedback]
    ) -> Sequence[Setpoint | None]:
        """Return the set-points of a cycle.

        Returns:
            Position in [rad] and velocity in [rad/s] of each drive that follows.
        """
        try:
            return self._update(now, period, feedback)
        except Exception as error:  # the bus detaches it then
            what = f'{type(error).__name__}: {error}'
            reason = f'was let go, because the motion core raised {what}; {COMMAND}'
            self._released = dict.fromkeys(self._axes, reason)
            self._gateway.abandon(now, reason)
            raise

    def _update(
        self, now: float, period: float, feedback: Sequence[AxisFeedback]
    ) -> Sequence[Setpoint | None]:
        gateway = self._gateway
        blocked = why_not(feedback, self._released)
        if not gateway.is_following:
            blocked = blocked or too_fast(feedback, gateway.model.limits.velocity)
            self._left.clear()
        elif blocked:
            self._left.update(axis.name for axis in feedback if not axis.followable)
        point = gateway.update(
            now,
            period,
            measured_state(feedback),
            None if gateway.is_following else frozen([axis.setpoint for axis in feedback]),
            blocked,
            explain=lambda: what_happened(feedback, self._released),
            is_gone=len(self._left) == len(feedback),
            ages=frozen([axis.age for axis in feedback]),
        )
        if point is None:
            return [None] * len(feedback)
        self._has_moved |= point.source is not Source.NONE
        rows = zip(
            point.state.position.tolist(), point.state.velocity.tolist(), feedback, strict=True
        )
        return [
            None if axis.name in self._left else Setpoint(position, velocity)
            for position, velocity, axis in rows
        ]


def measured_state(feedback: Sequence[AxisFeedback]) -> RobotState | None:
    """Return what the drives measure; None while one of them has sent nothing yet."""
    positions = [axis.position for axis in feedback]
    if not math.isfinite(sum(positions)):
        return None
    velocities = [axis.velocity for axis in feedback]
    return RobotState(frozen(positions), frozen(velocities), np.zeros(len(feedback)))
