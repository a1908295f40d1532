# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""May the robot be moved? One word, one sentence and one action, from its latest messages."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum

SILENCE = 1.0  # time in [s] without joint states after which a robot is out of reach
STALE = 3
"""Level of a status that is unknown, as in diagnostic_msgs."""
DRIVE, LEGS, BUS = ': drive', ': state', ': bus'
"""Suffixes of status names: of a drive, of a walking robot's controller, of a bus."""
FAULTY = frozenset({'Fault', 'Fault reaction active'})
ENABLED = 'Operation enabled'
BOOTING = (
    'asking for its NMT state',
    'bringing its axes to rest',
    'checking its identity',
    'configuring',
    'waiting for its life sign',
    'waiting for mandatory devices',
    'starting',
)
"""Boot phases of a device that is starting."""
NO_MODE = 'No mode'
MODE_SERVICES: Mapping[str, str] = {
    'Cyclic position': 'cyclic_position_mode',
    'Interpolated position': 'interpolated_position_mode',
}
"""Services by drive mode; other modes use that of cyclic position."""
POSTURES: Mapping[str, str] = {'stand': 'STANDING', 'lie': 'LYING', 'relax': 'RELAXED'}
FOLLOWS = frozenset({'walk', 'turn', 'policy'})
"""Modes of a walking robot in which it follows velocities."""
ALLOW = 'Allow motion'
EMERGENCY = 'STOP may not reach it: use the emergency stop.'


class Level(Enum):
    """What a state means; the value is its color on the page."""

    WELL = 'well'
    WARNING = 'warn'
    ACT = 'act'
    FAULT = 'fault'
    UNKNOWN = 'unknown'

    @property
    def diagnostic(self) -> int:
        """The corresponding level of a diagnostic_msgs/DiagnosticStatus."""
        return {Level.WELL: 0, Level.FAULT: 2, Level.UNKNOWN: STALE}.get(self, 1)

    @property
    def exit_code(self) -> int:
        """0: may be moved; 1: only after an action; 2: fault; 3: out of reach, or no robot."""
        return {Level.ACT: 1, Level.FAULT: 2, Level.UNKNOWN: 3}.get(self, 0)


@dataclass(frozen=True, slots=True)
class Status:
    """A diagnostic_msgs/DiagnosticStatus."""

    name: str  # its subject
    level: int  # 0 good, 1 warning, 2 error, 3 stale
    message: str  # human-readable text
    values: Mapping[str, str] = field(default_factory=dict)  # details by key


@dataclass(frozen=True, slots=True)
class Stop:
    """A STOP of the page that is still active."""

    text: str = ''  # the robot's answer; empty before it arrives
    stands: bool | None = None  # whether the robot confirmed standstill; None before its answer


@dataclass(slots=True)
class Seen:
    """Snapshot of what is known of a robot."""

    robot: str = ''  # its name; empty for none
    silence: float = 0.0  # time in [s] since its last message
    statuses: Sequence[Status] = ()  # its diagnostics; overdue ones are stale
    services: frozenset[str] = frozenset()  # full names of its Trigger services
    stop: Stop | None = None  # the active STOP
    moving: bool = False  # joints move; for a walking robot: it follows a velocity
    mover: str = ''  # text on what moves it; empty if unknown
    limit: str = ''  # servo text on what limits its motion
    acting: str = ''  # label of the running action
    battery: str = ''  # human-readable text


@dataclass(frozen=True, slots=True)
class RobotState:
    """Whether the robot may be moved, and why."""

    word: str  # in capital letters
    level: Level  # what it means
    sentence: str  # the reason, and what to do
    action: str = ''  # label of the suggested action; empty for none
    calls: tuple[tuple[str, ...], ...] = ()
    """Services of that action; each group is called after the previous one succeeded."""
    faulty: tuple[str, ...] = ()  # drives that report a fault

    @property
    def movable(self) -> bool:
        """Whether motion may be commanded."""
        return self.level in (Level.WELL, Level.WARNING)

    def __str__(self) -> str:
        """Return the state as one line."""
        return f'{self.word}: {self.sentence}'


def robot_state(seen: Seen) -> RobotState:
    """Return the state of a robot, by the worst observation."""
    if not seen.robot:
        text = 'No robot is here yet. Start one; it is shown by itself.'
        return RobotState('NO ROBOT', Level.UNKNOWN, text)
    if seen.silence > SILENCE:
        text = f'Nothing for {seen.silence:.0f} s. {EMERGENCY}'
        return RobotState('NO CONTACT WITH THE ROBOT', Level.UNKNOWN, text)
    drives, legs = drives_of(seen.statuses), legs_of(seen.statuses)
    state = (
        _fault(seen, drives, legs)
        or (seen.stop and _stopped(seen, seen.stop))
        or _not_enabled(seen, drives)
        or (_legs_state(seen, legs[0]) if legs else _arm_state(seen, drives))
    )
    for status in seen.statuses:
        if status.level == 2 and not status.name.endswith((DRIVE, LEGS, BUS)) and state.movable:
            text = f'{state.sentence} {status.name} reports an error: {status.message}.'
            return replace(state, level=Level.WARNING, sentence=text)
    return state


def drives_of(statuses: Iterable[Status]) -> dict[str, Status]:
    """Return the statuses of drives, by the name of the drive."""
    return {s.name.removesuffix(DRIVE): s for s in statuses if s.name.endswith(DRIVE)}


def legs_of(statuses: Iterable[Status]) -> list[Status]:
    """Return the statuses of controllers of walking robots."""
    return [s for s in statuses if s.name.endswith(LEGS) and 'goal' in s.values]


def _fault(seen: Seen, drives: Mapping[str, Status], legs: Sequence[Status]) -> RobotState | None:
    faulty = {
        name: status
        for name, status in drives.items()
        if status.values.get('state') in FAULTY or (status.level == 2 and not _boots(status))
    }
    for name, status in drives.items():
        if status.level == STALE:
            text = f'{name}: {status.message}. {EMERGENCY}'
            others = ''.join(f' {each} is faulty.' for each in faulty if each != name)
            return RobotState(
                'NO CONTACT WITH THE ROBOT', Level.UNKNOWN, text + others, faulty=tuple(faulty)
            )
    if faulty:
        first, status = next(iter(faulty.items()))
        reason = status.values.get('error_code') or status.message
        calls = _services(seen, faulty, 'recover')
        which = first if len(faulty) == 1 else f'all {len(faulty)}'
        return _acting(
            seen,
            RobotState(
                'FAULT' if len(faulty) == 1 else f'FAULT ({len(faulty)})',
                Level.FAULT,
                f'{first}: {reason}. Remove the cause, then recover.',
                f'Recover {which}' if calls else '',
                (calls,),
                tuple(faulty),
            ),
        )
    for status in legs:
        if status.level == 2:
            calls = _services(seen, [status.name.removesuffix(LEGS)], 'clear_fault')
            text = f'{status.message}. Correct that, then clear the fault.'
            action = 'Clear fault' if calls else ''
            return _acting(seen, RobotState('FAULT', Level.FAULT, text, action, (calls,)))
        if status.level == STALE:
            text = f'The controller is {status.message}. {EMERGENCY}'
            return RobotState('NO CONTACT WITH THE ROBOT', Level.UNKNOWN, text)
    for status in seen.statuses:
        if status.level == 2 and status.name.endswith(BUS):
            text = f'{status.name}: {status.message}. Check power, cable and bit rate.'
            return RobotState('FAULT', Level.FAULT, text)
    return None


def _stopped(seen: Seen, stop: Stop) -> RobotState:
    if stop.stands is None:
        text = 'STOP was sent. The robot has not confirmed yet that it stands.'
        return RobotState('STOPPING', Level.ACT, text, ALLOW)
    if not stop.stands:
        text = f'NOT confirmed: use the emergency stop. {stop.text}'
        return RobotState('STOP NOT CONFIRMED', Level.FAULT, text, ALLOW)
    if seen.moving:
        text = 'A program moves it after STOP. This page moves nothing until you allow it.'
        return RobotState('MOVING', Level.ACT, text, ALLOW)
    words, _, rest = stop.text.partition('. ')
    others = '; the others stand' if rest.startswith('stand') else ''
    text = (
        f'{words[:1].upper()}{words[1:]}{others}. Nothing moves from this page until you allow it.'
    )
    return RobotState('STOPPED', Level.ACT, text, ALLOW)


def _not_enabled(seen: Seen, drives: Mapping[str, Status]) -> RobotState | None:
    booting = [name for name, status in drives.items() if _boots(status)]
    if booting:
        text = f'{booting[0]}: {drives[booting[0]].message}.'
        return RobotState('NOT ENABLED', Level.ACT, text)
    off = [name for name, status in drives.items() if status.values.get('state') != ENABLED]
    idle = [name for name, each in drives.items() if each.values.get('mode') == NO_MODE]
    if not off and not idle:
        return None
    modes = tuple(
        call
        for name in dict.fromkeys((*off, *idle))
        for call in _services(
            seen,
            [name],
            MODE_SERVICES.get(drives[name].values.get('mode', ''), 'cyclic_position_mode'),
        )
    )
    if off:
        text = f'{len(off)} of {len(drives)} drives have no torque.'
        action = 'Enable all drives' if len(off) > 1 else f'Enable {off[0]}'
        calls = (_services(seen, off, 'init'), modes)
    else:
        text = f'{idle[0]} has torque, but no mode: it follows no target.'
        action, calls = 'Select the mode', ((), modes)
    offered = action if any(calls) else ''
    return _acting(seen, RobotState('NOT ENABLED', Level.ACT, text, offered, calls))


def _legs_state(seen: Seen, legs: Status) -> RobotState:
    mode = legs.values.get('state', '')
    notes = f' {legs.message}.' if legs.level == 1 else ''
    battery = f' Battery {seen.battery}.' if seen.battery else ''
    level = Level.WARNING if legs.level == 1 else Level.WELL
    if seen.mover or seen.moving:
        who = seen.mover or 'A program moves it.'
        return RobotState('WALKING', level, f'{who}{notes}')
    if mode in FOLLOWS:
        return RobotState('READY', level, f'Mode {mode}. Hold an arrow to walk.{battery}{notes}')
    if mode in POSTURES:
        hint = 'Press Walk to let the arrows move it.' if mode == 'stand' else 'Press Stand first.'
        return RobotState(POSTURES[mode], level, f'Mode {mode}.{battery} {hint}{notes}')
    return RobotState('MOVING', level, f'Mode {mode}.{battery}{notes}')


def _arm_state(seen: Seen, drives: Mapping[str, Status]) -> RobotState:
    if seen.limit:
        text = f'{seen.limit[:1].upper()}{seen.limit[1:]}. Move it back the other way.'
        return RobotState('AT A LIMIT', Level.WARNING, text)
    if seen.moving or seen.mover:
        return RobotState('MOVING', Level.WELL, seen.mover or 'A program moves it.')
    for name, status in drives.items():
        if status.level == 1:
            return RobotState('READY', Level.WARNING, f'{name}: {status.message}.')
    if not drives:
        return RobotState('READY', Level.WELL, 'Its joints are shown; it has no drives here.')
    return RobotState('READY', Level.WELL, 'Hold a button to move.')


def walks(legs: Status) -> bool:
    """Return whether the controller of a walking robot follows a velocity."""
    velocity = legs.values.get('velocity', '').split()
    return legs.values.get('state') in FOLLOWS and any(float(part) for part in velocity)


def _boots(status: Status) -> bool:
    phase = status.values.get('boot_phase', '')
    return status.values.get('online') == 'False' and phase.startswith(BOOTING)


def _services(
    seen: Seen, names: Sequence[str] | Mapping[str, object], verb: str
) -> tuple[str, ...]:
    """Return the full names of a service on those of the nodes that offer it."""
    ends = tuple(f'/{name}/{verb}' for name in names)
    return tuple(sorted(service for service in seen.services if service.endswith(ends)))


def _acting(seen: Seen, state: RobotState) -> RobotState:
    """Return the state, without offering its action again while that is running."""
    if not seen.acting:
        return state
    return replace(state, sentence=f'{seen.acting} ...', action='', calls=())
