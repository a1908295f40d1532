# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``canopen lss``: finds devices without a node id, sets node ids and bit rates (CiA 305)."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager

from canopen_core import LssError, SdoAbortError, SdoTimeoutError
from canopen_core.can import Frame, open_bus
from canopen_core.standard import CobId, Index, lss, NmtState, parse_heartbeat, UNCONFIGURED

from ..lss_master import LssMaster, TIMEOUT
from .arguments import (
    add_bus_argument,
    bitrate,
    node_id,
    seconds,
    SubParsers,
    UsageError,
    whole_number,
)
from .output import counted, print_line, print_table, warn
from .session import Session

BOOT_WAIT = 2.0  # [s] for the boot-up message of a device that has got its first node id
PROBE_TIMEOUT = 0.2  # [s] for somebody who has the node id already
MASTER_WAIT = 0.15  # [s]
PAUSE = 0.02  # [s] after a switch of the state, which nobody answers
HEAD = ('vendor', 'product', 'revision', 'serial')


def add_parser(parsers: SubParsers) -> None:
    """Add the verb with verbs of its own."""
    parser = parsers.add_parser(
        'lss',
        help='find devices without node id, set node ids and bit rates',
        description='Layer setting services (CiA 305). Devices are set one at a time; at the end '
        'all are in the waiting state again.',
    )
    verbs = parser.add_subparsers(title='verbs', metavar='VERB', required=True)
    scan = verbs.add_parser(
        'scan',
        help='find devices without node id',
        description='Find every device without a node id by fast scan. Exit code: 0, 1 when '
        'there is none, 2 wrong usage.',
    )
    scan.set_defaults(run=run_scan)
    inquire = verbs.add_parser('inquire', help='read the address and node id of a device')
    inquire.set_defaults(run=run_inquire)
    setting = verbs.add_parser(
        'set',
        help='give a device a node id or a bit rate',
        description='Give a device a node id or a bit rate. Without --address and --only it is '
        'the first one without node id that fast scan finds.',
    )
    setting.set_defaults(run=run_set)
    add = setting.add_argument
    add('--node-id', type=node_id, metavar='N', help='1 to 127; not used by another device')
    add('--bitrate', type=bitrate, help='in bit/s, e.g. 500000 or 500k')
    add('--store', action='store_true', help='keep it without power')
    add(
        '--activate',
        type=seconds,
        metavar='S',
        help='have the device take the bit rate after so many seconds of silence',
    )
    for verb in (scan, inquire, setting):
        add_bus_argument(verb)
        verb.add_argument(
            '--timeout', type=seconds, default=TIMEOUT, metavar='S', help='for an answer, in s'
        )
    _add_choice(inquire, required=True)
    _add_choice(setting, required=False)


def _add_choice(parser: argparse.ArgumentParser, *, required: bool) -> None:
    which = parser.add_mutually_exclusive_group(required=required)
    which.add_argument(
        '--address',
        type=whole_number,
        nargs=4,
        metavar=('VENDOR', 'PRODUCT', 'REVISION', 'SERIAL'),
        help='the device with these numbers',
    )
    which.add_argument('--only', action='store_true', help='the only device on the bus')


def run_scan(options: argparse.Namespace) -> int:
    """Find devices without node id; return the exit code."""
    with _lss(options) as (session, master):
        master.switch_all(lss.State.WAITING)
        session.listen(PAUSE)
        found: list[lss.Address] = []
        while (address := session.run(master.fast_scan())) is not None:
            found.append(address)
    if found:
        print_table(HEAD, [str(address).split() for address in found])
    print_line(f'{counted(len(found), "device")} without node id')
    return 0 if found else 1


def run_inquire(options: argparse.Namespace) -> int:
    """Query a device; return the exit code."""
    with _lss(options) as (session, master):
        _select(session, master, options)
        address = session.run(master.inquire_address())
        present = session.run(master.inquire_node_id())
    print_table((*HEAD, 'node'), [(*str(address).split(), _node_text(present))])
    return 0


def run_set(options: argparse.Namespace) -> int:
    """Set a device; return the exit code."""
    if options.node_id is None and options.bitrate is None and not options.store:
        raise UsageError('nothing to set: give --node-id, --bitrate or --store')
    if options.activate is not None and options.bitrate is None:
        raise UsageError('--activate needs --bitrate')
    if options.bitrate is not None and options.bitrate not in lss.BIT_RATES.values():
        known = ', '.join(f'{rate // 1000}k' for rate in lss.BIT_RATES.values())
        raise UsageError(f'LSS has no bit rate {options.bitrate / 1000:g}k; take {known}')
    with _lss(options) as (session, master):
        if options.node_id is not None:
            _refuse_taken(session, options.node_id)
        _select(session, master, options)
        address = session.run(master.inquire_address())
        before = session.run(master.inquire_node_id())
        print_line(f'device {address}, node id {_node_text(before)}')
        _configure(session, master, options)
        if options.activate is not None:
            master.activate_bit_rate(options.activate)
            rate = options.bitrate
            warn(f'now switch the interface: ip link set can0 type can bitrate {rate}')
            return 0
        boots = options.node_id is not None and before == UNCONFIGURED
        return _let_go(session, master, options.node_id if boots else None, before)


@contextmanager
def _lss(options: argparse.Namespace) -> Iterator[tuple[Session, LssMaster]]:
    """Open the bus; at the end all devices are in the waiting state, whatever happened."""
    with open_bus(options.can) as bus:
        session = Session(bus)
        master = LssMaster(session.scheduler, session.send, timeout=options.timeout)
        session.listeners.append(master.receive)
        session.listen(MASTER_WAIT)
        if session.masters:
            warn(
                f'a master is on this bus ({", ".join(sorted(session.masters))}); a device that '
                'gets another node id is lost to it'
            )
        try:
            yield session, master
        except BaseException:
            master.switch_all(lss.State.WAITING)
            raise
        if getattr(options, 'activate', None) is None:  # else they are at another bit rate now
            master.switch_all(lss.State.WAITING)


def _select(session: Session, master: LssMaster, options: argparse.Namespace) -> None:
    """Bring one device into the configuration state."""
    master.switch_all(lss.State.WAITING)
    session.listen(PAUSE)
    if options.address:
        session.run(master.select(lss.Address(*options.address)))
    elif options.only:
        master.switch_all(lss.State.CONFIGURATION)
        session.listen(PAUSE)
    elif session.run(master.fast_scan()) is None:
        raise LssError(
            'no device is without node id; choose one that has an id by --address or --only'
        )


def _configure(session: Session, master: LssMaster, options: argparse.Namespace) -> None:
    if options.node_id is not None:
        session.run(master.set_node_id(options.node_id))
        print_line(f'node id {options.node_id}: accepted')
    if options.bitrate is not None:
        session.run(master.set_bit_rate(options.bitrate))
        print_line(f'bit rate {options.bitrate / 1000:g} kbit/s: accepted')
    if options.store:
        session.run(master.store())
        print_line('stored')
    else:
        warn('not stored: the device forgets it without power (--store)')


def _let_go(session: Session, master: LssMaster, new_id: int | None, before: int) -> int:
    """Leave the configuration state; a device without node id boots with its new one then."""
    booted: list[int] = []

    def note(frame: Frame) -> None:
        state = parse_heartbeat(frame.data)
        if frame.can_id & 0x780 == CobId.HEARTBEAT and state is NmtState.BOOT_UP:
            booted.append(frame.can_id & 0x7F)

    session.listeners.append(note)
    master.switch_all(lss.State.WAITING)
    if new_id is None:
        if before != UNCONFIGURED:
            warn('it takes effect with the next reset of the device, or its next power-on')
        return 0
    session.listen(BOOT_WAIT, lambda: new_id in booted)
    if new_id in booted:
        print_line(f'node {new_id} has booted')
        return 0
    warn(f'no boot-up message of node {new_id} came within {BOOT_WAIT:g} s')
    return 1


def _refuse_taken(session: Session, wanted: int) -> None:
    """Refuse a node id whose heartbeat or SDO answer is on the bus."""
    taken = wanted in session.states
    if not taken and not session.masters:
        try:
            session.read(session.client(wanted), Index.DEVICE_TYPE, 0, PROBE_TIMEOUT)
        except SdoTimeoutError:
            return
        except SdoAbortError:
            pass  # a refusal is an answer, too
        taken = True
    if taken:
        raise LssError(f'node id {wanted} is taken: a device answers there; choose another one')


def _node_text(number: int) -> str:
    return 'none' if number == UNCONFIGURED else str(number)
