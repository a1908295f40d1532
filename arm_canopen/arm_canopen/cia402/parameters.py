# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters that the master reads from a drive once it is booted, by SDO."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from ..config.model.drive import DriveConfig
from ..config.model.factor_group import ACCELERATION_ADDRESSES, FACTOR_ADDRESSES, FactorGroup
from ..exceptions import CodecError, SdoAbortError, SdoError
from ..master.remote_node import RemoteNode
from ..standard.drive import OperationMode
from ..standard.objects import AXIS_OFFSET, Index
from .setpoint_profile import ProfileLimits
from .target_offset import OFFSET_OBJECTS
from .units import Units

READ_TIMEOUT = 0.5  # [s] nothing waits for these answers, so a slow device has its time
SPEED_SHARE = 0.1  # share of 0x607F with which drives without 0x6081 move
RANGE_TIME = 10.0  # [s] in which those without 0x607F, too, cross their range (0x607D)
RAMP_TIME = 0.5  # [s] in which drives without 0x6083 get to their profile velocity
DEFAULT_VELOCITY = 0.5  # [unit/s] for drives without any of these: slow, but moving
DEFAULT_ACCELERATION = DEFAULT_VELOCITY / RAMP_TIME  # [unit/s^2]
DEFAULT_PROFILE = ProfileLimits(DEFAULT_VELOCITY, DEFAULT_ACCELERATION, DEFAULT_ACCELERATION)
NO_WINDOW = (0, 0xFFFF_FFFF)  # values of 0x6065 with which nothing is monitored
DEFAULT_TORQUE_SLOPE_DEV = 1000.0  # [device units/s]: from 0 to the rated torque in a second

REFRESHED = frozenset(
    {
        Index.HOMING_METHOD,
        Index.SOFTWARE_POSITION_LIMIT,
        Index.MAX_PROFILE_VELOCITY,
        Index.FOLLOWING_ERROR_WINDOW,
        Index.MAX_TORQUE,
        Index.PROFILE_VELOCITY,
        Index.PROFILE_ACCELERATION,
        Index.PROFILE_DECELERATION,
        Index.QUICK_STOP_DECELERATION,
        Index.TORQUE_SLOPE,
        *OFFSET_OBJECTS.values(),
    }
)
"""Objects of the first axis that are read again when this master has written one of them."""


@dataclass(frozen=True, slots=True)
class DriveParameters:
    """Parameters of one drive; None where the drive does not have them.

    Attributes:
        supported_modes: Bits of 0x6502.
        homing_method: 0x6098.
        position_limits: Software limits 0x607D in user units, lower first.
        speed_limit: 0x607F in user units per second.
        effort_limit: 0x6072 in user units.
        following_window: 0x6065 in user units; None where nothing is monitored, too.
        profile: Limits for profiles of the master's own, from 0x6081, 0x6083, 0x6084 and 0x607F.
        quick_stop_deceleration: 0x6085 in user units per second squared.
        torque_slope: Greatest change of a torque that the master ramps, in user units per second,
            from 0x6087.
        profile_velocity_inc: 0x6081 in device units; None when the drive has none, or a PDO
            carries it.
        offsets: What the drive adds to the targets of its cyclic modes (0x60B0 to 0x60B2) in
            device units, by object of the first axis.
        units: In words, where the units come from.
    """

    supported_modes: int | None = None
    homing_method: int = 0
    position_limits: tuple[float, float] | None = None
    speed_limit: float | None = None
    effort_limit: float | None = None
    following_window: float | None = None
    profile: ProfileLimits = DEFAULT_PROFILE
    quick_stop_deceleration: float = DEFAULT_ACCELERATION
    torque_slope: float = DEFAULT_TORQUE_SLOPE_DEV
    profile_velocity_inc: int | None = None
    offsets: Mapping[int, int] = field(default_factory=dict)
    units: str = 'bus.yml'

    def supports(self, mode: OperationMode) -> bool:
        """Whether the drive has a mode; one without 0x6502 is believed to have all."""
        return self.supported_modes is None or bool(self.supported_modes & mode.support_bit)


class ParameterReader:
    """Reads these objects of one axis, as far as its EDS has them."""

    def __init__(self, node: RemoteNode, config: DriveConfig, units: Units) -> None:
        """Take the axis.

        Args:
            node: The device.
            config: Settings of the axis.
            units: Its units; they become the drive's own where bus.yml gives none.
        """
        self._node = node
        self._config = config
        self._units = units
        self._offset = AXIS_OFFSET * config.channel
        self._units_from = ''

    def forget(self) -> None:
        """Read the units again; they do not change while a device runs."""
        self._units_from = ''

    async def read(self) -> DriveParameters:
        """Read all of them.

        Raises:
            SdoError: The drive does not answer. Its limits are then unknown, which is not the same
                as that it has none.
        """
        self._units_from = self._units_from or await self._read_units()
        units = self._units
        slope = await self._read(Index.TORQUE_SLOPE)
        effort = await self._read(Index.MAX_TORQUE)
        window = await self._read(Index.FOLLOWING_ERROR_WINDOW)
        speed = await self._read(Index.MAX_PROFILE_VELOCITY)
        speed_limit = abs(units.velocity_commanded(speed)) if speed else None
        position_limits = await self._position_limits()
        profile = await self._profile(speed_limit, position_limits)
        quick_stop = await self._read(Index.QUICK_STOP_DECELERATION)
        return DriveParameters(
            supported_modes=await self._read(Index.SUPPORTED_MODES),
            homing_method=await self._read(Index.HOMING_METHOD) or 0,
            position_limits=position_limits,
            speed_limit=speed_limit,
            effort_limit=abs(units.effort_commanded(effort)) if effort else None,
            following_window=self._following_window(window),
            profile=profile,
            quick_stop_deceleration=self._acceleration(quick_stop, profile.deceleration),
            torque_slope=abs(units.effort_commanded(slope or DEFAULT_TORQUE_SLOPE_DEV)),
            profile_velocity_inc=await self._profile_velocity(),
            offsets={index: await self._read(index) or 0 for index in OFFSET_OBJECTS.values()},
            units=self._units_from,
        )

    async def factor_group(self) -> FactorGroup:
        """Read what the drive says about its increments.

        Raises:
            SdoError: It does not answer.
        """
        return await self._factor_group(FACTOR_ADDRESSES)

    async def _factor_group(self, addresses: Sequence[tuple[int, int]]) -> FactorGroup:
        held = {address: await self._read(*address) for address in addresses}
        return FactorGroup.read(lambda index, subindex: held.get((index, subindex)))

    async def _profile_velocity(self) -> int | None:
        if self._node.image.mapped_output(Index.PROFILE_VELOCITY + self._offset) is not None:
            return None
        return await self._read(Index.PROFILE_VELOCITY)

    async def _position_limits(self) -> tuple[float, float] | None:
        lower = await self._read(Index.SOFTWARE_POSITION_LIMIT, 1)
        upper = await self._read(Index.SOFTWARE_POSITION_LIMIT, 2)
        if lower is None or upper is None or lower >= upper:
            return None
        convert = self._units.position_commanded  # as targets go, which they are limits of
        ends = sorted((convert(lower), convert(upper)))
        return ends[0], ends[1]

    def _following_window(self, window: int | None) -> float | None:
        if window is None or window in NO_WINDOW:
            return None
        return abs(window / self._units.position_scale)

    async def _profile(
        self, speed_limit: float | None, position_limits: tuple[float, float] | None
    ) -> ProfileLimits:
        """Read the limits of a profile; what the drive does not say follows from its others."""
        velocity_dev = await self._read(Index.PROFILE_VELOCITY)
        acceleration = await self._read(Index.PROFILE_ACCELERATION)
        deceleration = await self._read(Index.PROFILE_DECELERATION)
        if velocity_dev:
            velocity = abs(self._units.velocity_commanded(velocity_dev))
        elif speed_limit is not None:
            velocity = SPEED_SHARE * speed_limit
        elif position_limits is not None:
            velocity = (position_limits[1] - position_limits[0]) / RANGE_TIME
        else:
            velocity = DEFAULT_VELOCITY
        default = velocity / RAMP_TIME
        return ProfileLimits(
            velocity=min(velocity, speed_limit or velocity),
            acceleration=self._acceleration(acceleration, default),
            deceleration=self._acceleration(deceleration or acceleration, default),
            speed_limit=speed_limit or 0.0,
        )

    def _acceleration(self, value: int | None, default: float) -> float:
        """Convert an acceleration to user units; a drive without it has the default."""
        return abs(self._units.acceleration_from_device(value)) if value else default

    async def _read_units(self) -> str:
        """Take the units of the factor group (CiA 402-2, clause 8); report where they are from."""
        config, source = self._config, 'bus.yml'
        if not config.scale_from_factor_group and config.scale_acc_from_dev is not None:
            return source
        addresses = FACTOR_ADDRESSES if config.scale_from_factor_group else ACCELERATION_ADDRESSES
        factors = await self._factor_group(addresses)
        if config.scale_from_factor_group:
            scale, velocity_scale = factors.position_scale, factors.velocity_scale
            if not scale:
                raise SdoError(
                    'scale_from_factor_group is true in bus.yml, and the drive has neither 0x6092 '
                    'nor 0x608F; write scale_pos_to_dev and the other scales instead'
                )
            objects = ', '.join(f'0x{index:04X}' for index in factors.position_objects)
            source = f'the drive ({objects}): {scale:g} per rad'
            config = replace(
                config,
                scale_pos_to_dev=scale,
                scale_pos_from_dev=1.0 / scale,
                scale_vel_to_dev=velocity_scale,
                scale_vel_from_dev=1.0 / velocity_scale,
            )
        if config.scale_acc_from_dev is None:
            scale = config.scale_vel_to_dev * (factors.acceleration_ratio or 1.0)
            config = replace(config, scale_acc_to_dev=scale, scale_acc_from_dev=1.0 / scale)
        self._units.use(config)
        return source

    async def _read(self, index: int, subindex: int = 0) -> int | None:
        profile_index = index + self._offset
        entry = self._node.config.dictionary.get(profile_index, subindex)
        if entry is None or not entry.access.readable:
            return None
        try:
            value = await self._node.objects.read_object(
                profile_index, subindex, timeout=READ_TIMEOUT
            )
        except (SdoAbortError, CodecError):
            return None  # a drive may lack what its EDS promises; the default stands
        return value if isinstance(value, int) else None
