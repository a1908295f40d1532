# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Conversion between user units (rad, rad/s, effort) and device units of a drive.

Factors come from bus.yml or the drive. :meth:`Scale.to_device` refuses values out of range.
"""

from __future__ import annotations

import math

from canopen_core import DriveError

from ..config.model.drive import DriveConfig

INT16_MAX = 2**15 - 1
INT32_MAX = 2**31 - 1


def clamp(value: float, largest: int) -> int:
    """Round to an integer and clamp to a signed object (INT16_MAX or INT32_MAX)."""
    return max(-largest - 1, min(largest, round(value)))


class Scale:
    """Converts one quantity of a drive between user units and device units.

    A device gets ``value * to_dev + offset_to_dev``; a value that it sends is read as ``value *
    from_dev + offset_from_dev``. As in ros2_canopen, bus.yml sets both directions separately.
    """

    __slots__ = ('_from_dev', '_limits', '_offset_from_dev', '_offset_to_dev', 'to_dev')

    def __init__(self, largest: int = INT32_MAX) -> None:
        """``largest`` is the maximum of the objects of this quantity, INT16_MAX or INT32_MAX."""
        self._limits = (-largest - 1, largest)
        self.set(1.0, 1.0)

    def set(
        self,
        to_dev: float,
        from_dev: float,
        offset_to_dev: float = 0.0,
        offset_from_dev: float = 0.0,
    ) -> None:
        """Set factors and offsets."""
        self.to_dev, self._from_dev = to_dev, from_dev
        self._offset_to_dev, self._offset_from_dev = offset_to_dev, offset_from_dev

    def raw(self, value: float) -> float:
        """Convert to device units without a range check."""
        return value * self.to_dev + self._offset_to_dev

    def to_device(self, value: float, limits: tuple[float, float] | None = None) -> int:
        """Convert to the nearest integer device unit; refuse values beyond ``limits``, if given.

        Raises:
            DriveError: The value is not a number, or does not fit its object.
        """
        scaled = value * self.to_dev + self._offset_to_dev
        if not math.isfinite(scaled):
            raise DriveError(f'target {value} is not a finite number')
        rounded = round(scaled)
        low, high = limits or self._limits
        if not low <= rounded <= high:
            raise DriveError(
                f'target {value:g} is {rounded} device units, more than the object can hold '
                f'({low:g} to {high:g}); are the scale factors in bus.yml right, and the type of '
                'the object in the EDS?'
            )
        return rounded

    def commanded(self, value_dev: float) -> float:
        """Return the target in user units for device units; inverse of :meth:`to_device`."""
        return (value_dev - self._offset_to_dev) / self.to_dev

    def from_device(self, value_dev: float) -> float:
        """Convert from device units."""
        return value_dev * self._from_dev + self._offset_from_dev


class Units:
    """The scales of one axis, one for each quantity."""

    def __init__(self, config: DriveConfig) -> None:
        self.position = Scale()
        self.distance = Scale()  # scale of positions without offsets
        self.velocity = Scale()
        self.acceleration = Scale()
        self.effort = Scale(INT16_MAX)
        self.use(config)

    def use(self, config: DriveConfig) -> None:
        """Set the factors from bus.yml or the drive."""
        self.config = config
        scales = config.scale_pos_to_dev, config.scale_pos_from_dev
        self.position.set(*scales, config.offset_pos_to_dev, config.offset_pos_from_dev)
        self.distance.set(*scales)
        self.velocity.set(config.scale_vel_to_dev, config.scale_vel_from_dev)
        self.acceleration.set(
            config.scale_acc_to_dev or config.scale_vel_to_dev,
            config.scale_acc_from_dev or 1.0 / config.scale_vel_to_dev,
        )
        self.effort.set(config.scale_eff_to_dev, config.scale_eff_from_dev)
