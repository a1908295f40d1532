# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``canopen dcf BUS.yml``: files for Lely's tools, as its dcfgen writes them."""

from __future__ import annotations

import argparse
from pathlib import Path

from arm_canopen.config import load_bus, SdoWrite

from ..dcf.concise import device_writes, encode_concise, master_writes
from ..dcf.master import master_dcf
from ..monitor.object_names import ObjectNames
from ..monitor.value_text import data_text
from .arguments import SubParsers
from .output import counted, print_line, warn


def add_parser(parsers: SubParsers) -> None:
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
    """Write a concise DCF; without writes there is none, also not of an earlier run."""
    if writes:
        path.write_bytes(encode_concise(writes))
    else:
        path.unlink(missing_ok=True)


def _show(names: ObjectNames, writes: list[SdoWrite]) -> None:
    for write in writes:
        data_type = names.data_type(write.index, write.subindex)
        value = data_text(write.index, write.subindex, data_type, write.data)
        print_line(f'    {names.title(write.index, write.subindex)} = {value}')
