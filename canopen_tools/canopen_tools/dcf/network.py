# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The objects by which a master manages the network: 0x1F20 to 0x1F8A (CiA 302-2 and 302-3)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from arm_canopen.config import BusConfig, MasterConfig, NodeConfig
from arm_canopen.config.units import MILLISECONDS
from arm_canopen.standard import AccessType, DataType, ObjectCode

from .text import DcfArray, DcfEntry, DcfObject, DcfRecord

U8, U32, DOMAIN = DataType.UNSIGNED8, DataType.UNSIGNED32, DataType.DOMAIN
RO, RW, WO = AccessType.READ_ONLY, AccessType.READ_WRITE, AccessType.WRITE_ONLY
NODES = 127

IS_MASTER, START_ALL, NO_OWN_START = 0x01, 0x02, 0x04
NO_START, RESET_ALL, STOP_ALL = 0x08, 0x10, 0x40
"""Bits of 0x1F80, NMT start-up (CiA 302-2, 7.2)."""
IS_SLAVE, BOOT, MANDATORY, KEEP_ALIVE, RESTORE = 0x01, 0x04, 0x08, 0x10, 0x80
"""Bits of 0x1F81, slave assignment (CiA 302-2, 7.3); bits 8 to 15 are the retry factor, 16 to 31
the guard time."""


def network_objects(
    config: BusConfig, upload_files: Mapping[int, str]
) -> Iterator[tuple[int, DcfObject]]:
    """Yield the objects by index; upload_files has the paths of concise DCFs by node id."""
    nodes = config.nodes
    if upload_files:
        yield 0x1F22, _files('Concise DCF', upload_files)
    yield 0x1F25, DcfArray('Configuration request', U8, WO, NODES)
    yield 0x1F55, DcfArray('Expected software identification', U32, RW, NODES)
    yield 0x1F80, DcfEntry('NMT start-up', U32, RW, f'0x{_start_up(config.master):08X}')
    assignment = {node.node_id: f'0x{_assignment(node):08X}' for node in nodes}
    yield 0x1F81, DcfArray('NMT slave assignment', U32, RW, NODES, assignment)
    yield 0x1F82, DcfArray('Request NMT', U8, RW, NODES)
    for index, name, attribute in (
        (0x1F84, 'Device type identification', 'device_type'),
        (0x1F85, 'Vendor identification', 'vendor_id'),
        (0x1F86, 'Product code', 'product_code'),
    ):
        values = {node.node_id: getattr(node.identity, attribute) for node in nodes}
        texts = {node_id: f'0x{value:08X}' for node_id, value in values.items() if value}
        yield index, DcfArray(name, U32, RW, NODES, texts)
    # master.bin has the values of these two
    yield 0x1F87, DcfArray('Revision number', U32, RW, NODES)
    yield 0x1F88, DcfArray('Serial number', U32, RW, NODES)
    boot_time = str(round(config.master.boot_time * MILLISECONDS))
    yield 0x1F89, DcfEntry('Boot time', U32, RW, boot_time)
    restored = {
        node.node_id: f'0x{node.restore_configuration:02X}'
        for node in nodes
        if node.restore_configuration
    }
    yield 0x1F8A, DcfArray('Restore configuration', U8, RW, NODES, restored)


def _files(name: str, paths: Mapping[int, str]) -> DcfRecord:
    parts = [
        DcfEntry(f'Node-ID {node_id}', DOMAIN, RO, upload_file=paths.get(node_id, ''))
        for node_id in range(1, NODES + 1)
    ]
    return DcfRecord(name, parts, ObjectCode.ARRAY)


def _start_up(master: MasterConfig) -> int:
    return (
        IS_MASTER
        | START_ALL * master.start_all_nodes
        | NO_OWN_START * (not master.start)
        | NO_START * (not master.start_nodes)
        | RESET_ALL * master.reset_all_nodes
        | STOP_ALL * master.stop_all_nodes
    )


def _assignment(node: NodeConfig) -> int:
    return (
        IS_SLAVE
        | BOOT * node.boot
        | MANDATORY * node.mandatory
        | KEEP_ALIVE * (not node.reset_communication)
        | RESTORE * bool(node.restore_configuration)
        | node.retry_factor << 8
        | round(node.guard_time * MILLISECONDS) << 16
    )
