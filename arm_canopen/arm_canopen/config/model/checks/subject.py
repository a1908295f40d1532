# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A device as the checks of a bus look at it: what its objects hold, and where that is written."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from canopen_core import Findings, Place
from canopen_core.standard import axis_of, AXIS_OFFSET, Index, object_address, OperationMode

from ...units import HUNDRED_MICROSECONDS, MILLISECONDS
from ..bus import BusConfig, NodeConfig
from ..drive import DriveConfig
from ..pdo import Direction, PdoConfig


@dataclass(frozen=True, slots=True)
class UsedMode:
    """A mode in which an axis is used by bus.yml."""

    axis: DriveConfig
    mode: OperationMode
    key: str  # key of bus.yml that names it

    def at(self, index: int) -> int:
        """Return the index of an object of the profile for this axis."""
        return index + AXIS_OFFSET * self.axis.channel


@dataclass(frozen=True, slots=True)
class Subject:
    """A device under check."""

    bus: BusConfig
    node: NodeConfig
    findings: Findings  # gets what is wrong

    def place(self, *names: str) -> Place:
        """Return the place of a key of the device, or of the nearest thing around it."""
        place = self.bus.place_of(self.node.name, *names)
        return place if place.line else replace(place, line=self.node.line)

    def pdo_place(self, direction: Direction, pdo: PdoConfig, key: str = '') -> Place:
        """Return the place of a PDO, or of one of its keys."""
        return self.place(direction.name, str(pdo.number), *([key] if key else []))

    def object_place(self, index: int, subindex: int) -> Place:
        """Return the place of the value of an object: the sdo list, or else the EDS."""
        write = self.node.write_of(index, subindex)
        if write is not None:
            return write.place
        entry = self.node.dictionary.get(index, subindex)
        line = entry.line if entry is not None else 0
        return Place(self.node.eds, line, f'[{index:04X}sub{subindex:X}]')

    def value(self, index: int, subindex: int = 0) -> int | None:
        """Return the number that an object holds after boot, None when no file has it."""
        if self.node.dictionary.get(index, subindex) is None:
            return None
        value = self.node.value_after_boot(index, subindex)
        return value if isinstance(value, int) else None

    def used_modes(self) -> Iterator[UsedMode]:
        """Yield the modes that bus.yml names for the axes of a drive."""
        for axis in self.node.axes if self.node.is_drive else ():
            for key in ('position_mode', 'velocity_mode', 'effort_mode'):
                number = getattr(axis, key)
                if number is not None:
                    yield UsedMode(axis, OperationMode(number), key)

    def pdos(self) -> Iterator[tuple[Direction, PdoConfig]]:
        """Yield the PDOs that are in use."""
        for direction, pdo in self.node.pdos:
            if pdo.enabled and pdo.mapping:
                yield direction, pdo

    def carriers(self, direction: Direction, index: int, subindex: int = 0) -> list[PdoConfig]:
        """Return the PDOs in use that carry an object."""
        return [
            pdo
            for way, pdo in self.pdos()
            if way is direction
            and any((m.index, m.subindex) == (index, subindex) for m in pdo.mapping)
        ]

    def inhibit_time(self, pdo: PdoConfig) -> float:
        """Return the inhibit time of a TPDO in [s], by bus.yml or else the EDS; 0 for none."""
        if pdo.inhibit_time is not None:
            return pdo.inhibit_time
        units = self.value(Index.TPDO_COMMUNICATION + pdo.number - 1, 3)
        return (units or 0) / HUNDRED_MICROSECONDS

    def event_time(self, pdo: PdoConfig) -> float:
        """Return the event timer of a TPDO in [s], by bus.yml or else the EDS; 0 for none."""
        if pdo.event_time is not None:
            return pdo.event_time
        return (self.value(Index.TPDO_COMMUNICATION + pdo.number - 1, 5) or 0) / MILLISECONDS


def object_name(index: int) -> str:
    """Name an object of the standards, for messages: ``0x607A (target position)``."""
    name = Index(axis_of(index)[0]).name.lower().replace('_', ' ')
    return f'{object_address(index)} ({name})'
