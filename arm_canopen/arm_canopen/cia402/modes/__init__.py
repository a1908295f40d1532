# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Modes of operation; :func:`build_modes` builds those that objects and RPDOs of a drive allow."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from canopen_core.standard import Index, OperationMode, TARGET_OBJECTS

from ...master.process_image import Writer
from ..parameters import OFFSET_OBJECTS
from ..state import AxisState
from .cyclic_position import CyclicPosition, FeedForward, InterpolatedPosition
from .mode import Homing, Mode, NO_BITS, NoMode, OffsetTarget
from .profile_position import Move, NEW_SET_POINT, ProfilePosition
from .rates import CyclicTorque, CyclicVelocity, ProfileTorque, ProfileVelocity, Velocity

__all__ = [
    'NEW_SET_POINT',
    'NO_BITS',
    'CyclicPosition',
    'FeedForward',
    'Homing',
    'InterpolatedPosition',
    'Mode',
    'Move',
    'NoMode',
    'ProfilePosition',
    'build_modes',
]


def build_modes(view: AxisState, warn: Callable[[str], None]) -> dict[int, Mode]:
    """Return the usable modes of a drive by their number in 0x6060."""
    modes = [NoMode(), Homing(), *_profile_modes(view, warn), *_cyclic_modes(view)]
    return {mode.number: mode for mode in modes}


def _profile_modes(view: AxisState, warn: Callable[[str], None]) -> Iterator[Mode]:
    """Yield the modes with single targets, which may go by SDO."""
    node, units = view.node, view.units

    def writer(mode: OperationMode) -> Writer | None:
        """Return a writer for the target of a mode, using SDO if no PDO carries it."""
        index, subindex = TARGET_OBJECTS[mode]
        entry = node.config.dictionary.get(view.at(index), subindex)
        writer = node.objects.writer(view.at(index), subindex)
        return None if writer.by_sdo and (entry is None or not entry.access.writable) else writer

    def target(mode: OperationMode, cyclic: OperationMode) -> OffsetTarget | None:
        """Return the target of a mode; it subtracts the offset while the cyclic mode is active."""
        offset = OFFSET_OBJECTS[cyclic]
        if (of_mode := writer(mode)) is None:
            return None
        return OffsetTarget(of_mode, lambda: view.offset(offset) if view.mode == cyclic else 0)

    if position := target(OperationMode.PROFILE_POSITION, OperationMode.CYCLIC_POSITION):
        place, command = view.at(Index.TARGET_POSITION), view.at(Index.CONTROLWORD)
        leads = not node.image.is_applied_first(place, 0, command=command)
        yield ProfilePosition(view, position, warn, target_leads=leads)
    if vl_target := writer(OperationMode.VELOCITY):
        yield Velocity(vl_target, units.velocity)
    if velocity := target(OperationMode.PROFILE_VELOCITY, OperationMode.CYCLIC_VELOCITY):
        yield ProfileVelocity(velocity, units.velocity)
    if torque := target(OperationMode.PROFILE_TORQUE, OperationMode.CYCLIC_TORQUE):
        yield ProfileTorque(torque, units.effort)


def _cyclic_modes(view: AxisState) -> Iterator[Mode]:
    """Yield the modes with a target in each cycle, which require an RPDO."""
    units, image = view.units, view.node.image

    def target(mode: OperationMode) -> OffsetTarget | None:
        writer, offset = image.writer(view.at(TARGET_OBJECTS[mode][0])), OFFSET_OBJECTS[mode]
        return None if writer is None else OffsetTarget(writer, lambda: view.offset(offset))

    if position := target(OperationMode.CYCLIC_POSITION):
        yield CyclicPosition(units, position, lambda: view.parameters.profile)
    if interpolation := image.writer(view.at(Index.INTERPOLATION_DATA), 1):
        yield InterpolatedPosition(units, interpolation, lambda: view.parameters.profile)
    if velocity := target(OperationMode.CYCLIC_VELOCITY):
        yield CyclicVelocity(
            velocity,
            units.velocity,
            lambda: view.parameters.profile.acceleration,
            lambda: view.parameters.profile.deceleration,
        )
    if torque := target(OperationMode.CYCLIC_TORQUE):
        yield CyclicTorque(torque, units.effort, lambda: view.parameters.torque_slope)
