# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters that the master reads from a drive once it is booted, by SDO."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ..config.model.drive import DriveConfig
from ..config.model.factor_group import FACTOR_OBJECTS, FactorGroup, ratio
from ..exceptions import CodecError, SdoAbortError, SdoError
from ..master.remote_node import RemoteNode
from ..standard.drive import OperationMode
from ..standard.objects import AXIS_OFFSET, Index
from .setpoint_profile import ProfileLimits
from .units import Units

READ_TIMEOUT = 0.5  # [s] nothing waits for these answers, so a slow device has its time
DEFAULT_VELOCITY = 0.5  # [unit/s] for drives without 0x6081: slow, but moving
DEFAULT_ACCELERATION = 1.0  # [unit/s^2] for drives without 0x6083
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
        self._units_from = '' if config.scale_from_factor_group else 'bus.yml'

    def forget(self) -> None:
        """Read the units again; they do not change while a device runs."""
        self._units_from = '' if self._config.scale_from_factor_group else 'bus.yml'

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
        profile = replace(await self._profile(), speed_limit=speed_limit or 0.0)
        quick_stop = await self._read(Index.QUICK_STOP_DECELERATION)
        return DriveParameters(
            supported_modes=await self._read(Index.SUPPORTED_MODES),
            homing_method=await self._read(Index.HOMING_METHOD) or 0,
            position_limits=await self._position_limits(),
            speed_limit=speed_limit,
            effort_limit=abs(units.effort_commanded(effort)) if effort else None,
            following_window=self._following_window(window),
            profile=profile,
            quick_stop_deceleration=self._in_units(quick_stop, profile.deceleration),
            torque_slope=abs(units.effort_commanded(slope or DEFAULT_TORQUE_SLOPE_DEV)),
            profile_velocity_inc=await self._profile_velocity(),
            units=self._units_from,
        )

    async def factor_group(self) -> FactorGroup:
        """Read what the drive says about its increments.

        Raises:
            SdoError: It does not answer.
        """
        return FactorGroup(
            **{name: await self._ratio(index) for name, index in FACTOR_OBJECTS.items()}
        )

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

    async def _profile(self) -> ProfileLimits:
        velocity = await self._read(Index.PROFILE_VELOCITY)
        acceleration = await self._read(Index.PROFILE_ACCELERATION)
        deceleration = await self._read(Index.PROFILE_DECELERATION)

        return ProfileLimits(
            velocity=self._in_units(velocity, DEFAULT_VELOCITY),
            acceleration=self._in_units(acceleration, DEFAULT_ACCELERATION),
            deceleration=self._in_units(deceleration or acceleration, DEFAULT_ACCELERATION),
        )

    def _in_units(self, value: int | None, default: float) -> float:
        """Convert a rate or its change to user units; a drive without it has the default."""
        return abs(self._units.velocity_commanded(value)) if value else default

    async def _read_units(self) -> str:
        """Take the units of the factor group (CiA 402-2, clause 8); report where they are from."""
        factors = await self.factor_group()
        scale, velocity_scale = factors.position_scale, factors.velocity_scale
        if not scale:
            raise SdoError(
                'scale_from_factor_group is true in bus.yml, and the drive has neither 0x6092 '
                'nor 0x608F; write scale_pos_to_dev and the other scales instead'
            )
        self._units.use(
            replace(
                self._config,
                scale_pos_to_dev=scale,
                scale_pos_from_dev=1.0 / scale,
                scale_vel_to_dev=velocity_scale,
                scale_vel_from_dev=1.0 / velocity_scale,
            )
        )
        return f'the drive (0x608F, 0x6091, 0x6092, 0x6096): {scale:g} per rad'

    async def _ratio(self, index: int) -> float | None:
        """Read numerator and denominator; None when the drive has no such object."""
        return ratio(await self._read(index, 1), await self._read(index, 2))

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
