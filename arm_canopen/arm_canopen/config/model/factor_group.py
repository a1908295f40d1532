# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The factor group of a drive: what its increments are in radians (CiA 402-2, clause 8)."""

from __future__ import annotations

from dataclasses import dataclass
import math

from ...standard.objects import Index

REVOLUTION = 2.0 * math.pi  # [rad]

FACTOR_OBJECTS: dict[str, Index] = {
    'resolution': Index.POSITION_ENCODER_RESOLUTION,
    'gear': Index.GEAR_RATIO,
    'feed': Index.FEED_CONSTANT,
    'velocity_factor': Index.VELOCITY_FACTOR,
}
"""Object of each attribute of :class:`FactorGroup`; sub-index 1 over sub-index 2 is its value."""


@dataclass(frozen=True, slots=True)
class FactorGroup:
    """Ratios of a drive, None where it has no such object.

    Attributes:
        resolution: Encoder increments per revolution of the motor (0x608F).
        gear: Revolutions of the motor per revolution of the shaft (0x6091).
        feed: Position units per revolution of the shaft (0x6092).
        velocity_factor: Velocity units per position unit per second (0x6096).
    """

    resolution: float | None = None
    gear: float | None = None
    feed: float | None = None
    velocity_factor: float | None = None

    @property
    def position_scale(self) -> float:
        """Position units per rad; 0 when the drive does not have it."""
        # position = internal [inc] * feed / (resolution * gear); without a feed constant
        # the drive counts increments of its encoder
        counts = self.feed if self.feed is not None else (self.resolution or 0.0) * self._gear
        return counts / REVOLUTION

    @property
    def velocity_scale(self) -> float:
        """Velocity units per rad/s; 0 when the drive does not have it."""
        return self.position_scale * (self.velocity_factor or 1.0)

    @property
    def position_objects(self) -> tuple[Index, ...]:
        """Objects of those that it has which say what a position unit is."""
        names = [name for name in FACTOR_OBJECTS if name != 'velocity_factor']
        return tuple(FACTOR_OBJECTS[name] for name in names if getattr(self, name) is not None)

    @property
    def _gear(self) -> float:
        return self.gear or 1.0


def ratio(numerator: int | None, denominator: int | None) -> float | None:
    """Return a ratio of the factor group, None when the drive does not have it."""
    return numerator / denominator if numerator and denominator else None
