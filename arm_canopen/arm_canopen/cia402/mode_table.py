# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The modes that the objects of a drive and its RPDOs make possible."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

from canopen_core.standard import Index, OperationMode, TARGET_OBJECTS

from .cyclic_position import CyclicPosition, InterpolatedPosition
from .drive_objects import DriveObjects
from .modes import Homing, Mode, NoMode
from .parameters import DriveParameters
from .position_modes import ProfilePosition
from .rate_modes import CyclicTorque, CyclicVelocity, ProfileTorque, ProfileVelocity, Velocity
from .target_offset import OFFSET_OBJECTS, OffsetTarget
from .units import INT16_MAX, Units


def build_modes(
    objects: DriveObjects,
    units: Units,
    parameters: Callable[[], DriveParameters],
    warn: Callable[[str], None],
) -> dict[OperationMode, Mode]:
    """Return the modes of a drive by number."""
    modes: list[Mode] = [NoMode(), Homing()]
    modes += _profile_modes(objects, units, parameters, warn)
    modes += _cyclic_modes(objects, units, parameters)
    return {mode.number: mode for mode in modes}


def _profile_modes(
    objects: DriveObjects,
    units: Units,
    parameters: Callable[[], DriveParameters],
    warn: Callable[[str], None],
) -> Iterator[Mode]:
    """Yield the modes whose targets are single values, which may go by SDO."""

    def target(mode: OperationMode, cyclic: OperationMode) -> OffsetTarget | None:
        """Return the target of a mode, which a cyclic mode adds an offset to until it is left."""
        writer, offset = objects.profile_target_writer(mode), OFFSET_OBJECTS[cyclic]
        if writer is None:
            return None
        return OffsetTarget(
            writer,
            lambda: (
                objects.offset(offset, parameters().offsets)
                if objects.mode_display == cyclic
                else 0
            ),
        )

    position = target(OperationMode.PROFILE_POSITION, OperationMode.CYCLIC_POSITION)
    if position is not None:
        leads = objects.must_lead(Index.TARGET_POSITION)
        yield ProfilePosition(units, position, warn, target_leads=leads)
    vl_target = objects.profile_target_writer(OperationMode.VELOCITY)
    if vl_target is not None:
        yield Velocity(vl_target, partial(units.velocity.to_device, largest=INT16_MAX))
    velocity = target(OperationMode.PROFILE_VELOCITY, OperationMode.CYCLIC_VELOCITY)
    if velocity is not None:
        yield ProfileVelocity(velocity, units.velocity.to_device)
    torque = target(OperationMode.PROFILE_TORQUE, OperationMode.CYCLIC_TORQUE)
    if torque is not None:
        yield ProfileTorque(torque, units.effort.to_device)


def _cyclic_modes(
    objects: DriveObjects, units: Units, parameters: Callable[[], DriveParameters]
) -> Iterator[Mode]:
    """Yield the modes with a target in each cycle, which only an RPDO can carry."""

    def target(mode: OperationMode) -> OffsetTarget | None:
        writer, offset = objects.target_writer(TARGET_OBJECTS[mode][0]), OFFSET_OBJECTS[mode]
        if writer is None:
            return None
        return OffsetTarget(writer, lambda: objects.offset(offset, parameters().offsets))

    position = target(OperationMode.CYCLIC_POSITION)
    if position is not None:
        yield CyclicPosition(units, position, lambda: parameters().profile)
    interpolation = objects.target_writer(Index.INTERPOLATION_DATA, 1)
    if interpolation is not None:
        yield InterpolatedPosition(units, interpolation, lambda: parameters().profile)
    velocity = target(OperationMode.CYCLIC_VELOCITY)
    if velocity is not None:
        yield CyclicVelocity(
            velocity,
            units.velocity.to_device,
            units.velocity.commanded,
            lambda: parameters().profile.acceleration,
        )
    torque = target(OperationMode.CYCLIC_TORQUE)
    if torque is not None:
        yield CyclicTorque(
            torque,
            units.effort.to_device,
            units.effort.commanded,
            lambda: parameters().torque_slope,
        )
