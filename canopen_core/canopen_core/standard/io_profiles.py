# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Objects of I/O modules (CiA 401) and of encoders with one channel (CiA 406)."""

from __future__ import annotations

from collections.abc import Container, Sequence
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


ANALOG_EVENTS = 0x6423  # analogue input global interrupt enable


@dataclass(frozen=True, slots=True)
class IoGroup:
    """Inputs or outputs of one kind.

    A module has the same digital channels in objects of 8, 16 or 32 bits, which begin at
    ``indices``; sub-index 0 is their number. Analogue channels have an index for each width.
    """

    name: str  # as in ``digital_inputs``
    indices: tuple[int, ...]
    is_output: bool
    is_digital: bool

    @property
    def direction(self) -> str:
        """Key of bus.yml below which its PDOs stand."""
        return 'rpdo' if self.is_output else 'tpdo'

    def entries(
        self, dictionary: ObjectDictionary, mapped: Container[tuple[int, int]] = ()
    ) -> Sequence[ObjectEntry]:
        """Return the channels of a module; of several widths, the one that PDOs carry."""
        widths = [
            [entry for entry in dictionary.subindices(index) if entry.subindex]
            for index in self.indices
            if dictionary.has_index(index)
        ]
        carried = (each for each in widths if any(entry.address in mapped for entry in each))
        return next(carried, widths[0] if widths else [])


DIGITAL_OUTPUTS = IoGroup(
    'digital_outputs', (0x6200, 0x6300, 0x6320), is_output=True, is_digital=True
)
ANALOG_INPUTS = IoGroup(
    'analog_inputs', (0x6400, 0x6401, 0x6402, 0x6403), is_output=False, is_digital=False
)
IO_GROUPS = (
    IoGroup('digital_inputs', (0x6000, 0x6100, 0x6120), is_output=False, is_digital=True),
    DIGITAL_OUTPUTS,
    ANALOG_INPUTS,
    IoGroup('analog_outputs', (0x6410, 0x6411, 0x6412, 0x6413), is_output=True, is_digital=False),
)
ERROR_OBJECTS = {0x6200: (0x6206, 0x6207), 0x6411: (0x6443, 0x6444)}
"""Of outputs: error mode (which ones change on a loss), and the value that these get."""
