# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The typed model of one axis of a drive, and the units that the drive itself defines.

0x60A8, 0x60A9 and 0x60AA name units (CiA 402-2), coded by CiA 303-2: bits 24 to 31 are a power of
ten, 16 to 23 the unit of the position, 8 to 15 that of the time. The factor group (CiA 402-2,
clause 8) relates these to revolutions of the shaft.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
import math

from canopen_core.standard import (
    DriveState,
    Index,
    OperationMode,
    POSITION_MODES,
    TORQUE_MODES,
    VELOCITY_MODES,
)

from ..keys import key, Kind, MILLISECONDS

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
    text: str  # name of the unit
    slides: bool = False  # a unit of length, for a prismatic joint
    # the unit counts increments, whose length is not known
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


RPM = NamedUnit(2.0 * math.pi / 60.0, 'rpm')  # velocity unit of many drives


def position_unit(value: int | None) -> NamedUnit | None:
    """Decode 0x60A8; None if it is missing or not a unit of a joint position."""
    if value is None or (value >> 8) & 0xFF:
        return None
    return _named(value, POSITIONS, 1.0, '')


def velocity_unit(value: int | None) -> NamedUnit | None:
    """Decode 0x60A9, increments included; None if it is missing or an unknown unit."""
    time = None if value is None else TIMES.get((value >> 8) & 0xFF)
    if value is None or time is None:
        return None
    return _named(value, VELOCITIES, time[0], f'/{time[1]}')


def acceleration_unit(value: int | None) -> NamedUnit | None:
    """Decode 0x60AA, increments included; None if it is missing or an unknown unit."""
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


REVOLUTION = 2.0 * math.pi  # [rad]
UNSET = 1.0  # default value of 0x6096 and 0x6097

FACTOR_OBJECTS: dict[str, Index] = {
    'resolution': Index.POSITION_ENCODER_RESOLUTION,
    'gear': Index.GEAR_RATIO,
    'feed': Index.FEED_CONSTANT,
    'velocity_factor': Index.VELOCITY_FACTOR,
    'acceleration_factor': Index.ACCELERATION_FACTOR,
}
"""Object of each ratio of :class:`FactorGroup`; sub-index 1 over sub-index 2 is its value."""
UNIT_OBJECTS = (Index.SI_UNIT_POSITION, Index.SI_UNIT_VELOCITY, Index.SI_UNIT_ACCELERATION)
"""Objects that name a unit."""
FACTOR_ADDRESSES: tuple[tuple[int, int], ...] = (
    *((index, subindex) for index in FACTOR_OBJECTS.values() for subindex in (1, 2)),
    *((index, 0) for index in UNIT_OBJECTS),
)
"""All that a factor group is made of, by index and sub-index."""
ACCELERATION_ADDRESSES: tuple[tuple[int, int], ...] = (
    (Index.ACCELERATION_FACTOR, 1),
    (Index.ACCELERATION_FACTOR, 2),
    (Index.SI_UNIT_VELOCITY, 0),
    (Index.SI_UNIT_ACCELERATION, 0),
)
"""Those that say what accelerations are beside velocities."""


@dataclass(frozen=True, slots=True)
class FactorGroup:
    """Ratios and units of a drive; None for objects that it lacks."""

    resolution: float | None = None  # encoder increments per revolution of the motor (0x608F)
    gear: float | None = None  # revolutions of the motor per revolution of the shaft (0x6091)
    feed: float | None = None  # position units per revolution of the shaft (0x6092)
    velocity_factor: float | None = None  # velocity units per position unit per second (0x6096)
    # acceleration units per velocity unit per second (0x6097)
    acceleration_factor: float | None = None
    position_unit: NamedUnit | None = None  # unit in 0x60A8
    velocity_unit: NamedUnit | None = None  # unit in 0x60A9
    acceleration_unit: NamedUnit | None = None  # unit in 0x60AA

    @classmethod
    def read(cls, value: Callable[[int, int], int | None]) -> FactorGroup:
        """Build it from ``value(index, subindex)``, which returns None for missing objects."""
        ratios = {
            name: _ratio(value(index, 1), value(index, 2))
            for name, index in FACTOR_OBJECTS.items()
        }
        return cls(
            **ratios,
            position_unit=position_unit(value(Index.SI_UNIT_POSITION, 0)),
            velocity_unit=velocity_unit(value(Index.SI_UNIT_VELOCITY, 0)),
            acceleration_unit=acceleration_unit(value(Index.SI_UNIT_ACCELERATION, 0)),
        )

    @property
    def position_scale(self) -> float:
        """Position units per rad, or per m by 0x60A8; 0 if the drive does not define it."""
        # position = internal [inc] * feed / (resolution * gear); without a feed constant
        # the drive counts increments of its encoder
        per_turn = (self.resolution or 0.0) * (self.gear or 1.0)
        counts = per_turn if self.feed is None else self.feed
        if not counts and self.position_unit is not None:
            return 1.0 / self.position_unit.size
        return counts / REVOLUTION

    @property
    def velocity_scale(self) -> float:
        """Velocity units per rad/s; 0 if the drive does not define it."""
        scale, named = self.position_scale, self.velocity_unit
        if named is None or self.velocity_factor not in {None, UNSET} or not scale:
            return scale * (self.velocity_factor or 1.0)
        return (scale if named.counts else 1.0) / named.size

    @property
    def acceleration_ratio(self) -> float | None:
        """Acceleration units per velocity unit per second; None if the drive lacks the factor."""
        velocity, acceleration = self.velocity_unit, self.acceleration_unit
        if (
            velocity is not None
            and acceleration is not None
            and velocity.counts is acceleration.counts
            and velocity.slides is acceleration.slides
        ):
            return velocity.size / acceleration.size
        return self.acceleration_factor

    @property
    def rate_units(self) -> tuple[float, float]:
        """One velocity unit in position units/s, one acceleration unit in position units/s2."""
        position = self.position_scale
        velocity = (
            position / self.velocity_scale if position else 1.0 / (self.velocity_factor or 1.0)
        )
        return velocity, velocity / (self.acceleration_ratio or 1.0)

    @property
    def acceleration_objects(self) -> tuple[Index, ...]:
        """Objects that define :attr:`acceleration_ratio`."""
        if self.acceleration_ratio is None:
            return ()
        named = self.acceleration_ratio != self.acceleration_factor
        units = (Index.SI_UNIT_VELOCITY, Index.SI_UNIT_ACCELERATION)
        return units if named else (Index.ACCELERATION_FACTOR,)

    @property
    def position_objects(self) -> tuple[Index, ...]:
        """Objects of the drive that define its position unit."""
        names = ('resolution', 'gear', 'feed')
        objects = tuple(FACTOR_OBJECTS[name] for name in names if getattr(self, name) is not None)
        return objects or ((Index.SI_UNIT_POSITION,) if self.position_unit is not None else ())


def _ratio(numerator: int | None, denominator: int | None) -> float | None:
    return numerator / denominator if numerator and denominator else None


SWITCHING_STATES = {state.value: state.title for state in DriveState if 2 <= state <= 5}
FAULT_STATE = {DriveState.FAULT.value: 'Fault, taken as 5'}
"""What the multichannel sample of ros2_canopen writes, and means Operation enabled."""


def _titles(modes: Iterable[OperationMode]) -> dict[int, str]:
    return {mode.value: mode.title for mode in modes}


class RecoveryPolicy(Enum):
    """What to do with a drive that was enabled when its device was lost, after it boots again."""

    MANUAL = 'manual'
    """It stays disabled until a client calls ~/recover or ~/enable."""
    AUTO = 'auto'
    """It is enabled again in the mode that it had, holding where it is; it moves nowhere."""


@dataclass(frozen=True, slots=True)
class DriveConfig:
    """Units and sequences of one axis of a CiA 402 drive; each key of bus.yml fills its field."""

    # name of the axis: that of the device, or of the channel if the device has several axes
    name: str = ''
    # number of the axis from 0; its objects lie 0x800 * channel above those of the first (CiA
    # 402-2, 7.2)
    channel: int = 0
    scale_pos_to_dev: float = key(1000.0, 'increments per user unit', zero=False)
    scale_vel_to_dev: float = key(1000.0, 'device velocity per user velocity', zero=False)
    scale_pos_from_dev: float = key(0.001, 'user units per increment', zero=False)
    scale_vel_from_dev: float = key(0.001, 'user velocity per device velocity', zero=False)
    scale_acc_to_dev: float | None = key(
        None,
        'device acceleration per user acceleration; without: by the drive (0x60A9 with '
        '0x60AA, or 0x6097), else its velocity units per second (our own key)',
        zero=False,
    )
    scale_acc_from_dev: float | None = key(
        None,
        'user acceleration per device acceleration; without: the inverse of the other '
        '(our own key)',
        zero=False,
    )
    scale_from_factor_group: bool = key(
        False,
        'positions in rad by the factor group of the drive (0x608F, 0x6091, 0x6092, '
        '0x6096, 0x60A8, 0x60A9), in the place of the scales (our own key)',
    )
    scale_eff_to_dev: float = key(1.0, 'device torque per user effort (our own key)', zero=False)
    scale_eff_from_dev: float = key(
        1.0, 'user effort per device torque; without: the inverse of the other', zero=False
    )
    offset_pos_to_dev: float = key(0.0, 'added to a target in increments')
    offset_pos_from_dev: float = key(
        0.0, 'added to a position in user units; `offset_pos_to_dev` takes it back'
    )
    switching_state: DriveState = key(  # noqa: RUF009
        DriveState.OPERATION_ENABLED,
        'state in which the mode is switched: 2 to 5 of CiA 402',
        kind=Kind.INTEGER,
        choices=SWITCHING_STATES | FAULT_STATE,
    )
    homing_timeout: float = key(
        10.0, 'longest time for homing [s]', (0.1, 3600), name='homing_timeout_seconds'
    )
    position_mode: int | None = key(
        None,
        'mode for positions: 1, 7 or 8; its objects are checked, services select it',
        choices=_titles(POSITION_MODES),
    )
    velocity_mode: int | None = key(
        None, 'as position_mode, for velocities: 2, 3 or 9', choices=_titles(VELOCITY_MODES)
    )
    effort_mode: int | None = key(
        None, 'as position_mode, for efforts: 4 or 10', choices=_titles(TORQUE_MODES)
    )
    target_timeout: float = key(
        0.2,
        'pause that ends a stream on `~/target` (our own key)',
        (10, 60_000),
        unit=MILLISECONDS,
        name='target_timeout_ms',
    )
    recovery: RecoveryPolicy = key(  # noqa: RUF009
        RecoveryPolicy.MANUAL,
        '`manual` or `auto`: after a loss (our own key)',
        kind=Kind.TEXT,
        choices={'manual': '(until ~/recover)', 'auto': '(enabled again)'},
    )
    quirks: str = key('', 'where the drive deviates from CiA 402 (our own key)')
