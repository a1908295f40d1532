# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The drives of a bus: their common cycle, their motion sources, and the stop of all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from functools import partial
import math

from canopen_core import CanopenError, DriveError
from canopen_core.standard import DriveState

from ..master.events import Event, EventKind, Report, Severity
from ..master.scheduler import Promise, Scheduler
from .axis import Axis
from .commands import AxisCommands
from .motion import AxisFeedback, MotionSource, Refusal, RefusalCause, Setpoint
from .sequences import BRAKED_TIMEOUT
from .state import FAULTY, POWERED

HAND_OVER_MARGIN = 2.0  # allowed distance of a stream's start, in cycles at profile velocity
SPEED_MARGIN = 1.5  # multiple of the maximum speed (0x607F) above which a step is a jump
DEFAULT_SPEED_MARGIN = 10.0  # the same multiple of the profile velocity, without 0x607F
RANGE_TIME = 0.25  # [s] in which drives without 0x607F may cross their range (0x607D)
BY_CLIENTS = (RefusalCause.COMMANDED, RefusalCause.MODE_SELECTED, RefusalCause.SINGLE_TARGET)


@dataclass(slots=True)
class Attachment:
    """A source, its drives in its order, and those that it commands.

    A failed source is no longer updated, but still notified when it loses a drive.
    """

    source: MotionSource
    drives: list[Axis]
    owned: list[Axis] = field(default_factory=list)
    streaming: set[str] = field(default_factory=set)
    failed: bool = False


class MotionGroup:
    """The drives of one bus by name, in the order of bus.yml.

    A drive belongs to one source at most. It is released when a client commands a single target,
    another mode or a stop, and when it faults or is lost; its source gets it back only when
    attached again.
    """

    def __init__(self, drives: Sequence[Axis], report: Report) -> None:
        self.drives = {drive.name: drive for drive in drives}  # the drives
        self._report = report
        self._attachments: list[Attachment] = []
        for drive in drives:
            drive.released = partial(self._release, drive)

    def attach(self, source: MotionSource) -> None:
        """Attach a source, which commands its axes from the next cycle on.

        Attaching it again returns lost axes to it; axes that it still has continue.

        Raises:
            KeyError: An axis is not a drive of this bus.
        """
        unknown = [name for name in source.axes if name not in self.drives]
        if unknown:
            raise KeyError(f'no drives {unknown} on this bus; it has {list(self.drives)}')
        drives = [self.drives[name] for name in source.axes]
        before = [entry for entry in self._attachments if entry.source is source]
        kept = [drive for entry in before for drive in entry.owned]
        self.detach(source)
        for drive in drives:
            if drive not in kept:
                self._release(drive, Refusal(RefusalCause.OTHER_SOURCE))
        streaming = {name for entry in before for name in entry.streaming}
        self._attachments.append(Attachment(source, drives, list(drives), streaming))

    def detach(self, source: MotionSource) -> None:
        """Detach a source; drives that it moves are braked."""
        self._attachments = [entry for entry in self._attachments if entry.source is not source]

    def cycle(self, now: float, period: float) -> None:
        """Run one cycle: read states, update sources, write targets; times are in [s]."""
        # an error of one drive is reported and stops that drive; the others continue
        for drive in self.drives.values():
            try:
                drive.read()
            except Exception as error:  # noqa: BLE001, PERF203
                drive.fail(error)
        for attachment in list(self._attachments):
            if not attachment.failed:
                self._run(attachment, now, period)
        for drive in self.drives.values():
            try:
                drive.write(now, period)
            except Exception as error:  # noqa: BLE001, PERF203
                drive.fail(error)

    def _run(self, attachment: Attachment, now: float, period: float) -> None:
        feedback = [_feedback(drive) for drive in attachment.drives]
        followable = [axis.followable for axis in feedback]
        try:
            setpoints = list(attachment.source.update(now, period, feedback))
        except Exception as error:  # noqa: BLE001  # a source must not stop the others
            self._fail(attachment, f'raised {type(error).__name__}: {error}')
            return
        if len(setpoints) != len(feedback):
            reason = f'answered {len(setpoints)} set-points for {len(feedback)} axes'
            self._fail(attachment, reason)
            return
        for drive, follows, setpoint in zip(attachment.drives, followable, setpoints, strict=True):
            if setpoint is None or not follows or drive not in attachment.owned:
                attachment.streaming.discard(drive.name)
                continue
            whole = setpoint if isinstance(setpoint, Setpoint) else Setpoint(setpoint)
            try:
                self._stream(attachment, drive, whole, period)
            except Exception as error:  # noqa: BLE001
                if not isinstance(error, CanopenError):
                    drive.fail(error)
                    continue
                self._release(drive, Refusal(RefusalCause.SETPOINT_REFUSED, str(error)))

    def _stream(
        self, attachment: Attachment, drive: Axis, setpoint: Setpoint, period: float
    ) -> None:
        position, before = setpoint.position, drive.setpoint
        if drive.name not in attachment.streaming:
            margin = HAND_OVER_MARGIN * drive.view.parameters.profile.velocity * period
            if abs(position - before) > margin:
                raise DriveError(
                    f'the stream starts at {position:g}, but the set-point is {before:g}; '
                    'a stream must start where the drive is'
                )
            attachment.streaming.add(drive.name)
        elif abs(position - before) > _greatest_speed(drive) * period:
            raise DriveError(
                f'the stream jumps from {before:g} to {position:g} within a cycle; the '
                f'axis takes up to {_greatest_speed(drive):g} per second'
            )
        drive.stream(setpoint)

    def _release(self, drive: Axis, refusal: Refusal) -> None:
        """Release a drive from its source, and notify sources that had lost it before."""
        for attachment in self._attachments:
            if drive in attachment.owned:
                attachment.owned.remove(drive)
                attachment.streaming.discard(drive.name)
            elif drive not in attachment.drives or refusal.cause not in BY_CLIENTS:
                continue
            self._notify(attachment.source, drive.name, refusal)

    def _notify(self, source: MotionSource, axis: str, refusal: Refusal) -> None:
        try:
            source.released(axis, refusal)
        except Exception as error:  # noqa: BLE001  # the caller takes the drive away regardless
            name = type(source).__name__
            text = (
                f'motion source {name} raised {type(error).__name__}: {error}, when it lost {axis}'
            )
            self._report(Event(EventKind.DRIVE, Severity.ERROR, '', text))

    def _fail(self, attachment: Attachment, reason: str) -> None:
        attachment.failed = True
        attachment.owned.clear()
        name = type(attachment.source).__name__
        text = f'motion source {name} {reason}; it is detached and its drives are braked'
        self._report(Event(EventKind.DRIVE, Severity.ERROR, '', text))


def _feedback(drive: Axis) -> AxisFeedback:
    """Return the state of a drive for its source; stop the drive if that fails."""
    try:
        return drive.feedback()
    except Exception as error:  # noqa: BLE001
        drive.fail(error)
        failed = Refusal(RefusalCause.CYCLE_FAILED, str(error))
        unknown = DriveState.UNKNOWN
        return AxisFeedback(
            drive.name, False, unknown, 0, math.nan, 0.0, math.nan, False, failed, math.inf
        )


def _greatest_speed(drive: Axis) -> float:
    """Return the speed in user units per second above which a step of a stream is a jump."""
    parameters = drive.view.parameters
    if parameters.speed_limit is not None:
        return SPEED_MARGIN * parameters.speed_limit
    low, high = parameters.position_limits or (0.0, 0.0)
    return max(DEFAULT_SPEED_MARGIN * parameters.profile.velocity, (high - low) / RANGE_TIME)


@dataclass(frozen=True, slots=True)
class StopReport:
    """Result of stopping all drives, by name."""

    stopped: tuple[str, ...]  # drives that moved and now stand, still powered
    # drives that showed no motion; no earlier target moves them any more
    standing: tuple[str, ...]
    unpowered: tuple[str, ...]  # drives that are not enabled
    failed: tuple[str, ...]  # drives not confirmed at rest, each as name and reason

    def __str__(self) -> str:
        """Return a sentence, with failures first."""
        named = (
            ('NOT known to stand', '; '.join(self.failed)),
            ('stopped', ', '.join(self.stopped)),
            ('stand', ', '.join(self.standing)),
            ('not enabled', ', '.join(self.unpowered)),
        )
        return '. '.join(f'{what}: {names}' for what, names in named if names) or 'no drives'


async def stop_all(commands: Sequence[AxisCommands], scheduler: Scheduler) -> StopReport:
    """Halt all drives and wait until each stands or has no power.

    A drive that does not come to rest does not delay the others.
    """
    ends = [scheduler.spawn(_stopped(each, scheduler)) for each in commands]
    outcomes = [await end for end in ends]
    return StopReport(
        **{
            each.name: tuple(text for outcome, text in outcomes if outcome == each.name)
            for each in fields(StopReport)
        }
    )


async def _stopped(commands: AxisCommands, scheduler: Scheduler) -> tuple[str, str]:
    """Halt a drive; return its field of StopReport, and its name or the reason of failure."""
    view = commands.axis.view
    moved = not view.stands
    try:
        try:
            await _to_its_end(commands.request('halt'), commands, scheduler)
        except CanopenError:
            if not (view.seen and view.state in FAULTY):
                raise
        await commands.stops.at_rest(BRAKED_TIMEOUT)
    except CanopenError as error:
        return 'failed', str(error)
    if view.state is DriveState.FAULT:  # its fault reaction has ended its motion
        return 'unpowered', f'{view.name} (faulted)'
    if view.shown_state is DriveState.UNKNOWN:
        return 'failed', f'{view.name}: {commands.axis.describe()}'
    if view.state not in POWERED:
        return 'unpowered', view.name
    return 'stopped' if moved else 'standing', view.name


async def _to_its_end(halt: Promise[str], commands: AxisCommands, scheduler: Scheduler) -> None:
    """Wait for a stop command, or for the one that replaces it."""
    while True:
        try:
            await halt
        except CanopenError:  # noqa: PERF203  # the replacement may also be replaced
            await scheduler.timer(0.0)  # until the replacement has begun
            other = commands.stopping
            if other is None or other is halt:
                raise
            halt = other
        else:
            return
