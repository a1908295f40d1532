# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What differs between TPDOs and RPDOs: objects, identifiers, and what may be mapped."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from canopen_core.standard import (
    Index,
    ObjectDictionary,
    ObjectEntry,
    PDO_COUNT_MAX,
    rpdo_default,
    tpdo_default,
)


@dataclass(frozen=True, slots=True)
class Direction:
    """One of the two directions, seen from the device."""

    name: str  # key in bus.yml
    communication: int  # index of the first communication parameter
    mapping: int  # index of the first mapping parameter
    # pre-defined COB-ID of PDO 1 to 4 by number and node id
    default_cob_id: Callable[[int, int], int]
    mappable: Callable[[ObjectEntry], bool]  # whether an object may be mapped in this direction

    @property
    def title(self) -> str:
        """Name as people write it."""
        return self.name.upper()

    def numbers(self, dictionary: ObjectDictionary) -> list[int]:
        """Return the numbers of the PDOs that a device has, ascending."""
        first = self.communication
        indices = {entry.index for entry in dictionary}
        return sorted(
            index - first + 1 for index in indices if first <= index < first + PDO_COUNT_MAX
        )


TPDO = Direction(
    'tpdo',
    Index.TPDO_COMMUNICATION,
    Index.TPDO_MAPPING,
    tpdo_default,
    lambda entry: entry.tpdo_mappable,
)
RPDO = Direction(
    'rpdo',
    Index.RPDO_COMMUNICATION,
    Index.RPDO_MAPPING,
    rpdo_default,
    lambda entry: entry.rpdo_mappable,
)
