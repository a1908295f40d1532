# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""User units (rad, rad/s, effort) against device units, and the check of a target.

The factors are those of bus.yml or of the drive. A target beyond what the drive would do is
refused here instead of being clamped there: by :func:`check_target` where it is beyond a limit or
without effect, by :meth:`Scale.to_device` where its object cannot hold it.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from canopen_core import DriveError
from canopen_core.standard import OperationMode

from ..config.model.checks.drive_units import POSITION_TOLERANCE
from ..config.model.drive import DriveConfig
from .motion import Setpoint

if TYPE_CHECKING:
    from .modes import Mode
    from .parameters import DriveParameters

INT16_MAX = 2**15 - 1
INT32_MAX = 2**31 - 1
VELOCITY_MODES = (
    OperationMode.VELOCITY,
    OperationMode.PROFILE_VELOCITY,
    OperationMode.CYCLIC_VELOCITY,
)
TORQUE_MODES = (OperationMode.PROFILE_TORQUE, OperationMode.CYCLIC_TORQUE)
NEGLIGIBLE = 2e-3  # share of the profile velocity that may become 0, as in a stream that fades
NEGLIGIBLE_EFFORT = 1e-3  # [unit of effort] likewise
RANGE_SHARE = 1e-3  # share of the range (0x607D) that rounding to whole increments may cost


def clamp(value: float, largest: int) -> int:
    """Return the nearest integer that a signed object holds, by its INT16_MAX or INT32_MAX."""
    return max(-largest - 1, min(largest, round(value)))


class Scale:
    """Converts one quantity of a drive.

    To the device it is ``value * to_dev + offset_to_dev``, and from it ``value * from_dev +
    offset_from_dev``, as ros2_canopen has it: bus.yml may scale the two ways differently.
    """

    __slots__ = ('_from_dev', '_limits', '_offset_from_dev', '_offset_to_dev', 'to_dev')

    def __init__(self, largest: int = INT32_MAX) -> None:
        """``largest`` is what objects of the quantity hold, INT16_MAX or INT32_MAX."""
        self._limits = (-largest - 1, largest)
        self.set(1.0, 1.0)

    def set(
        self,
        to_dev: float,
        from_dev: float,
        offset_to_dev: float = 0.0,
        offset_from_dev: float = 0.0,
    ) -> None:
        """Use other factors."""
        self.to_dev, self._from_dev = to_dev, from_dev
        self._offset_to_dev, self._offset_from_dev = offset_to_dev, offset_from_dev

    def raw(self, value: float) -> float:
        """Convert to device units, whether or not an object can hold it."""
        return value * self.to_dev + self._offset_to_dev

    def to_device(self, value: float, limits: tuple[float, float] | None = None) -> int:
        """Convert to the nearest device unit, within the limits of an object if they are given.

        Raises:
            DriveError: It is not a number, or its object cannot hold it.
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
        """Return the target that :meth:`to_device` turns into these device units."""
        return (value_dev - self._offset_to_dev) / self.to_dev

    def from_device(self, value_dev: float) -> float:
        """Convert from device units."""
        return value_dev * self._from_dev + self._offset_from_dev


class Units:
    """The scales of one axis, by the quantity."""

    def __init__(self, config: DriveConfig) -> None:
        self.position = Scale()
        self.distance = Scale()  # of positions, without their offsets
        self.velocity = Scale()
        self.acceleration = Scale()
        self.effort = Scale(INT16_MAX)
        self.use(config)

    def use(self, config: DriveConfig) -> None:
        """Use the factors of bus.yml, or those of the drive itself."""
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


def check_target(
    name: str,
    mode: Mode,
    parameters: DriveParameters,
    units: Units,
    target: float,
    *,
    position: float = math.nan,
) -> None:
    """Refuse a target that the drive would not go to: beyond its limits, or without any effect."""
    if mode.setpoint is not None:
        _check_position(name, parameters.position_limits, target, position)
        _check_rounding(name, units, target, parameters.position_limits)
        if mode.number is OperationMode.PROFILE_POSITION and parameters.profile_velocity_inc == 0:
            raise DriveError(
                f'{name}: its profile velocity (0x6081) is 0, so it would not move; write it, for '
                'good in the sdo list of bus.yml'
            )
    elif mode.number in VELOCITY_MODES:
        _check_size(name, parameters.speed_limit, target, 'velocity {:g} (0x607F)')
        _check_effect(
            name,
            units.velocity.raw(target),
            target,
            'scale_vel_to_dev',
            NEGLIGIBLE * parameters.profile.velocity,
        )
    elif mode.number in TORQUE_MODES:
        _check_size(name, parameters.effort_limit, target, 'torque {:g} (0x6072)')
        _check_effect(
            name, units.effort.raw(target), target, 'scale_eff_to_dev', NEGLIGIBLE_EFFORT
        )


def check_setpoint(name: str, mode: Mode, parameters: DriveParameters, setpoint: Setpoint) -> None:
    """Refuse a set-point of a motion source beyond limits; errors as for targets.

    A path leads between increments everywhere, and is off by half of one at most.
    """
    before = math.nan if mode.setpoint is None else mode.setpoint
    _check_position(name, parameters.position_limits, setpoint.position, before)
    if mode.number is not OperationMode.CYCLIC_POSITION:
        return  # which has no feed-forward
    _check_size(name, parameters.speed_limit, setpoint.velocity, 'velocity {:g} (0x607F)')
    _check_size(name, parameters.effort_limit, setpoint.effort, 'torque {:g} (0x6072)')


def _check_position(
    name: str, limits: tuple[float, float] | None, target: float, start: float
) -> None:
    """Refuse a position beyond the limits, unless it is on the way back from beyond them."""
    if limits is None or limits[0] <= target <= limits[1]:
        return
    if limits[1] < target <= start or start <= target < limits[0]:
        return
    raise DriveError(
        f'{name}: target {target:g} is beyond the software limits '
        f'{limits[0]:g} to {limits[1]:g} (0x607D)'
    )


def _check_rounding(
    name: str, units: Units, target: float, limits: tuple[float, float] | None
) -> None:
    """Refuse a position that whole increments miss by more than the tolerance."""
    increments, tolerance = units.position.raw(target), POSITION_TOLERANCE
    nearest = target
    if math.isfinite(increments):
        nearest = units.position.commanded(round(increments))
    if limits is not None:
        tolerance = min(tolerance, RANGE_SHARE * (limits[1] - limits[0]))
    if abs(nearest - target) > tolerance:
        raise DriveError(
            f'{name}: target {target:g} is between two increments, the nearest is {nearest:g}; is '
            'scale_pos_to_dev in bus.yml right? It is increments per user unit'
        )


def _check_effect(name: str, scaled: float, target: float, key: str, negligible: float) -> None:
    """Refuse a velocity or torque that is none and would become 0."""
    if abs(target) > negligible and math.isfinite(scaled) and round(scaled) == 0:
        raise DriveError(
            f'{name}: target {target:g} is {scaled:g} device units, of which the object has whole '
            f'ones only, so it would become 0; is {key} in bus.yml right? It is device units per '
            'user unit'
        )


def _check_size(name: str, limit: float | None, target: float, what: str) -> None:
    if limit is not None and abs(target) > limit:
        raise DriveError(f'{name}: target {target:g} is beyond the greatest {what.format(limit)}')
