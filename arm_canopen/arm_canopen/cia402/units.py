# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""User units (rad, rad/s) against device units (increments), by the factors of bus.yml."""

from __future__ import annotations

import math

from ..config.model import DriveConfig
from ..exceptions import DriveError

INT32_MAX = 2**31 - 1


class Units:
    """Converts positions and velocities of one drive.

    To the device: ``position * scale_pos_to_dev + offset_pos_to_dev`` and
    ``velocity * scale_vel_to_dev``; from it: ``position * scale_pos_from_dev +
    offset_pos_from_dev`` and so on, as ros2_canopen has it.
    """

    def __init__(self, config: DriveConfig) -> None:
        """Take the factors."""
        self._config = config

    def position_to_device(self, position: float) -> int:
        """Convert a position to the nearest increment.

        Raises:
            DriveError: It is not a number or does not fit 0x607A (INTEGER32).
        """
        config = self._config
        return _to_int32(position, position * config.scale_pos_to_dev + config.offset_pos_to_dev)

    def position_commanded(self, position_inc: float) -> float:
        """Return the target that :meth:`position_to_device` turns into these [inc].

        It differs from :meth:`position_from_device` where bus.yml scales the two ways differently.
        """
        config = self._config
        return (position_inc - config.offset_pos_to_dev) / config.scale_pos_to_dev

    def velocity_to_device(self, velocity: float) -> int:
        """Convert a velocity to the nearest device unit; errors as for positions."""
        return _to_int32(velocity, velocity * self._config.scale_vel_to_dev)

    def position_from_device(self, position: float) -> float:
        """Convert increments to a position in user units."""
        return position * self._config.scale_pos_from_dev + self._config.offset_pos_from_dev

    def velocity_from_device(self, velocity: float) -> float:
        """Convert a device velocity to user units per second."""
        return velocity * self._config.scale_vel_from_dev

    def effort_from_device(self, torque: float) -> float:
        """Convert a device torque to user units."""
        return torque * self._config.scale_eff_from_dev


def _to_int32(value: float, scaled: float) -> int:
    if not math.isfinite(scaled):
        raise DriveError(f'target {value} is not a finite number')
    rounded = round(scaled)
    if abs(rounded) > INT32_MAX:
        raise DriveError(
            f'target {value:g} is {rounded} device units, more than a drive can hold '
            f'({INT32_MAX}); are the scale factors in bus.yml right?'
        )
    return rounded
