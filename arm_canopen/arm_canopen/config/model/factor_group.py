# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The factor group of a drive: what its units are in radians (CiA 402-2, clause 8)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import math

from canopen_core.standard import Index

from .si_unit import acceleration_unit, NamedUnit, position_unit, velocity_unit

REVOLUTION = 2.0 * math.pi  # [rad]
UNSET = 1.0  # value of 0x6096 and 0x6097 that nobody has set

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
    """Ratios and units of a drive, None where it has no such object."""

    resolution: float | None = None  # encoder increments per revolution of the motor (0x608F)
    gear: float | None = None  # revolutions of the motor per revolution of the shaft (0x6091)
    feed: float | None = None  # position units per revolution of the shaft (0x6092)
    velocity_factor: float | None = None  # velocity units per position unit per second (0x6096)
    # acceleration units per velocity unit per second (0x6097)
    acceleration_factor: float | None = None
    position_unit: NamedUnit | None = None  # what 0x60A8 names
    velocity_unit: NamedUnit | None = None  # what 0x60A9 names
    acceleration_unit: NamedUnit | None = None  # what 0x60AA names

    @classmethod
    def read(cls, value: Callable[[int, int], int | None]) -> FactorGroup:
        """Make one of what value returns for objects of the first axis, None for those missing."""
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
        """Position units per rad, or per m by 0x60A8; 0 when the drive does not have it."""
        # position = internal [inc] * feed / (resolution * gear); without a feed constant
        # the drive counts increments of its encoder
        counts = self.feed if self.feed is not None else (self.resolution or 0.0) * self._gear
        if not counts and self.position_unit is not None:
            return 1.0 / self.position_unit.size
        return counts / REVOLUTION

    @property
    def velocity_scale(self) -> float:
        """Velocity units per rad/s; 0 when the drive does not have it."""
        scale, named = self.position_scale, self.velocity_unit
        if named is None or self.velocity_factor not in {None, UNSET} or not scale:
            return scale * (self.velocity_factor or 1.0)
        return (scale if named.counts else 1.0) / named.size

    @property
    def acceleration_ratio(self) -> float | None:
        """Acceleration units per velocity unit per second; None when the drive does not say it."""
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
        """What 1 of its velocities and of its accelerations is in position units per s and s2."""
        position = self.position_scale
        velocity = (
            position / self.velocity_scale if position else 1.0 / (self.velocity_factor or 1.0)
        )
        return velocity, velocity / (self.acceleration_ratio or 1.0)

    @property
    def acceleration_objects(self) -> tuple[Index, ...]:
        """Objects that say :attr:`acceleration_ratio`."""
        if self.acceleration_ratio is None:
            return ()
        named = self.acceleration_ratio != self.acceleration_factor
        units = (Index.SI_UNIT_VELOCITY, Index.SI_UNIT_ACCELERATION)
        return units if named else (Index.ACCELERATION_FACTOR,)

    @property
    def position_objects(self) -> tuple[Index, ...]:
        """Objects of those that it has which say what a position unit is."""
        names = ('resolution', 'gear', 'feed')
        objects = tuple(FACTOR_OBJECTS[name] for name in names if getattr(self, name) is not None)
        return objects or ((Index.SI_UNIT_POSITION,) if self.position_unit is not None else ())

    @property
    def _gear(self) -> float:
        return self.gear or 1.0


def _ratio(numerator: int | None, denominator: int | None) -> float | None:
    return numerator / denominator if numerator and denominator else None
