# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``canopen read``, ``write`` and ``diff``: read, write and compare a device's objects."""

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
from canopen_core.eds import bytes_from_text, text_from_bytes
from canopen_core.standard import (
    abort_text,
    DataType,
    encode,
    Index,
    ObjectDictionary,
    ObjectEntry,
    sdo,
)

from ..monitor.sdo_follower import data_text, ObjectNames
from .arguments import add_node_arguments, print_line, print_table, SubParsers, UsageError, warn
from .target import find_target, Session, Target, warn_of_master

SHORT_TYPES: dict[str | None, DataType] = {
    'bool': DataType.BOOLEAN,
    **{f'i{bits}': DataType[f'INTEGER{bits}'] for bits in (8, 16, 24, 32, 40, 48, 56, 64)},
    **{f'u{bits}': DataType[f'UNSIGNED{bits}'] for bits in (8, 16, 24, 32, 40, 48, 56, 64)},
    'f32': DataType.REAL32,
    'f64': DataType.REAL64,
    'text': DataType.VISIBLE_STRING,
    'bytes': DataType.DOMAIN,
}
"""Names of types on the command line."""

LONG_TYPES = frozenset({DataType.DOMAIN, DataType.VISIBLE_STRING, DataType.OCTET_STRING})

COMMANDS = frozenset({Index.STORE_PARAMETERS, Index.RESTORE_PARAMETERS})
"""Objects that do not read back the written value (CiA 301, 7.5.2.13)."""


def add_read_and_write(parsers: SubParsers) -> None:
    """Add both verbs."""
    reader = parsers.add_parser(
        'read',
        help='read objects of a device by name or number',
        description='Read objects of a device by SDO. OBJECT is a number (0x6041, 0x607D:02), or '
        'with --bus-config or --eds a name ("Statusword", "Software position limit/Max").',
    )
    add_node_arguments(reader)
    reader.add_argument('objects', metavar='OBJECT', nargs='+')
    reader.add_argument('--value', action='store_true', help='print values only, for scripts')
    reader.set_defaults(run=read)
    writer = parsers.add_parser(
        'write',
        help='write an object of a device by name or number',
        description='Write an object of a device by SDO, and read it back. VALUE is a number, '
        'true or false, a text, or bytes in hexadecimal, as the type of the object is.',
    )
    add_node_arguments(writer)
    writer.add_argument('object', metavar='OBJECT')
    writer.add_argument('value', metavar='VALUE')
    writer.set_defaults(run=write)
    for parser in (reader, writer):
        parser.add_argument(
            '--type', choices=list(SHORT_TYPES), help='type of the object, when no file has it'
        )


def read(options: argparse.Namespace) -> int:
    """Read objects; return the exit code."""
    target = find_target(options)
    entries = [target.entry(path, SHORT_TYPES.get(options.type)) for path in options.objects]
    with open_bus(options.can) as bus:
        session = Session(bus, target.bus)
        warn_of_master(session, target)
        for entry in entries:
            data = _read_entry(session, target, entry)
            if options.value:
                print_line(_plain(entry, data))
            else:
                print_line(f'{_title(target, entry)} = {_meaning(entry, data)}')
    return 0


def write(options: argparse.Namespace) -> int:
    """Write an object and read it back; return the exit code."""
    target = find_target(options)
    entry = target.entry(options.object, SHORT_TYPES.get(options.type))
    data = _data(target, entry, options)
    with open_bus(options.can) as bus:
        session = Session(bus, target.bus)
        warn_of_master(session, target)

        async def download() -> None:
            client = session.client(target.node_id, target.name, target.dictionary)
            await client.write(*entry.address, data, target.write_timeout(entry))

        session.run(download())
        title = _title(target, entry)
        if entry.index in COMMANDS or not entry.access.readable:
            print_line(f'{title} was written')
            return 0
        try:
            held = _read_entry(session, target, entry)
        except SdoAbortError as error:  # commands, and objects that restart the device
            print_line(f'{title} was written')
            warn(f'it cannot be read back: {error}')
            return 0
    print_line(f'{title} = {_meaning(entry, held)}')
    if held != data:
        warn(f'the device holds another value than {_meaning(entry, data)}, which was written')
        return 1
    return 0


def _data(target: Target, entry: ObjectEntry, options: argparse.Namespace) -> bytes:
    """Encode the value of the command line."""
    if not entry.access.writable:
        raise UsageError(
            f'{entry} is read-only ({entry.access.value}) in {target.dictionary.source}'
        )
    if entry.data_type is DataType.DOMAIN and not target.described and options.type is None:
        raise UsageError(
            f'the type of {entry} is unknown; name it with --type, --eds or --bus-config'
        )
    try:
        return bytes_from_text(entry.data_type, options.value)
    except CodecError as error:
        raise UsageError(f'{entry}: {error}') from error


def _read_entry(session: Session, target: Target, entry: ObjectEntry) -> bytes:
    data = _read(session, target, *entry.address, block=entry.data_type in LONG_TYPES)
    return sdo.fitted(entry.data_type, data)  # with the type of --type


def _title(target: Target, entry: ObjectEntry) -> str:
    return ObjectNames(target.dictionary).title(*entry.address)


def _meaning(entry: ObjectEntry, data: bytes) -> str:
    known = None if entry.data_type is DataType.DOMAIN else entry.data_type
    return data_text(*entry.address, known, data)


def _plain(entry: ObjectEntry, data: bytes) -> str:
    try:
        return text_from_bytes(entry.data_type, data)
    except CodecError:
        return data.hex(' ')


FROM_EDS = ('device_type', 'vendor_id', 'product_code')
"""Identity attributes from the EDS; the others are in bus.yml."""


def add_diff(parsers: SubParsers) -> None:
    """Add the verb."""
    parser = parsers.add_parser(
        'diff',
        help='compare a device with bus.yml and EDS',
        description='Read every object of a device that bus.yml configures, and show where it '
        'differs; without bus.yml every object that has a default in the EDS. Nothing is written. '
        'Exit code: 0 when all is equal, 1, 2 wrong usage.',
    )
    add_node_arguments(parser)
    parser.add_argument('--all', action='store_true', help='show what is equal, too')
    parser.set_defaults(run=diff)


def diff(options: argparse.Namespace) -> int:
    """Compare a device; return the exit code."""
    target = find_target(options)
    _objects(target, {})  # report errors before the bus opens
    with open_bus(options.can) as bus:
        session = Session(bus, target.bus)
        warn_of_master(session, target)
        objects = _objects(target, _consumers(session, target))
        rows = [_compared(session, target, expected) for expected in objects]
    different = [row for row in rows if row[0] != '=']
    if shown := rows if options.all else different:
        print_table(('', 'object', 'file', 'device', 'source'), shown)
    print_line(
        f'{target.name}: {len(rows)} objects compared, {len(different) or "none"} different'
    )
    return 1 if different else 0


def _consumers(session: Session, target: Target) -> HeldConsumers:
    """Read the entries of 0x1016 among which boot would choose, by sub-index."""
    held: dict[int, int | None] = {}
    if target.bus is None or target.config is None:
        return held
    while (subindex := consumer_to_read(target.bus, target.config, held)) is not None:
        held[subindex] = None
        with suppress(SdoAbortError):
            data = _read(session, target, Index.CONSUMER_HEARTBEAT, subindex)
            held[subindex] = int.from_bytes(data, 'little')
    return held


def _objects(target: Target, consumers: HeldConsumers) -> list[BootWrite]:
    """Return what to compare; consumers are the device's 0x1016 values by sub-index."""
    if target.bus is not None and target.config is not None:
        return expected_objects(target.bus, target.config, consumers)
    if not target.described:
        raise UsageError(
            f'no file describes {target.name}; give --bus-config BUS.yml with this '
            'device in it, or --eds FILE'
        )
    return list(expected_defaults(target.dictionary))


def expected_objects(
    config: BusConfig, node: NodeConfig, consumers: HeldConsumers | None = None
) -> list[BootWrite]:
    """Return all objects that bus.yml determines: identity, and values after boot.

    consumers are the device's 0x1016 values by sub-index; None uses those of its EDS.
    """
    return [*_identity(node), *held_after_boot(config, node, consumers)]


def expected_defaults(dictionary: ObjectDictionary) -> Iterator[BootWrite]:
    """Yield the EDS default of every readable and writable object."""
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


def _read(
    session: Session, target: Target, index: int, subindex: int, *, block: bool = False
) -> bytes:
    if session.masters:
        session.await_quiet(target.node_id)
    client = session.client(target.node_id, target.name, target.dictionary)
    return session.read(client, index, subindex, target.timeout, block=block)


def _compared(session: Session, target: Target, expected: BootWrite) -> tuple[str, ...]:
    """Compare an object; return its table row: mark, title, expected and actual value, source."""
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
