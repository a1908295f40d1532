# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The units that a drive names in 0x60A8, 0x60A9 and 0x60AA (CiA 402-2), coded by CiA 303-2: pure.

Bits 24 to 31 are a power of ten, 16 to 23 the unit of the position, 8 to 15 that of the time.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
import math

PLAIN_TIME = 0x03  # second
TIMES: dict[int, tuple[float, str]] = {
    PLAIN_TIME: (1.0, 's'),
    0x47: (60.0, 'min'),
    0x48: (3600.0, 'h'),
}
"""Length in [s] and name of the units of time."""
SQUARED_TIMES: dict[int, tuple[float, str]] = {0x57: (1.0, 's2')}
"""Units of time of an acceleration; the others divide a velocity."""


@dataclass(frozen=True, slots=True)
class NamedUnit:
    """A unit of a position, velocity or acceleration."""

    size: float  # in [rad], [m] or [inc], or per second or second squared
    text: str  # in words
    slides: bool = False  # it is one of a joint that slides
    # it is made of increments: the size is one of these, whose length is not known
    counts: bool = False


POSITIONS: dict[int, NamedUnit] = {
    0x01: NamedUnit(1.0, 'm', slides=True),
    0x10: NamedUnit(1.0, 'rad'),
    0x41: NamedUnit(math.pi / 180.0, 'deg'),
    0x42: NamedUnit(math.pi / 10_800.0, 'arcmin'),
    0x43: NamedUnit(math.pi / 648_000.0, 'arcsec'),
    0xB4: NamedUnit(2.0 * math.pi, 'turns'),
}
"""Units that say how far they are; increments (0xB5) and steps (0xAC) do not."""
VELOCITIES = {**POSITIONS, 0xB5: NamedUnit(1.0, 'increments', counts=True)}
"""Those of velocities, for which it matters that they are increments."""
RATES = {0xC0: NamedUnit(2.0 * math.pi / 60.0, 'rpm')}
"""Units of a velocity that an acceleration has above its unit of time."""


RPM = NamedUnit(2.0 * math.pi / 60.0, 'rpm')
"""What many drives count velocities in."""


def position_unit(value: int | None) -> NamedUnit | None:
    """Return what 0x60A8 says; None where it is not there, or says nothing about a joint."""
    if value is None or (value >> 8) & 0xFF:
        return None
    return _named(value, POSITIONS, 1.0, '')


def velocity_unit(value: int | None) -> NamedUnit | None:
    """Return what 0x60A9 says, also increments; None where it is not there, or says nothing."""
    time = None if value is None else TIMES.get((value >> 8) & 0xFF)
    if value is None or time is None:
        return None
    return _named(value, VELOCITIES, time[0], f'/{time[1]}')


def acceleration_unit(value: int | None) -> NamedUnit | None:
    """Return what 0x60AA says, also increments; None where it is not there, or says nothing."""
    if value is None:
        return None
    code = (value >> 8) & 0xFF
    for units, times in ((VELOCITIES, SQUARED_TIMES), (RATES, TIMES)):
        if code in times and (named := _named(value, units, times[code][0], f'/{times[code][1]}')):
            return named
    return None


def _named(
    value: int, units: Mapping[int, NamedUnit], seconds: float, suffix: str
) -> NamedUnit | None:
    unit = units.get((value >> 16) & 0xFF)
    if unit is None:
        return None
    prefix = (value >> 24) & 0xFF
    exponent = prefix - 0x100 if prefix >= 0x80 else prefix
    factor = 10.0**exponent
    size, text = factor * unit.size / seconds, f'{factor:g} {unit.text}{suffix}'
    return NamedUnit(size, text, unit.slides, unit.counts)
