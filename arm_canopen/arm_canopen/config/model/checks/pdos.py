# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Checks of PDOs: transmission types and times that contradict each other (CiA 301, 7.5.2.37)."""

from __future__ import annotations

from canopen_core.standard import axis_of, Index, SYNCHRONOUS_MAX

from ..pdo import Direction, longest_silence, loss_unnoticed, PdoConfig, TPDO
from .subject import object_name, Subject

RESTLESS = frozenset({Index.POSITION_ACTUAL, Index.VELOCITY_ACTUAL, Index.TORQUE_ACTUAL})
"""Objects that change all the time, also at rest."""
REMOTE_TYPES = (252, 253)
LATE_FACTOR = 1.5  # periods that a frame may come late before its deadline strikes


def check_pdos(subject: Subject) -> None:
    """Check every PDO in use."""
    for direction, pdo in subject.pdos():
        if direction is TPDO and subject.node.is_drive:
            _check_loss(subject, pdo)
        if SYNCHRONOUS_MAX < pdo.transmission < 254:
            _check_reserved(subject, direction, pdo)
        if pdo.sync_start:
            _check_sync_start(subject, direction, pdo)
        if direction is not TPDO:
            _check_deadline(subject, direction, pdo)
        elif pdo.transmission <= SYNCHRONOUS_MAX:
            _check_useless_times(subject, direction, pdo)
        else:
            _check_events(subject, direction, pdo)


def _check_loss(subject: Subject, pdo: PdoConfig) -> None:
    if loss_unnoticed(pdo, longest_silence(pdo, subject.bus.master.sync_period)):
        subject.findings.warning(
            subject.pdo_place(TPDO, pdo, 'transmission'),
            f'the loss of TPDO {pdo.number} goes unnoticed (transmission {pdo.transmission}, '
            'no event timer or SYNC), and the drive is led by what it sent before',
            "write 'transmission: 1' (with SYNC), or 255 and 'event_timer: 100'",
        )


def _check_reserved(subject: Subject, direction: Direction, pdo: PdoConfig) -> None:
    remote = pdo.transmission in REMOTE_TYPES
    what = 'waits for remote frames, which the master never sends' if remote else 'is reserved'
    subject.findings.warning(
        subject.pdo_place(direction, pdo, 'transmission'),
        f'{direction.title} {pdo.number}: transmission type {pdo.transmission} {what}',
        "write 'transmission: 1' (with SYNC) or 255 (on events)",
    )


def _check_sync_start(subject: Subject, direction: Direction, pdo: PdoConfig) -> None:
    overflow = subject.bus.master.sync_overflow
    place = subject.pdo_place(direction, pdo, 'sync_start')
    if not overflow:
        subject.findings.warning(
            place,
            f'sync_start {pdo.sync_start} has no effect: the SYNC has no counter',
            "write 'sync_overflow: 240' into the section master, or remove it",
        )
    elif pdo.sync_start is not None and pdo.sync_start > overflow:
        subject.findings.error(
            place,
            f'sync_start {pdo.sync_start} never comes: the SYNC counts from 1 to {overflow}',
            f'take at most {overflow}, or a larger sync_overflow',
        )


def _check_deadline(subject: Subject, direction: Direction, pdo: PdoConfig) -> None:
    cycle = subject.bus.master.cycle_period
    if pdo.event_time and pdo.event_time < LATE_FACTOR * cycle:
        subject.findings.warning(
            subject.pdo_place(direction, pdo, 'event_deadline'),
            f'the device misses RPDO {pdo.number} after {pdo.event_time * 1e3:g} ms, but it comes '
            f'every {cycle * 1e3:g} ms: a frame that is a little late is a fault',
            f'take at least {2 * cycle * 1e3:g}',
        )


def _check_useless_times(subject: Subject, direction: Direction, pdo: PdoConfig) -> None:
    for key, time in (('inhibit_time', pdo.inhibit_time), ('event_timer', pdo.event_time)):
        if time:
            subject.findings.warning(
                subject.pdo_place(direction, pdo, key),
                f'{key} has no effect: TPDO {pdo.number} is sent with SYNC (transmission '
                f'{pdo.transmission})',
                "remove it, or write 'transmission: 255'",
            )


def _check_events(subject: Subject, direction: Direction, pdo: PdoConfig) -> None:
    inhibit, timer = subject.inhibit_time(pdo), subject.event_time(pdo)
    if timer and inhibit > timer:
        subject.findings.warning(
            subject.pdo_place(direction, pdo, 'inhibit_time'),
            f'inhibit_time {inhibit * 1e3:g} ms is longer than event_timer {timer * 1e3:g} ms',
            'make inhibit_time (unit 0.1 ms) the shorter one',
        )
    restless = [m for m in pdo.mapping if axis_of(m.index)[0] in RESTLESS]
    if restless and not inhibit:
        names = ' and '.join(object_name(mapped.index) for mapped in restless)
        subject.findings.warning(
            subject.pdo_place(direction, pdo),
            f'TPDO {pdo.number} is sent on change (transmission {pdo.transmission}), and {names} '
            'never stands still: it may flood the bus',
            "write 'transmission: 1', or an inhibit_time",
        )
