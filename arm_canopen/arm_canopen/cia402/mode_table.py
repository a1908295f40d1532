# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The modes that the RPDOs of bus.yml make possible."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from ..standard.drive import OperationMode
from ..standard.objects import Index
from .cyclic_position import CyclicPosition, InterpolatedPosition
from .drive_objects import DriveObjects
from .modes import Homing, Mode, NoMode
from .parameters import DriveParameters
from .position_modes import ProfilePosition
from .rate_modes import CyclicTorque, CyclicVelocity, ProfileTorque, ProfileVelocity, Velocity
from .units import Units

REQUIRED_OBJECTS: dict[OperationMode, Index] = {
    OperationMode.PROFILE_POSITION: Index.TARGET_POSITION,
    OperationMode.VELOCITY: Index.VL_TARGET_VELOCITY,
    OperationMode.PROFILE_VELOCITY: Index.TARGET_VELOCITY,
    OperationMode.PROFILE_TORQUE: Index.TARGET_TORQUE,
    OperationMode.INTERPOLATED_POSITION: Index.INTERPOLATION_DATA,
    OperationMode.CYCLIC_POSITION: Index.TARGET_POSITION,
    OperationMode.CYCLIC_VELOCITY: Index.TARGET_VELOCITY,
    OperationMode.CYCLIC_TORQUE: Index.TARGET_TORQUE,
}
"""The target object of each mode, which has to be in an RPDO (CiA 402-2, clauses 10 to 16)."""


def build_modes(
    objects: DriveObjects,
    units: Units,
    parameters: Callable[[], DriveParameters],
    warn: Callable[[str], None],
) -> dict[OperationMode, Mode]:
    """Return the modes of a drive by number.

    Args:
        objects: Its objects.
        units: Its units.
        parameters: Gives what it told about itself.
        warn: Takes a warning in words.
    """
    modes: list[Mode] = [NoMode(), Homing()]
    modes += _position_modes(objects, units, parameters, warn)
    vl_target = objects.target_writer(Index.VL_TARGET_VELOCITY)
    if vl_target is not None:
        modes.append(Velocity(units, vl_target))
    velocity = objects.target_writer(Index.TARGET_VELOCITY)
    if velocity is not None:
        modes.append(ProfileVelocity(units, velocity))
        modes.append(CyclicVelocity(units, velocity, lambda: parameters().profile.acceleration))
    torque = objects.target_writer(Index.TARGET_TORQUE)
    if torque is not None:
        modes.append(ProfileTorque(units, torque))
        modes.append(CyclicTorque(units, torque, lambda: parameters().torque_slope))
    return {mode.number: mode for mode in modes}


def _position_modes(
    objects: DriveObjects,
    units: Units,
    parameters: Callable[[], DriveParameters],
    warn: Callable[[str], None],
) -> Iterator[Mode]:
    position = objects.target_writer(Index.TARGET_POSITION)
    if position is not None:
        leads = objects.must_lead(Index.TARGET_POSITION)
        yield ProfilePosition(units, position, warn, target_leads=leads)
        yield CyclicPosition(units, position, lambda: parameters().profile)
    interpolation = objects.target_writer(Index.INTERPOLATION_DATA, 1)
    if interpolation is not None:
        yield InterpolatedPosition(units, interpolation, lambda: parameters().profile)
