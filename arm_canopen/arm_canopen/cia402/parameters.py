# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the master asks a drive about itself once it is booted, by SDO."""

from __future__ import annotations

from dataclasses import dataclass

from ..exceptions import CodecError, SdoAbortError
from ..master.remote_node import RemoteNode
from ..standard.drive import OperationMode
from ..standard.objects import Index
from .setpoint_profile import ProfileLimits
from .units import Units

READ_TIMEOUT = 0.5  # [s] nothing waits for these answers, so a slow device has its time
DEFAULT_VELOCITY = 0.5  # [unit/s] for drives without 0x6081: slow, but moving
DEFAULT_ACCELERATION = 1.0  # [unit/s^2] for drives without 0x6083
DEFAULT_PROFILE = ProfileLimits(DEFAULT_VELOCITY, DEFAULT_ACCELERATION, DEFAULT_ACCELERATION)


@dataclass(frozen=True, slots=True)
class DriveParameters:
    """Parameters of one drive; None where the drive does not tell.

    Attributes:
        supported_modes: Bits of 0x6502.
        homing_method: 0x6098.
        position_limits: Software limits 0x607D in user units, lower first.
        profile: Limits for profiles of the master's own, from 0x6081, 0x6083 and 0x6084.
    """

    supported_modes: int | None = None
    homing_method: int = 0
    position_limits: tuple[float, float] | None = None
    profile: ProfileLimits = DEFAULT_PROFILE

    def supports(self, mode: OperationMode) -> bool:
        """Whether the drive has a mode; one that does not tell is believed to have all."""
        return self.supported_modes is None or bool(self.supported_modes & mode.support_bit)


async def read_parameters(node: RemoteNode, units: Units) -> DriveParameters:
    """Ask the drive for everything that its EDS knows of these objects.

    Raises:
        SdoError: The drive does not answer. Its limits are then unknown, which is not the same as
            that it has none.
    """
    modes = await _read(node, Index.SUPPORTED_MODES)
    method = await _read(node, Index.HOMING_METHOD)
    lower = await _read(node, Index.SOFTWARE_POSITION_LIMIT, 1)
    upper = await _read(node, Index.SOFTWARE_POSITION_LIMIT, 2)
    limits = None
    if lower is not None and upper is not None and lower < upper:
        ends = sorted((units.position_from_device(lower), units.position_from_device(upper)))
        limits = (ends[0], ends[1])
    velocity = await _read(node, Index.PROFILE_VELOCITY)
    acceleration = await _read(node, Index.PROFILE_ACCELERATION)
    deceleration = await _read(node, Index.PROFILE_DECELERATION)

    def in_units(value: int | None, default: float) -> float:
        return abs(units.velocity_from_device(value)) if value else default

    return DriveParameters(
        supported_modes=modes,
        homing_method=method or 0,
        position_limits=limits,
        profile=ProfileLimits(
            velocity=in_units(velocity, DEFAULT_VELOCITY),
            acceleration=in_units(acceleration, DEFAULT_ACCELERATION),
            deceleration=in_units(deceleration or acceleration, DEFAULT_ACCELERATION),
        ),
    )


async def _read(node: RemoteNode, index: int, subindex: int = 0) -> int | None:
    entry = node.config.dictionary.get(index, subindex)
    if entry is None or not entry.access.readable:
        return None
    try:
        value = await node.read_object(index, subindex, timeout=READ_TIMEOUT)
    except (SdoAbortError, CodecError):
        return None  # a drive may lack what its EDS promises; the default stands
    return value if isinstance(value, int) else None
