# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The check of a target: one that the drive would not go to is refused, not clamped there.

:func:`check_target` refuses what is beyond a limit or without effect; what an object cannot hold
is refused by :meth:`.Scale.to_device`.
"""

from __future__ import annotations

import math

from canopen_core import DriveError
from canopen_core.standard import OperationMode

from ..config.model.checks.drive_units import POSITION_TOLERANCE
from .modes import Mode
from .motion import Setpoint
from .parameters import DriveParameters
from .units import Units

VELOCITY_MODES = (
    OperationMode.VELOCITY,
    OperationMode.PROFILE_VELOCITY,
    OperationMode.CYCLIC_VELOCITY,
)
TORQUE_MODES = (OperationMode.PROFILE_TORQUE, OperationMode.CYCLIC_TORQUE)
NEGLIGIBLE = 2e-3  # share of the profile velocity that may become 0, as in a stream that fades
NEGLIGIBLE_EFFORT = 1e-3  # [unit of effort] likewise
RANGE_SHARE = 1e-3  # share of the range (0x607D) that rounding to whole increments may cost


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
        f'{limits[0]:g} to {limits[1]:g} (0x607D less 0x607C)'
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
