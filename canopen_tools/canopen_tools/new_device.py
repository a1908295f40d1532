# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What is known of a device of a new bus: by its EDS, and by who makes the bus."""

from __future__ import annotations

from dataclasses import dataclass, replace
import math

from arm_canopen.config import (
    FactorGroup,
    is_coarse,
    NamedUnit,
    RPM,
    UNSET,
)
from canopen_core import CanopenError
from canopen_core.eds import Eds
from canopen_core.standard import is_drive, OperationMode

TURN = 2.0 * math.pi  # a turn in [rad]
SAME = 0.01  # share by which two scales may differ and still say the same
FAR = 10.0
"""How many times the increments of the factor group somebody may say without being asked."""


class NewBusError(CanopenError):
    """No bus.yml can be made of this; the message names the device and what is missing."""


@dataclass(frozen=True, slots=True)
class Units:
    """How far an increment is, as somebody has said."""

    # increments of the drive per rad or m of the joint; negative for the other direction
    scale: float
    said: str  # the same in words
    slides: bool = False  # the joint slides, so that the scale is per m
    # velocity units of the drive per rad/s or m/s; None where nobody has said it
    velocity: float | None = None
    velocity_said: str = ''  # the same in words


@dataclass(frozen=True, slots=True)
class NewDevice:
    """A device of the new bus."""

    name: str  # its name; that of the joint, for a drive
    node_id: int
    eds: Eds  # its EDS
    # mode of operation; None takes the best one that the EDS names
    mode: OperationMode | None = None
    units: Units | None = None  # units of the joint; None where the factor group says them
    # turns of what the drive counts in rpm, or in the unit of angles that it names in 0x60A9, for
    # one turn or 1 m of the joint; None where nobody has said it
    rpm: float | None = None

    @property
    def is_drive(self) -> bool:
        """Whether it is a CiA 402 drive."""
        return is_drive(self.eds.dictionary)

    @property
    def factors(self) -> FactorGroup:
        """The factor group by the defaults of its EDS."""
        return FactorGroup.read(self.number)

    @property
    def velocity_unit(self) -> NamedUnit | None:
        """What 0x60A9 names; None where it names nothing."""
        return self.factors.velocity_unit

    @property
    def has_open_units(self) -> bool:
        """Whether neither its EDS nor anybody says how far an increment of its joint is."""
        return self.is_drive and said_units(self) is None and not says_units(self.factors)

    @property
    def open_velocity(self) -> str:
        """What is unknown about its velocities, with the remedy; empty where nothing is open."""
        named, units = self.velocity_unit, _position_units(self) if self.is_drive else None
        if named is None or units is None or self.rpm is not None or _is_of_joint(self, units):
            return ''
        who = f'{self.name}: 0x60A9 of the EDS has {named.text} as unit'
        correct = 'or correct 0x60A9 in the EDS by the manual'
        if named.slides:
            return f'{who}, and the joint turns; give --metre where it slides, {correct}'
        one = '1 m' if units.slides else 'one turn'
        return (
            f'{who}, and does not say of which shaft; give --rpm {self.name}=TURNS, turns of the'
            f' motor for {one} of the joint, 1 where the drive knows the gear, {correct}'
        )

    def number(self, index: int, subindex: int = 0) -> int:
        """Return what an object holds by the EDS; 0 where unknown."""
        return self.eds.dictionary.number(index, subindex) or 0


def says_units(factors: FactorGroup) -> bool:
    """Whether a factor group says what a turn of the joint is: with its gear, and not 1 to 1."""
    scale = factors.position_scale
    return factors.gear is not None and bool(scale) and not is_coarse(scale)


def said_units(device: NewDevice) -> Units | None:
    """Return the units that are written out: as somebody has said, else as named; or None."""
    units, named = _position_units(device), device.velocity_unit
    if units is None:
        return None
    if device.rpm is not None:
        return _with_turns(device, units, device.rpm)
    if named is None or not _is_of_joint(device, units):
        return units
    said = f'0x60A9 of the EDS: its unit is {named.text}'
    return replace(units, velocity=_velocity(named, units.scale), velocity_said=said)


def velocity_scale(device: NewDevice, units: Units) -> tuple[float, str]:
    """Return the scale of velocities, and who says it.

    Raises:
        NewBusError: 0x60A9 and 0x6096 differ, or it is not known of what the velocity is.
    """
    if device.open_velocity:
        raise NewBusError(device.open_velocity)
    factor = device.factors.velocity_factor
    if units.velocity is not None:
        by_factor = abs(units.scale) * (factor or 1.0)
        is_same = math.isclose(by_factor, units.velocity, rel_tol=SAME)
        if not is_same and device.rpm is None and factor not in {None, UNSET}:
            raise NewBusError(
                f'{device.name}: {units.velocity_said}, which is {units.velocity:g} for 1 of the'
                f' joint per second, and by 0x6096 of the EDS it is {by_factor:g}; correct the'
                f' EDS by the manual, or give --rpm {device.name}=TURNS'
            )
        return math.copysign(units.velocity, units.scale), units.velocity_said
    if factor:
        return units.scale * factor, 'by 0x6096 of the EDS'
    turns = '60 * turns per m' if units.slides else '60 * turns of the motor per turn / (2 pi)'
    said = 'increments per second, where the manual says nothing else'
    return units.scale, f'{said}; rpm: {turns}, by --rpm {device.name}=TURNS'


def contradiction(device: NewDevice, units: Units) -> str:
    """Return what to look at where the units and the factor group differ; else nothing.

    What somebody says may differ by a gear that the drive does not know, but not by far; where it
    is far less than the factor group has, the check of the file warns.
    """
    factors = device.factors
    if not says_units(factors) or _is_same(factors, units):
        return ''
    is_said, ratio_to_group = device.units is not None, abs(units.scale) / factors.position_scale
    if is_said and (units.slides or ratio_to_group < FAR):
        return ''
    return (
        f'its factor group has {factors.position_scale:g} per rad: try which it is by a first'
        ' motion on the page'
    )


def _position_units(device: NewDevice) -> Units | None:
    """Return the units that somebody has said, else those that the drive names; None for none.

    What an EDS names in 0x60A8 does not count: it is a default that the maker changes by
    parameters. Those of the factor group are written out where the
    master would not read from the drive what velocities are.
    """
    if device.units is not None:
        return device.units
    factors, named = device.factors, device.velocity_unit
    scale = factors.position_scale
    is_read = named is None or math.isclose(
        _velocity(named, scale), factors.velocity_scale, rel_tol=SAME
    )
    if (is_read and device.rpm is None) or not says_units(factors):
        return None
    objects = ', '.join(f'0x{index:04X}' for index in factors.position_objects)
    return Units(scale, f'{objects} of the EDS; per rad')


def _is_of_joint(device: NewDevice, units: Units) -> bool:
    """Whether the velocity that 0x60A9 names is that of the joint.

    It is of what the positions are of, by CiA 402-2. Where somebody else says what the joint is
    in increments, a turn may be one of the motor, unless the factor group says the same.
    """
    named, factors = device.velocity_unit, device.factors
    if named is None or named.counts:
        return True
    if named.slides or units.slides:
        return named.slides and units.slides
    return device.units is None or (says_units(factors) and _is_same(factors, units))


def _velocity(named: NamedUnit, scale: float) -> float:
    """Return velocity units for 1 of the joint per second, at increments for 1 of it."""
    return (abs(scale) if named.counts else 1.0) / named.size


def _with_turns(device: NewDevice, units: Units, turns: float) -> Units:
    """Return units with velocities of what turns so often for a turn or 1 m of the joint."""
    named = device.velocity_unit
    is_angle = named is not None and not named.slides and not named.counts
    unit = named if named is not None and is_angle else RPM
    per, one = (TURN, '1 m') if units.slides else (1.0, 'one turn')
    said = f'{turns:g} turns for {one} of the joint, as said'
    if math.isclose(unit.size, RPM.size):
        formula = f'60 * {turns:g}' + ('' if units.slides else ' / (2 pi)')
        said = f'rpm, {said}: {formula}'
    else:
        said = f'{unit.text} by 0x60A9 of the EDS, {said}'
    if named is not None and not is_angle:
        said += f'; 0x60A9 of the EDS has {named.text}'
    return replace(units, velocity=turns * per / unit.size, velocity_said=said)


def _is_same(factors: FactorGroup, units: Units) -> bool:
    """Whether a factor group has the same increments per rad."""
    return not units.slides and math.isclose(
        abs(units.scale), factors.position_scale, rel_tol=SAME
    )
