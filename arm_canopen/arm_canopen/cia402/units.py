# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""User units (rad, rad/s, effort) against device units, by the factors of bus.yml or the drive."""

from __future__ import annotations

import math

from ..config.model.drive import DriveConfig
from ..exceptions import DriveError

INT16_MAX = 2**15 - 1
INT32_MAX = 2**31 - 1


def clamp(value: float, largest: int) -> int:
    """Return the nearest integer that a signed object holds, by its INT16_MAX or INT32_MAX."""
    return max(-largest - 1, min(largest, round(value)))


class Units:
    """Converts positions, velocities, accelerations and torques of one drive.

    To the device: ``position * scale_pos_to_dev + offset_pos_to_dev`` and
    ``velocity * scale_vel_to_dev``; from it: ``position * scale_pos_from_dev +
    offset_pos_from_dev`` and so on, as ros2_canopen has it.
    """

    def __init__(self, config: DriveConfig) -> None:
        self._config = config

    def use(self, config: DriveConfig) -> None:
        """Take other factors, those of the drive itself."""
        self._config = config

    def position_to_device(self, position: float) -> int:
        """Convert a position to the nearest increment.

        Raises:
            DriveError: It is not a number or does not fit 0x607A (INTEGER32).
        """
        config = self._config
        scaled = position * config.scale_pos_to_dev + config.offset_pos_to_dev
        return _to_integer(position, scaled, INT32_MAX)

    @property
    def config(self) -> DriveConfig:
        """The axis, with the factors that count."""
        return self._config

    @property
    def position_scale(self) -> float:
        """Increments per user unit."""
        return self._config.scale_pos_to_dev

    def nearest_position(self, position: float) -> float:
        """Return the position that a whole number of increments stands for."""
        config = self._config
        scaled = position * config.scale_pos_to_dev + config.offset_pos_to_dev
        return self.position_commanded(round(scaled)) if math.isfinite(scaled) else position

    def effort_raw(self, effort: float) -> float:
        """Convert a torque to device units, whether or not an object can hold it."""
        return effort * self._config.scale_eff_to_dev

    def distance_to_device(self, distance: float) -> int:
        """Convert a distance to the nearest increment; errors as for positions."""
        return _to_integer(distance, distance * self._config.scale_pos_to_dev, INT32_MAX)

    def position_commanded(self, position_inc: float) -> float:
        """Return the target that :meth:`position_to_device` turns into these [inc].

        It differs from :meth:`position_from_device` where bus.yml scales the two ways differently.
        """
        config = self._config
        return (position_inc - config.offset_pos_to_dev) / config.scale_pos_to_dev

    def velocity_to_device(self, velocity: float) -> int:
        """Convert a velocity to the nearest device unit; errors as for positions."""
        return _to_integer(velocity, velocity * self._config.scale_vel_to_dev, INT32_MAX)

    def velocity_commanded(self, velocity_dev: float) -> float:
        """Return the target that :meth:`velocity_to_device` turns into these device units."""
        return velocity_dev / self._config.scale_vel_to_dev

    def velocity_raw(self, velocity: float) -> float:
        """Convert a velocity to device units, whether or not an object can hold it."""
        return velocity * self._config.scale_vel_to_dev

    def acceleration_from_device(self, acceleration_dev: float) -> float:
        """Convert a device acceleration to user units per second squared."""
        scale = self._config.scale_acc_from_dev
        return acceleration_dev * (1.0 / self._config.scale_vel_to_dev if scale is None else scale)

    def rate_from_device(self, rate_inc: float) -> float:
        """Convert the rate of a position in [inc/s] to user units per second."""
        return rate_inc * self._config.scale_pos_from_dev

    def vl_velocity_to_device(self, velocity: float) -> int:
        """Convert a velocity for 0x6042, an INTEGER16; errors as for positions."""
        return _to_integer(velocity, velocity * self._config.scale_vel_to_dev, INT16_MAX)

    def effort_to_device(self, effort: float) -> int:
        """Convert a torque for 0x6071, an INTEGER16; errors as for positions."""
        return _to_integer(effort, effort * self._config.scale_eff_to_dev, INT16_MAX)

    def effort_commanded(self, torque: float) -> float:
        """Return the target that :meth:`effort_to_device` turns into this device torque."""
        return torque / self._config.scale_eff_to_dev

    def position_from_device(self, position: float) -> float:
        """Convert increments to a position in user units."""
        return position * self._config.scale_pos_from_dev + self._config.offset_pos_from_dev

    def velocity_from_device(self, velocity: float) -> float:
        """Convert a device velocity to user units per second."""
        return velocity * self._config.scale_vel_from_dev

    def effort_from_device(self, torque: float) -> float:
        """Convert a device torque to user units."""
        return torque * self._config.scale_eff_from_dev


def _to_integer(value: float, scaled: float, largest: int) -> int:
    if not math.isfinite(scaled):
        raise DriveError(f'target {value} is not a finite number')
    rounded = round(scaled)
    if not -largest - 1 <= rounded <= largest:
        raise DriveError(
            f'target {value:g} is {rounded} device units, more than the object can hold '
            f'({largest}); are the scale factors in bus.yml right?'
        )
    return rounded
