# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``canopen dbc BUS.yml``: what the bus carries, as a DBC for tools that know no CANopen.

The PDOs are those of the bus after boot: mappings of bus.yml where it has them, with its scales.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
import re

from arm_canopen.config import BusConfig, DriveConfig, load_bus, NodeConfig, PdoConfig
from canopen_core.standard import (
    axis_of,
    CobId,
    DataType,
    Index,
    MappedObject,
    NmtState,
)

from ..monitor.object_names import ObjectNames
from .arguments import SubParsers, UsageError
from .output import print_line, warn

NAME_MAX = 32  # characters of a name (DBC format of Vector)
NODE_NAME_MAX = NAME_MAX - len('_heartbeat')
FLOATS = {DataType.REAL32: 1, DataType.REAL64: 2}  # SIG_VALTYPE_
POSITIONS = {Index.POSITION_DEMAND, Index.POSITION_ACTUAL, Index.TARGET_POSITION}
DISTANCES = {Index.FOLLOWING_ERROR, Index.POSITION_OFFSET}
VELOCITIES = {
    *(Index.VELOCITY_DEMAND, Index.VELOCITY_ACTUAL, Index.TARGET_VELOCITY),
    *(Index.VELOCITY_OFFSET, Index.PROFILE_VELOCITY, Index.MAX_PROFILE_VELOCITY),
}
ACCELERATIONS = {Index.PROFILE_ACCELERATION, Index.PROFILE_DECELERATION}
EFFORTS = {Index.TARGET_TORQUE, Index.TORQUE_DEMAND, Index.TORQUE_ACTUAL, Index.TORQUE_OFFSET}


def add_parser(parsers: SubParsers) -> None:
    """Add the verb."""
    parser = parsers.add_parser(
        'dbc',
        help='write a DBC, by which SavvyCAN, PlotJuggler, cantools or asammdf read a log',
        description='Write the frames of a bus as a DBC: PDOs as they are mapped after the boot, '
        'in the user units of bus.yml (scales that a drive reports are not known), with '
        'heartbeats and emergencies.',
    )
    parser.add_argument('bus_yml', metavar='BUS.yml', type=Path)
    parser.add_argument(
        '--out', metavar='FILE', type=Path, help='where to (default: BUS.dbc beside BUS.yml)'
    )
    parser.add_argument(
        '--metre',
        metavar='JOINT',
        action='append',
        default=[],
        help='a joint that slides, whose unit is m and not rad; may be given several times',
    )
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Write the file; return the exit code."""
    config = load_bus(options.bus_yml)
    for warning in config.warnings:
        warn(str(warning))
    if unknown := set(options.metre) - set(config.joints):
        joints = ', '.join(config.joints)
        raise UsageError(f'--metre: no joint {", ".join(sorted(unknown))}; joints: {joints}')
    out: Path = options.out or options.bus_yml.with_suffix('.dbc')
    out.write_text(dbc(config, frozenset(options.metre)), encoding='ascii')
    print_line(f'{out}: {sum(1 for _ in _pdos(config))} PDOs of {len(config.nodes)} devices')
    return 0


def dbc(config: BusConfig, sliding: frozenset[str] = frozenset()) -> str:
    """Return the DBC of a bus.

    Args:
        config: The bus.
        sliding: Joints whose unit is m.
    """
    master, names = config.master.name, node_names(config)
    states = ' '.join(f'{state.value} "{state.name}"' for state in NmtState)
    lines = [
        'VERSION ""',
        '',
        'NS_ :',
        '',
        'BS_:',
        '',
        f'BU_: {master} {" ".join(names.values())}',
    ]
    tail = []
    for node, is_sent, pdo in _pdos(config):
        name = f'{names[node.node_id]}_{"TPDO" if is_sent else "RPDO"}{pdo.number}'
        sender, receiver = names[node.node_id], master
        if not is_sent:
            sender, receiver = receiver, sender
        size = (sum(entry.bits for entry in pdo.mapping) + 7) // 8
        lines += ['', f'BO_ {pdo.cob_id} {name}: {size} {sender}']
        for signal, start, entry in _signals(node, pdo):
            factor, offset, unit = _scale(node, entry, sliding, is_sent=is_sent)
            is_signed = entry.data_type in FLOATS or entry.data_type.name.startswith('INTEGER')
            bits = f'{start}|{entry.bits}@1{"-" if is_signed else "+"}'
            lines.append(
                f' SG_ {signal} : {bits} ({factor!r},{offset!r}) [0|0] "{unit}" {receiver}'
            )
            if entry.data_type in FLOATS:
                tail.append(f'SIG_VALTYPE_ {pdo.cob_id} {signal} : {FLOATS[entry.data_type]};')
    for node in config.nodes:
        name, heartbeat = names[node.node_id], CobId.HEARTBEAT + node.node_id
        lines += ['', f'BO_ {heartbeat} {name}_heartbeat: 1 {name}']
        lines.append(f' SG_ NMT_state : 0|7@1+ (1,0) [0|127] "" {master}')
        tail.append(f'VAL_ {heartbeat} NMT_state {states} ;')
        if node.emergency_id is not None:
            lines += ['', f'BO_ {node.emergency_id} {name}_EMCY: 8 {name}']
            lines.append(f' SG_ Error_code : 0|16@1+ (1,0) [0|65535] "" {master}')
            lines.append(f' SG_ Error_register : 16|8@1+ (1,0) [0|255] "" {master}')
    return '\n'.join([*lines, '', *tail, ''])


def identifier(name: str, suffix: str = '') -> str:
    """Return a name as a DBC allows it: letters, digits and underscores, not too many."""
    text = re.sub(r'\W|^(?=\d)', '_', name, flags=re.ASCII)
    return text[: NAME_MAX - len(suffix)] + suffix


def node_names(config: BusConfig) -> dict[int, str]:
    """Return the name of each device by its node id; a long one is cut, and ends with the id."""
    return {
        node.node_id: node.name
        if len(node.name) <= NODE_NAME_MAX
        else f'{node.name[: NODE_NAME_MAX - 4]}_{node.node_id}'
        for node in config.nodes
    }


def _pdos(config: BusConfig) -> Iterator[tuple[NodeConfig, bool, PdoConfig]]:
    """Yield the PDOs that are on the bus, and whether the device sends them."""
    for node in config.nodes:
        for is_sent, pdos in ((True, node.tpdos), (False, node.rpdos)):
            for pdo in pdos:
                if pdo.enabled and pdo.mapping:
                    yield node, is_sent, pdo


def _signals(node: NodeConfig, pdo: PdoConfig) -> Iterator[tuple[str, int, MappedObject]]:
    """Yield name and first bit of each object of a PDO; dummies and gaps have no name."""
    names, used, start = ObjectNames(node.dictionary), set[str](), 0
    for entry in pdo.mapping:
        if entry.index >= Index.DEVICE_TYPE:
            address = f'_{entry.index:04X}_{entry.subindex:X}'
            name = identifier(names.name(entry.index, entry.subindex) or f'object{address}')
            if name in used:
                name = identifier(name, address)
            used.add(name)
            yield name, start, entry
        start += entry.bits


def _scale(
    node: NodeConfig, entry: MappedObject, sliding: frozenset[str], *, is_sent: bool
) -> tuple[float, float, str]:
    """Return factor, offset and unit of an object; (1, 0) where bus.yml gives it no scale."""
    axes = {axis.channel: axis for axis in node.axes} if node.is_drive else {}
    index, channel = axis_of(entry.index)
    axis = axes.get(channel)
    if axis is None:
        return 1, 0, ''
    unit = 'm' if (axis.name or node.name) in sliding else 'rad'
    if index in POSITIONS:
        return *_way(axis, 'pos', is_sent=is_sent, offset=True), unit
    if index in DISTANCES:
        return *_way(axis, 'pos', is_sent=is_sent), unit
    if index in VELOCITIES:
        return *_way(axis, 'vel', is_sent=is_sent), f'{unit}/s'
    if index in ACCELERATIONS:
        quantity = 'acc' if axis.scale_acc_to_dev else 'vel'
        return *_way(axis, quantity, is_sent=is_sent), f'{unit}/s2'
    if index in EFFORTS:
        return *_way(axis, 'eff', is_sent=is_sent), ''
    return 1, 0, ''


def _way(
    axis: DriveConfig, quantity: str, *, is_sent: bool, offset: bool = False
) -> tuple[float, float]:
    """Return factor and offset from device units, of what is measured or was commanded."""
    if is_sent:
        added = float(axis.offset_pos_from_dev) if offset else 0.0
        return float(getattr(axis, f'scale_{quantity}_from_dev')), added
    factor = 1.0 / float(getattr(axis, f'scale_{quantity}_to_dev'))
    return factor, 0.0 - factor * axis.offset_pos_to_dev if offset else 0.0
