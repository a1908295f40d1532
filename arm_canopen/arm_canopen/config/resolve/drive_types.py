# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Whether the mapped objects of a drive have types that carry their units."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from ...standard.datatypes import DataType, UNSIGNED_BITS
from ...standard.dictionary import object_address
from ...standard.objects import is_signed
from ...standard.pdo import MappedObject
from ..findings import Findings
from .pdos import PdoDraft


def check_drive_types(pdos: Sequence[PdoDraft], findings: Findings) -> None:
    """Refuse mapped objects of a drive that have no sign for the direction."""
    for pdo in pdos:
        for mapped in _unsigned(pdo):
            findings.error(
                pdo.place,
                f'{pdo.title} carries {object_address(mapped.index, mapped.subindex)} as '
                f'{mapped.data_type.name}, which holds no negative value',
                'correct its DataType in the EDS (0x0003 INTEGER16, 0x0004 INTEGER32), or the '
                'length in the default mapping',
            )


def _unsigned(pdo: PdoDraft) -> Iterator[MappedObject]:
    if pdo.config.enabled:
        for mapped in pdo.config.mapping:
            unsigned = mapped.data_type in UNSIGNED_BITS or mapped.data_type is DataType.BOOLEAN
            if unsigned and is_signed(mapped.index, mapped.subindex):
                yield mapped
