# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Targets beyond what the drive would do: refused here instead of being clamped there."""

from __future__ import annotations

from ..exceptions import DriveError
from ..standard.drive import OperationMode
from .modes import Mode
from .motion import Setpoint
from .parameters import DriveParameters

VELOCITY_MODES = (
    OperationMode.VELOCITY,
    OperationMode.PROFILE_VELOCITY,
    OperationMode.CYCLIC_VELOCITY,
)
TORQUE_MODES = (OperationMode.PROFILE_TORQUE, OperationMode.CYCLIC_TORQUE)


def check_target(name: str, mode: Mode, told: DriveParameters, target: float) -> None:
    """Refuse a target beyond the limits that the drive has in a mode.

    Args:
        name: Name of the drive.
        mode: The mode.
        told: What the drive told about itself.
        target: The target in user units.

    Raises:
        DriveError: It is beyond; the message names the limits.
    """
    if mode.setpoint is not None:
        _check_position(name, told.position_limits, target)
    elif mode.number in VELOCITY_MODES:
        _check_size(name, told.speed_limit, target, 'velocity {:g} (0x607F)')
    elif mode.number in TORQUE_MODES:
        _check_size(name, told.effort_limit, target, 'torque {:g} (0x6072)')


def check_feed_forward(name: str, told: DriveParameters, setpoint: Setpoint) -> None:
    """Refuse a feed-forward beyond what the drive may ever do; errors as for targets."""
    _check_size(name, told.speed_limit, setpoint.velocity, 'velocity {:g} (0x607F)')
    _check_size(name, told.effort_limit, setpoint.effort, 'torque {:g} (0x6072)')


def _check_position(name: str, limits: tuple[float, float] | None, target: float) -> None:
    if limits is not None and not limits[0] <= target <= limits[1]:
        raise DriveError(
            f'{name}: target {target:g} is beyond the software limits '
            f'{limits[0]:g} to {limits[1]:g} (0x607D)'
        )


def _check_size(name: str, limit: float | None, target: float, what: str) -> None:
    if limit is not None and abs(target) > limit:
        raise DriveError(f'{name}: target {target:g} is beyond the greatest {what.format(limit)}')
