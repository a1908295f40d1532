# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``canopen dcf BUS.yml``: files for Lely's tools, as written by dcfgen.

A concise DCF holds the writes that configure a device (CiA 302-3, 0x1F22): the number of writes as
UNSIGNED32, then for each write index (UNSIGNED16), sub-index (UNSIGNED8), data length in [byte]
(UNSIGNED32) and data, all little-endian.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from pathlib import Path
import struct

from arm_canopen.config import boot_writes, BootWrite, BusConfig, load_bus, NodeConfig, SdoWrite
from canopen_core.standard import COB_ID_INVALID, DataType, encode, Index, ObjectEntry, pdo_object

from ..dcf_master import master_dcf
from ..monitor.sdo_follower import data_text, ObjectNames
from .arguments import counted, print_line, SubParsers, warn


def add_dcf(parsers: SubParsers) -> None:
    """Add the verb."""
    parser = parsers.add_parser(
        'dcf',
        help='write master.dcf and .bin files for other masters',
        description='Write master.dcf, and for each device with objects to write a concise DCF '
        '(<device>.bin), in the format and order of dcfgen, for masters built on Lely.',
    )
    parser.add_argument('bus_yml', metavar='BUS.yml', type=Path)
    parser.add_argument(
        '--out', metavar='DIR', type=Path, default=Path(), help='where to (default: here)'
    )
    parser.add_argument(
        '--path',
        metavar='DIR',
        help='folder in which the master will find the .bin files (default: that of --out)',
    )
    parser.add_argument(
        '--complete',
        action='store_true',
        help='write also what the EDS has as default, for devices that hold something else',
    )
    parser.add_argument(
        '-v', '--verbose', action='store_true', help='show what is written to each device'
    )
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Write the files; return the exit code."""
    config = load_bus(options.bus_yml)
    for warning in config.warnings:
        warn(str(warning))
    out: Path = options.out
    out.mkdir(parents=True, exist_ok=True)
    folder = Path(options.path) if options.path else out.absolute()
    writes = {
        node.name: device_writes(config, node, complete=options.complete) for node in config.nodes
    }
    for name, entries in writes.items():
        _write(out / f'{name}.bin', entries)
    own = master_writes(config)
    _write(out / 'master.bin', own)
    upload_files = {
        node.node_id: str(folder / f'{node.name}.bin')
        for node in config.nodes
        if writes[node.name]
    }
    (out / 'master.dcf').write_text(master_dcf(config, upload_files), encoding='utf-8')
    for node in config.nodes:
        print_line(f'{out / node.name}.bin: {counted(len(writes[node.name]), "write")}')
        if options.verbose:
            _show(ObjectNames(node.dictionary), writes[node.name])
    if own:
        print_line(f'{out / "master.bin"}: {counted(len(own), "write")}')
    print_line(f'{out / "master.dcf"}: {counted(len(config.nodes), "device")}')
    return 0


def _write(path: Path, writes: list[SdoWrite]) -> None:
    """Write a concise DCF; without writes, remove a file of an earlier run."""
    if writes:
        path.write_bytes(encode_concise(writes))
    else:
        path.unlink(missing_ok=True)


def _show(names: ObjectNames, writes: list[SdoWrite]) -> None:
    for write in writes:
        data_type = names.data_type(write.index, write.subindex)
        value = data_text(write.index, write.subindex, data_type, write.data)
        print_line(f'    {names.title(write.index, write.subindex)} = {value}')


COUNT = struct.Struct('<I')
ENTRY = struct.Struct('<HBI')

EXPECTED_REVISION = 0x1F87  # expected values of devices in the master (CiA 302-2)
EXPECTED_SERIAL = 0x1F88


def encode_concise(writes: Iterable[SdoWrite]) -> bytes:
    """Encode writes as a concise DCF."""
    entries = [ENTRY.pack(w.index, w.subindex, len(w.data)) + w.data for w in writes]
    return COUNT.pack(len(entries)) + b''.join(entries)


def device_writes(
    config: BusConfig, node: NodeConfig, *, complete: bool = False
) -> list[SdoWrite]:
    """Return a master's writes to a device at boot, in the order of dcfgen.

    With complete they include EDS defaults; dcfgen omits those, so that a device with other
    values keeps them.
    """
    return [
        SdoWrite(*write.address, _value(node, write))
        for write in boot_writes(config, node)
        if _is_needed(node, write, complete=complete)
    ]


def master_writes(config: BusConfig) -> list[SdoWrite]:
    """Return the writes to the master's own dictionary; if empty, no file is needed."""
    numbers = [(int(Index.IDENTITY), 4, config.master.identity.serial_number)]
    for node in config.nodes:
        numbers.append((EXPECTED_REVISION, node.node_id, node.identity.revision_number))
        numbers.append((EXPECTED_SERIAL, node.node_id, node.identity.serial_number))
    return [
        SdoWrite(index, subindex, encode(DataType.UNSIGNED32, number))
        for index, subindex, number in numbers
        if number
    ]


def _is_needed(node: NodeConfig, write: BootWrite, *, complete: bool) -> bool:
    """Return whether dcfgen would write this: not our own mappings or timers, and no defaults.

    Our boot continues if a device refuses such mappings or timers; another master would fail.
    """
    pdo = pdo_object(write.index)
    is_own_mapping = pdo is not None and pdo.is_mapping and not write.requested
    if write.is_own_timer or is_own_mapping:
        return False
    if complete or not write.unless_default:
        return True
    entry = _entry(node, write)
    if entry is None or entry.default is None:
        return True
    return _value(node, write) != encode(entry.data_type, entry.default)


def _value(node: NodeConfig, write: BootWrite) -> bytes:
    """Return the data; COB-ID bits that bus.yml leaves open keep the EDS value."""
    entry = _entry(node, write)
    present = entry.default if entry is not None else None
    if write.mask is None or not isinstance(present, int):
        return write.data
    if write.mask == COB_ID_INVALID:
        return write.data if write.temporary and write.requested else write.over(present)
    is_open = not write.requested and not present & COB_ID_INVALID
    return encode(DataType.UNSIGNED32, present) if is_open else write.data


def _entry(node: NodeConfig, write: BootWrite) -> ObjectEntry | None:
    """Return the entry of the EDS; None if a DCF replaced its default, which is then unknown."""
    entry = node.dictionary.get(*write.address)
    return None if entry is None or entry.configured else entry
