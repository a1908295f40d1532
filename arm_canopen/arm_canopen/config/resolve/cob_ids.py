# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""COB-IDs of all PDOs of a bus: giving out free ones, refusing reserved and doubled ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ...standard.cob_id import CAN_ID_MASK
from ..findings import Findings
from ..model.pdo_direction import RPDO
from .pdos import PdoDraft

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


def assign_cob_ids(drafts: Sequence[PdoDraft], findings: Findings) -> list[PdoDraft]:
    """Give every PDO its final COB-ID, in the order of the file.

    Reserved and doubled identifiers are reported. When only EDS defaults are concerned, these
    are warnings; two RPDOs with one identifier, of which one frame would move two axes, are an
    error.
    """
    used = {draft.config.cob_id for draft in drafts if draft.config.enabled and not draft.auto}
    free = iter([cob_id for cob_id in FREE_RANGE if cob_id not in used])
    result = [
        _assigned(draft, next(free, 0), findings) if draft.auto else draft for draft in drafts
    ]
    _check(result, findings)
    return result


def _assigned(draft: PdoDraft, cob_id: int, findings: Findings) -> PdoDraft:
    if not cob_id:
        findings.error(
            draft.place,
            f'no free COB-ID is left for {draft.title} between 0x680 and 0x6DF',
            'write a COB-ID that the bus does not use',
        )
    return replace(draft, config=replace(draft.config, cob_id=cob_id))


def _check(drafts: Sequence[PdoDraft], findings: Findings) -> None:
    owners: dict[int, PdoDraft] = {}
    commanded: dict[int, PdoDraft] = {}  # those of RPDOs
    for draft in drafts:
        cob_id = draft.config.cob_id
        if not draft.config.enabled or not cob_id:
            continue
        for purpose in (purpose for ids, purpose in RESERVED if cob_id in ids):
            message = f'COB-ID 0x{cob_id:03X} of {draft.title} is not for PDOs ({purpose})'
            _report(findings, [draft], message)
        owner = owners.setdefault(cob_id, draft)
        both_command = False
        if draft.direction is RPDO and draft.config.mapping:
            other = commanded.setdefault(cob_id, draft)
            both_command = other is not draft
            owner = other if both_command else owner
        if owner is not draft:
            _report(
                findings,
                [draft, owner],
                f'COB-ID 0x{cob_id:03X} of {draft.title} is also that of {owner.title} '
                f'(line {owner.place.line})',
                certain=both_command,
            )


def _report(
    findings: Findings, drafts: list[PdoDraft], message: str, *, certain: bool = False
) -> None:
    if certain or any(draft.config.configured for draft in drafts):
        remedy = "name each PDO in bus.yml with 'cob_id: auto', or 'enabled: false'"
        findings.error(drafts[0].place, message, remedy)
    else:
        remedy = 'name the PDO in bus.yml if the device does not add its node id to the default'
        findings.warning(drafts[0].place, message, remedy)
