# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""COB-IDs of all PDOs of a bus: giving out free ones, refusing reserved and doubled ones."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from canopen_core import Findings
from canopen_core.standard import CAN_ID_MASK

from ..model.bus import NodeConfig
from ..model.pdo import Direction, PdoConfig, RPDO, TPDO
from .pdos import AUTO_ID

FREE_RANGE = range(0x680, 0x6E0)
"""Where dcfgen, too, puts the PDOs from the fifth on; no pre-defined service lies there."""

RESERVED: tuple[tuple[range, str], ...] = (
    (range(0x001), 'NMT'),
    (range(0x001, 0x080), 'reserved'),
    (range(0x080, 0x081), 'SYNC'),
    (range(0x081, 0x100), 'emergency messages'),
    (range(0x100, 0x101), 'TIME'),
    (range(0x101, 0x181), 'reserved'),
    (range(0x581, 0x600), 'SDO answers'),
    (range(0x601, 0x680), 'SDO requests'),
    (range(0x6E0, 0x701), 'reserved'),
    (range(0x701, 0x780), 'heartbeats'),
    (range(0x780, CAN_ID_MASK + 1), 'reserved'),
)
"""Identifiers that no PDO may have (CiA 301, tables 38 to 40)."""


def assign_cob_ids(nodes: Sequence[NodeConfig], findings: Findings) -> tuple[NodeConfig, ...]:
    """Give every PDO its final COB-ID, in the order of the file.

    Reserved and doubled identifiers are reported. When only EDS defaults are concerned, these
    are warnings; two RPDOs with one identifier, of which one frame would move two axes, are an
    error.
    """
    used = {pdo.cob_id for node in nodes for _, pdo in node.pdos if pdo.enabled}
    free = iter([cob_id for cob_id in FREE_RANGE if cob_id not in used])
    result = []
    for node in nodes:
        tpdos, rpdos = (
            tuple(_assigned(node, direction, pdo, free, findings) for pdo in pdos)
            for direction, pdos in ((TPDO, node.tpdos), (RPDO, node.rpdos))
        )
        result.append(replace(node, tpdos=tpdos, rpdos=rpdos))
    owners: dict[int, tuple[str, PdoConfig]] = {}
    commanded: dict[int, tuple[str, PdoConfig]] = {}  # those of RPDOs
    for node in result:
        for direction, pdo in node.pdos:
            if pdo.enabled and pdo.cob_id:
                own = _title(node, direction, pdo), pdo
                _check(own, owners, commanded if direction is RPDO else {}, findings)
    return tuple(result)


def _title(node: NodeConfig, direction: Direction, pdo: PdoConfig) -> str:
    return f'{direction.title} {pdo.number} of {node.name}'


def _assigned(
    node: NodeConfig,
    direction: Direction,
    pdo: PdoConfig,
    free: Iterator[int],
    findings: Findings,
) -> PdoConfig:
    if pdo.cob_id != AUTO_ID:
        return pdo
    cob_id = next(free, 0)
    if not cob_id:
        findings.error(
            pdo.place,
            f'no free COB-ID is left for {_title(node, direction, pdo)} between 0x680 and 0x6DF',
            'write a COB-ID that the bus does not use',
        )
    return replace(pdo, cob_id=cob_id)


def _check(
    own: tuple[str, PdoConfig],
    owners: dict[int, tuple[str, PdoConfig]],
    commanded: dict[int, tuple[str, PdoConfig]],
    findings: Findings,
) -> None:
    """Report an identifier that is reserved, or has an owner already."""
    title, pdo = own
    for purpose in (purpose for ids, purpose in RESERVED if pdo.cob_id in ids):
        message = f'COB-ID 0x{pdo.cob_id:03X} of {title} is not for PDOs ({purpose})'
        _report(findings, [pdo], message)
    owner = owners.setdefault(pdo.cob_id, own)
    other = commanded.setdefault(pdo.cob_id, own) if pdo.mapping else own
    both_command = other is not own
    owner = other if both_command else owner
    if owner is not own:
        _report(
            findings,
            [pdo, owner[1]],
            f'COB-ID 0x{pdo.cob_id:03X} of {title} is also that of {owner[0]} '
            f'(line {owner[1].place.line})',
            certain=both_command,
        )


def _report(
    findings: Findings, pdos: list[PdoConfig], message: str, *, certain: bool = False
) -> None:
    if certain or any(pdo.configured for pdo in pdos):
        remedy = "name each PDO in bus.yml with 'cob_id: auto', or 'enabled: false'"
        findings.error(pdos[0].place, message, remedy)
    else:
        remedy = 'name the PDO in bus.yml if the device does not add its node id to the default'
        findings.warning(pdos[0].place, message, remedy)
