# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``canopen read`` and ``canopen write``: objects of a device by name or number."""

from __future__ import annotations

import argparse

from canopen_core import CodecError, SdoAbortError
from canopen_core.can import open_bus
from canopen_core.eds import bytes_from_text, text_from_bytes
from canopen_core.standard import DataType, Index, ObjectEntry, sdo

from ..monitor.object_names import ObjectNames
from ..monitor.value_text import data_text
from .arguments import add_node_arguments, SubParsers, UsageError
from .output import print_line, warn
from .session import Session
from .target import find_target, Target, warn_of_master

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
"""Objects that return something else than what is written to them (CiA 301, 7.5.2.13)."""


def add_parser(parsers: SubParsers) -> None:
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
            data = _upload(session, target, entry)
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
            held = _upload(session, target, entry)
        except SdoAbortError as error:  # commands, and what restarts the device
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


def _upload(session: Session, target: Target, entry: ObjectEntry) -> bytes:
    client = session.client(target.node_id, target.name, target.dictionary)
    long = entry.data_type in LONG_TYPES
    data = session.read(client, *entry.address, target.timeout, block=long)
    return sdo.fitted(entry.data_type, data)  # of the type that --type names


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
