# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The motion itself: boot, checks, the agreement, and the held key; then the drive is disabled."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
import math
import os
from pathlib import Path
import time

from arm_canopen import CanopenDrive, CanopenMaster, Event, Severity
from arm_canopen.config import DriveConfig
from canopen_core import BootError, CanopenError
from canopen_core.standard import CYCLIC_MODES, DriveState
from first_motion import (
    FOLLOWING,
    JointKind,
    MotionGuard,
    MotionPlan,
    Order,
    Outcome,
    Quantity,
    Sample,
)
from operator_input import HeldKeys, Keyboard, ReleaseSource, status_text, Style, TerminalError

from .checks import AxisFacts, doubts, motion_mode, obstacles, read_facts
from .dialogue import agrees, FirstMotionError, say
from .interruptions import uninterrupted_end
from .movers import CyclicMover, Mover, ProfileMover

PERIOD = 0.03  # [s] between two looks at the drive
STATE_TIMEOUT = 2.0  # [s] after the boot, for the first TPDOs
HALT_TIMEOUT = 3.0  # [s] for a slow joint to come to rest
SETTLE_TIME = 0.4  # [s] after the halt, until the position is read
KEY = 'space'
QUIT = frozenset({'q', 'escape', 'ctrl+c'})
RELEASES = {
    ReleaseSource.TERMINAL: 'releasing it stops at once',
    ReleaseSource.KEYBOARD: 'releasing it stops at once',
    ReleaseSource.TIME_OUT: 'releasing it stops within 0.15 s',
}


@dataclass(frozen=True, slots=True)
class Request:
    """What the command line says."""

    path: Path  # the bus.yml
    joint: str  # name of the joint
    can: str  # name of the bus
    distance: Quantity  # how far it shall go
    speed: Quantity  # how fast, per second
    write: bool  # change bus.yml without a question, where the cause is beyond doubt


@dataclass(frozen=True, slots=True)
class Record:
    """A motion that was made."""

    outcome: Outcome  # how it ended
    detail: str  # the same in words
    before: float  # position before it, in [rad] or [m]
    after: float  # position after it
    facts: AxisFacts  # what the drive says about itself


def move(request: Request, axis: DriveConfig) -> Record | None:
    """Boot, check, ask, move; the drive is disabled and the bus is left when it returns.

    Returns:
        What was done; None when the person does not want it.
    """
    kind = request.distance.kind
    events: deque[Event] = deque(maxlen=100)
    master = CanopenMaster.from_bus_yml(request.path, bus=request.can, on_event=events.append)
    # once the drive is to be stopped, no further signal may end that
    with uninterrupted_end(master):
        drive = _booted(master, axis.name)
        facts = read_facts(master, axis, request.speed.value)
        position = drive.position
        _check(request, drive, facts, position)
        if not agrees(f'enable {axis.name} and move it?'):
            return None
        events.clear()
        drive.enable()
        drive.select_mode(motion_mode(axis))
        plan = _plan(request, facts, master, drive)
        mover = _mover(master, facts, plan)
        guard = MotionGuard(plan, time.monotonic())
        guarded = _GuardedMotion(master, drive, mover, guard, events)
        try:
            with Keyboard() as keyboard:
                after = guarded.run(keyboard, kind)
        except TerminalError as error:
            raise FirstMotionError(str(error)) from error
        finally:
            _leave(drive, mover)
    if not guard.outcome.is_judged:
        raise FirstMotionError(
            f'{axis.name}: {guard.detail}. It reported {kind.shown(plan.start)} before, '
            f'{kind.shown(after)} after'
        )
    return Record(guard.outcome, guard.detail, plan.start, after, facts)


def _leave(drive: CanopenDrive, mover: Mover) -> None:
    """Stop and disable the drive, and give it its speed back; the master does so once more.

    What was seen of the stop is shown.
    """
    try:
        say(f'{drive.name} stands without power: {drive.shutdown()}')
        mover.close()
    except CanopenError as error:
        say(str(error))


def _booted(master: CanopenMaster, name: str) -> CanopenDrive:
    """Boot the bus; devices that are missing do not matter, unless it is that of the joint."""
    drive = master.drive(name)
    try:
        master.boot()
    except BootError as error:
        if not drive.status().node.online:
            raise
        say(f'going on without the others: {error}')
    deadline = time.monotonic() + STATE_TIMEOUT
    while not drive.status().fresh and time.monotonic() < deadline:
        time.sleep(PERIOD)
    return drive


def _check(request: Request, drive: CanopenDrive, facts: AxisFacts, position: float) -> None:
    """Show what will happen, and refuse what cannot."""
    kind, distance = request.distance.kind, request.distance.value
    status = drive.status()
    say(f'{drive.name}: {status.summary}')
    if status.faulted:
        say(f'  fault: {status.error or "no error code"}')
        if not agrees('is its cause removed? reset the fault (it is enabled for a moment)?'):
            raise FirstMotionError(f'{drive.name} is faulted; remove the cause first')
        drive.recover()
        drive.disable()
    found = list(obstacles(kind, facts, position, distance))
    if found:
        raise FirstMotionError('; '.join(f'{drive.name}: {each}' for each in found))
    say(
        f'  stands at {kind.shown(position)}, {facts.axis.scale_pos_to_dev:g} increments per '
        f'{"rad" if kind is JointKind.TURNS else "m"}'
    )
    if facts.limits is not None:
        low, high = (kind.shown(end) for end in facts.limits)
        say(f'  software limits {low} to {high}')
    for doubt in doubts(kind, facts, position, request.speed.value):
        say(f'  note: {doubt}')
    way = 'in the positive direction' if distance > 0 else 'in the negative direction'
    say(
        f'It will move {kind.shown(abs(distance))} {way}, to {kind.shown(position + distance)}, '
        f'with {kind.shown(facts.speed)}/s, in mode {motion_mode(facts.axis).title}, and only '
        'while you hold the space bar. Should the scales be wrong it moves farther, faster or the '
        'other way: keep the emergency stop in reach, and release the key when it is enough.'
    )


def _plan(
    request: Request, facts: AxisFacts, master: CanopenMaster, drive: CanopenDrive
) -> MotionPlan:
    distance, start = request.distance.value, drive.position
    if not math.isfinite(start):
        raise FirstMotionError(f'{drive.name} reports no position any more')
    cyclic = motion_mode(facts.axis) in CYCLIC_MODES
    return MotionPlan(
        start=start,
        distance=distance,
        speed=facts.speed,
        increment=abs(facts.axis.scale_pos_from_dev),
        following_limit=FOLLOWING * abs(distance) if cyclic else math.inf,
        others={
            name: other.position
            for name, other in master.drives.items()
            if name != drive.name and math.isfinite(other.position)
        },
    )


def _mover(master: CanopenMaster, facts: AxisFacts, plan: MotionPlan) -> Mover:
    if facts.speed_dev is None:
        return CyclicMover(master, facts.axis, plan)
    return ProfileMover(master, facts.axis, plan, facts.speed_dev)


class _GuardedMotion:
    """An enabled drive, moved while the key is held."""

    def __init__(
        self,
        master: CanopenMaster,
        drive: CanopenDrive,
        mover: Mover,
        guard: MotionGuard,
        events: deque[Event],
    ) -> None:
        self._master = master
        self._drive = drive
        self._mover = mover
        self._guard = guard
        self._events = events
        self._held = HeldKeys()
        self._colour = not os.environ.get('NO_COLOR')

    def run(self, keyboard: Keyboard, kind: JointKind) -> float:
        """Move until it is over; return the position in the end, of a drive that stands.

        Raises:
            FirstMotionError: The person quits.
        """
        line = keyboard.status_line()
        line.message(
            f'Hold the space bar: {RELEASES[keyboard.release_source]}.\n'
            'Enter: it is enough. q, Escape, Ctrl-C: stop, disable, end.'
        )
        try:
            while self._step(keyboard) is not Order.END:
                for event in self._important():
                    line.message(str(event))
                line.show(self._status(kind))
            line.show(self._status(kind))
        finally:
            line.end()
        if self._guard.outcome.is_judged:
            deadline = time.monotonic() + HALT_TIMEOUT
            while self._mover.busy and time.monotonic() < deadline:
                time.sleep(PERIOD)
            time.sleep(SETTLE_TIME)
        return self._drive.position

    def _step(self, keyboard: Keyboard) -> Order:
        order = Order.NONE
        for event in keyboard.wait(PERIOD):
            self._held.feed(event)
            if event.is_stroke and event.key in QUIT:
                raise FirstMotionError('ended by you')
            if event.is_stroke and event.key == 'enter':
                order = self._guard.finish()
        now = time.monotonic()
        if order is not Order.END:
            # one character is a touch of the key; its first repeat shows that it is held
            is_held = self._held.current(now) == KEY and not self._held.is_tap(now)
            order = self._guard.step(now, self._sample(), held=is_held, busy=self._mover.busy)
        if order is Order.GO:
            self._mover.go()
        elif order in {Order.HALT, Order.END}:
            self._mover.halt()
        elif self._guard.moving:
            self._mover.keep_going()
        return order

    def _sample(self) -> Sample:
        status = self._drive.status()
        problem = self._mover.problem or status.failure
        if status.faulted:
            problem = f'fault: {status.error or status.statusword}'
        elif not status.node.online:
            problem = 'the device is lost'
        elif not status.fresh:
            problem = 'its TPDOs do not arrive'
        elif status.state is not DriveState.OPERATION_ENABLED:
            problem = problem or f'it is not enabled any more: {status.summary}'
        others = {name: self._master.drive(name).position for name in self._guard.plan.others}
        return Sample(status.position, status.following_error, problem, others)

    def _status(self, kind: JointKind) -> str:
        guard = self._guard
        state = ('moving', Style.GREEN) if guard.moving else ('at rest', Style.YELLOW)
        if guard.needs_release:
            state = ('release the key, and press it anew', Style.RED)
        way = f'{guard.travelled / kind.size:.3f} of {kind.shown(abs(guard.plan.distance))}'
        return status_text([state, (way, Style.PLAIN)], colour=self._colour)

    def _important(self) -> Iterable[Event]:
        """Handle queued events of the drive and the bus."""
        while self._events:
            event = self._events.popleft()
            if event.severity is not Severity.INFO and event.node in {'', self._drive.name}:
                yield event
