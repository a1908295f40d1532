# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Objects of I/O modules (CiA 401) and of encoders with one channel (CiA 406)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

from .dictionary import ObjectDictionary, ObjectEntry


class EncoderObject(IntEnum):
    """Objects of an encoder; the speed is sub-index 1 of its array."""

    UNITS_PER_REVOLUTION = 0x6001
    TOTAL_RANGE = 0x6002
    PRESET = 0x6003
    POSITION = 0x6004
    SPEED = 0x6030


@dataclass(frozen=True, slots=True)
class IoGroup:
    """Inputs or outputs of one kind.

    A module has the same digital channels in objects of 8, 16 or 32 bits, which begin at
    ``indices``; sub-index 0 is their number. Analogue channels have an index for each width.
    """

    name: str  # as in ``digital_inputs``
    indices: tuple[int, ...]

    def entries(self, dictionary: ObjectDictionary) -> Sequence[ObjectEntry]:
        """Return the channels of a module, of the first width that it has."""
        for index in self.indices:
            if dictionary.has_index(index):
                return [entry for entry in dictionary.subindices(index) if entry.subindex]
        return []


DIGITAL_OUTPUTS = IoGroup('digital_outputs', (0x6200, 0x6300, 0x6320))
IO_GROUPS = (
    IoGroup('digital_inputs', (0x6000, 0x6100, 0x6120)),
    DIGITAL_OUTPUTS,
    IoGroup('analog_inputs', (0x6400, 0x6401, 0x6402, 0x6403)),
    IoGroup('analog_outputs', (0x6410, 0x6411, 0x6412, 0x6413)),
)
ERROR_OBJECTS = {0x6200: (0x6206, 0x6207), 0x6411: (0x6443, 0x6444)}
"""Of outputs: error mode (which ones change on a loss), and the value that these get."""
