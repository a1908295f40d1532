# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``canopen diff NODE``: what a device holds, against its files."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import suppress

from arm_canopen.config import (
    BootWrite,
    BusConfig,
    consumer_to_read,
    held_after_boot,
    HeldConsumers,
    NodeConfig,
)
from canopen_core import CodecError, SdoAbortError
from canopen_core.can import open_bus
from canopen_core.standard import (
    abort_text,
    DataType,
    encode,
    Index,
    ObjectDictionary,
)

from ..monitor.object_names import ObjectNames
from ..monitor.value_text import data_text
from .arguments import add_node_arguments, SubParsers, UsageError
from .output import print_line, print_table
from .session import Session
from .target import find_target, Target, warn_of_master

FROM_EDS = ('device_type', 'vendor_id', 'product_code')
"""The identity that the EDS has; the rest is in bus.yml."""


def add_parser(parsers: SubParsers) -> None:
    """Add the verb."""
    parser = parsers.add_parser(
        'diff',
        help='compare a device with bus.yml and EDS',
        description='Read every object of a device that bus.yml configures, and show where it '
        'differs; without bus.yml every object that has a default in the EDS. Nothing is written. '
        'Exit code: 0 when all is equal, 1, 2 wrong usage.',
    )
    add_node_arguments(parser)
    parser.add_argument(
        '--defaults',
        action='store_true',
        help='compare objects that bus.yml does not configure with their defaults in the EDS',
    )
    parser.add_argument('--all', action='store_true', help='show what is equal, too')
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Compare a device; return the exit code."""
    target = find_target(options)
    _objects(
        target, {}, defaults=options.defaults
    )  # what cannot be is reported before the bus opens
    with open_bus(options.can) as bus:
        session = Session(bus, target.bus)
        warn_of_master(session, target)
        objects = _objects(target, _consumers(session, target), defaults=options.defaults)
        rows = [_compared(session, target, expected) for expected in objects]
    different = [row for row in rows if row[0] != '=']
    if shown := rows if options.all else different:
        print_table(('', 'object', 'file', 'device', 'source'), shown)
    print_line(
        f'{target.name}: {len(rows)} objects compared, {len(different) or "none"} different'
    )
    return 1 if different else 0


def _consumers(session: Session, target: Target) -> HeldConsumers:
    """Return what the device has in the entries of 0x1016 of which boot takes one."""
    held: dict[int, int | None] = {}
    if target.bus is None or target.config is None:
        return held
    while (subindex := consumer_to_read(target.bus, target.config, held)) is not None:
        held[subindex] = None
        with suppress(SdoAbortError):
            data = _read(session, target, Index.CONSUMER_HEARTBEAT, subindex)
            held[subindex] = int.from_bytes(data, 'little')
    return held


def _objects(target: Target, consumers: HeldConsumers, *, defaults: bool) -> list[BootWrite]:
    """Return what to compare; consumers are what the device has in 0x1016, by sub-index."""
    configured: list[BootWrite] = []
    if target.bus is not None and target.config is not None:
        configured = expected_objects(target.bus, target.config, consumers)
    if not configured and not target.described:
        raise UsageError(
            f'no file describes {target.name}; give --bus-config BUS.yml with this '
            'device in it, or --eds FILE'
        )
    if configured and not defaults:
        return configured
    known = {(item.index, item.subindex) for item in configured}
    return configured + [
        item
        for item in expected_defaults(target.dictionary)
        if (item.index, item.subindex) not in known
    ]


def expected_objects(
    config: BusConfig, node: NodeConfig, consumers: HeldConsumers | None = None
) -> list[BootWrite]:
    """Return everything that bus.yml decides of a device: its identity, and what boot leaves.

    Consumers are what the device has in 0x1016, by sub-index; None: those of its EDS.
    """
    return [*_identity(node), *held_after_boot(config, node, consumers)]


def expected_defaults(dictionary: ObjectDictionary) -> Iterator[BootWrite]:
    """Yield what every object that can be read and written holds by its EDS."""
    for entry in dictionary:
        if entry.default is None or not (entry.access.readable and entry.access.writable):
            continue
        try:
            data = encode(entry.data_type, entry.default)
        except CodecError:
            continue
        yield BootWrite(*entry.address, data, 'EDS')


def _identity(node: NodeConfig) -> Iterator[BootWrite]:
    for attribute, index, subindex, value in node.identity.objects:
        key = 'EDS' if attribute in FROM_EDS else attribute
        yield BootWrite(index, subindex, encode(DataType.UNSIGNED32, value), key)


def _read(session: Session, target: Target, index: int, subindex: int) -> bytes:
    if session.masters:
        session.await_quiet(target.node_id)
    client = session.client(target.node_id, target.name, target.dictionary)
    return session.read(client, index, subindex, target.timeout)


def _compared(session: Session, target: Target, expected: BootWrite) -> tuple[str, ...]:
    """Return the row of an object: whether it is equal, what it should hold, and what it holds."""
    try:
        data = _read(session, target, expected.index, expected.subindex)
    except SdoAbortError as error:
        mark, held = '*', abort_text(error.code)
    else:
        mark, held = '=' if expected.fits(data) else '*', _text(target, expected, data)
    title = ObjectNames(target.dictionary).title(expected.index, expected.subindex)
    return mark, title, _text(target, expected, expected.data), held, expected.key


def _text(target: Target, expected: BootWrite, data: bytes) -> str:
    entry = target.dictionary.get(expected.index, expected.subindex)
    return data_text(
        expected.index, expected.subindex, entry.data_type if entry is not None else None, data
    )
