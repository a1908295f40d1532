# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters that the master reads from a drive by SDO after its boot, and known quirks.

For drives that deviate from CiA 402, ``quirks: NAME`` in bus.yml selects an entry of
:data:`QUIRKS`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from canopen_core import CodecError, DriveError, SdoAbortError, SdoError
from canopen_core.standard import AXIS_OFFSET, Index, OperationMode

from ..config.model.drive import ACCELERATION_ADDRESSES, DriveConfig, FACTOR_ADDRESSES, FactorGroup
from ..config.model.drive_units import is_coarse
from ..master.remote_node import RemoteNode
from ..master.scheduler import Promise, Scheduler, Task
from .units import INT32_MAX, Units

RETRY_PERIOD = 1.0  # [s] until a failed reading is repeated
READ_TIMEOUT = 0.5  # [s] long enough for slow devices, as nothing waits for these answers
SPEED_SHARE = 0.1  # profile velocity of drives without 0x6081, as share of 0x607F
RANGE_TIME = 10.0  # [s] to cross the range (0x607D), for drives without 0x6081 and 0x607F
RAMP_TIME = 0.5  # [s] to reach the profile velocity, for drives without 0x6083
DEFAULT_VELOCITY = 0.5  # [unit/s] for drives without any of these: slow, but moving
DEFAULT_ACCELERATION = DEFAULT_VELOCITY / RAMP_TIME  # [unit/s^2]
OFFSET_OBJECTS: dict[OperationMode, Index] = {
    OperationMode.CYCLIC_POSITION: Index.POSITION_OFFSET,
    OperationMode.CYCLIC_VELOCITY: Index.VELOCITY_OFFSET,
    OperationMode.CYCLIC_TORQUE: Index.TORQUE_OFFSET,
}
"""What a drive adds to the target of a cyclic mode (CiA 402-2, clauses 13 to 15)."""


@dataclass(frozen=True, slots=True)
class ProfileLimits:
    """Limits of a profile, in user units."""

    velocity: float  # largest speed towards a single target in [unit/s]
    acceleration: float  # largest acceleration in [unit/s^2]
    deceleration: float  # largest deceleration in [unit/s^2]
    # largest speed along a stream of targets in [unit/s], if higher than ``velocity``
    speed_limit: float = 0.0


DEFAULT_PROFILE = ProfileLimits(DEFAULT_VELOCITY, DEFAULT_ACCELERATION, DEFAULT_ACCELERATION)
NO_WINDOW = (0, 0xFFFF_FFFF)  # values of 0x6065 and 0x6067 that disable monitoring
DEFAULT_TORQUE_SLOPE_DEV = 1000.0  # [device units/s]: from 0 to the rated torque in a second

ADDRESSES: tuple[tuple[int, int], ...] = (
    (Index.SUPPORTED_MODES, 0),
    (Index.HOMING_METHOD, 0),
    (Index.HOME_OFFSET, 0),
    *((Index.POSITION_RANGE_LIMIT, subindex) for subindex in (1, 2)),
    *((Index.SOFTWARE_POSITION_LIMIT, subindex) for subindex in (1, 2)),
    (Index.MAX_PROFILE_VELOCITY, 0),
    (Index.FOLLOWING_ERROR_WINDOW, 0),
    (Index.POSITION_WINDOW, 0),
    (Index.MAX_TORQUE, 0),
    (Index.PROFILE_VELOCITY, 0),
    (Index.PROFILE_ACCELERATION, 0),
    (Index.PROFILE_DECELERATION, 0),
    (Index.QUICK_STOP_DECELERATION, 0),
    (Index.TORQUE_SLOPE, 0),
    *((index, 0) for index in OFFSET_OBJECTS.values()),
)
"""Objects of the first axis that are read."""
REFRESHED = frozenset(index for index, _ in ADDRESSES) - {Index.SUPPORTED_MODES}
"""Those that are read again when this master has written one of them."""


@dataclass(frozen=True, slots=True)
class DriveParameters:
    """Parameters of one drive; None for objects that the drive lacks."""

    supported_modes: int | None = None  # bits of 0x6502
    homing_method: int = 0  # 0x6098
    # software limits 0x607D minus the home offset 0x607C in user units, lower first; within the
    # range at which positions wrap (0x607B), as feedback could not show a target beyond it
    position_limits: tuple[float, float] | None = None
    speed_limit: float | None = None  # 0x607F in user units per second
    effort_limit: float | None = None  # 0x6072 in user units
    # 0x6065 in user units; also None if monitoring is disabled
    following_window: float | None = None
    position_window: float | None = None  # 0x6067, likewise
    # limits for profiles that the master generates, from 0x6081, 0x6083, 0x6084 and 0x607F
    profile: ProfileLimits = DEFAULT_PROFILE
    # 0x6085 in user units per second squared
    quick_stop_deceleration: float = DEFAULT_ACCELERATION
    # largest torque slope for ramps of the master in user units per second, from 0x6087
    torque_slope: float = DEFAULT_TORQUE_SLOPE_DEV
    # 0x6081 in device units; None if the drive lacks it or a PDO carries it
    profile_velocity_inc: int | None = None
    # offsets that the drive adds to cyclic targets (0x60B0 to 0x60B2) in device units, by object
    # of the first axis
    offsets: Mapping[int, int] = field(default_factory=dict)
    units: str = 'bus.yml'  # source of the units, in words

    def supports(self, mode: OperationMode) -> bool:
        """Return whether the drive supports a mode; without 0x6502 it is assumed to."""
        return self.supported_modes is None or bool(self.supported_modes & mode.support_bit)


class ParameterCache:
    """Cache of the parameters of one axis, read after each boot and each change."""

    def __init__(
        self,
        node: RemoteNode,
        config: DriveConfig,
        units: Units,
        scheduler: Scheduler,
        warn: Callable[[str], None],
    ) -> None:
        """Set ``units`` from the drive if bus.yml defines none."""
        self.parameters = DriveParameters()  # last parameters that the drive reported
        self.known = False  # the parameters were read since the last boot
        self._node = node
        self._config = config
        self._units = units
        self._offset = AXIS_OFFSET * config.channel
        self._units_from = ''  # source of the units, fixed while a device runs
        self._scheduler = scheduler
        self._warn = warn
        self._reading: Task[None] | None = None
        self._outdated = False
        node.sdo.on_download.append(self._object_downloaded)

    def begin(self) -> None:
        """Read the parameters after the device has booted."""
        self._reading = self._scheduler.background(self._keep_reading())

    def forget(self, reason: str) -> None:
        """Forget the parameters: the device is lost and may be replaced by another one."""
        self.known = self._outdated = False
        self._units_from = ''
        if self._reading is not None:
            self._reading.cancel(SdoError(reason))

    async def factor_group(
        self, addresses: Sequence[tuple[int, int]] = FACTOR_ADDRESSES
    ) -> FactorGroup:
        """Read the factor group of the drive; raise SdoError if it does not answer."""
        held = await self._read_each(addresses)
        return FactorGroup.read(lambda index, subindex: held.get((index, subindex)))

    def _object_downloaded(
        self, index: int, subindex: int, data: bytes, end: Promise[None]
    ) -> None:
        """Read the parameters again when a client of this master changes one of them."""
        if index - self._offset in REFRESHED:
            end.when_done(self._object_written)

    def _object_written(self, end: Promise[None]) -> None:
        if not self.known or end.error is not None:
            return
        self._outdated = True
        if self._reading is None or self._reading.done:
            self._reading = self._scheduler.background(self._keep_reading())

    async def _keep_reading(self) -> None:
        reason = await self._refresh()
        if reason and self.known:
            self._warn(f'its limits were changed, and the new ones cannot be read: {reason}')
        elif reason:
            self._warn(f'its parameters are unknown, so it takes no commands: {reason}')
        while reason or self._outdated:
            if reason:
                await self._scheduler.timer(RETRY_PERIOD)
            reason = await self._refresh()

    async def _refresh(self) -> str:
        """Read the parameters; return the reason for a failure, or an empty text."""
        self._outdated = False
        try:
            self.parameters = await self._read_all()
        except SdoError as error:  # then limits are unknown, not absent
            return str(error)
        if not self.known:
            self._warn_of_silence()
        self.known = True
        return ''

    def _warn_of_silence(self) -> None:
        """Warn, after a boot, of parameters with which targets cause no motion."""
        used = self._config.position_mode in (None, OperationMode.PROFILE_POSITION)
        if used and self.parameters.profile_velocity_inc == 0:
            self._warn('its profile velocity (0x6081) is 0: targets of mode 1 are refused')
        scale = self._units.position.to_dev
        if self._config.scale_from_factor_group and is_coarse(scale):
            self._warn(
                f'1.0 rad is {scale:g} increments by its factor group: targets between two of '
                'them are refused'
            )

    async def _read_all(self) -> DriveParameters:
        """Read the parameters in the EDS; derive missing ones from the others."""
        self._units_from = self._units_from or await self._read_units()
        held, units = await self._read_each(ADDRESSES), self._units

        def value(index: int, subindex: int = 0) -> int:
            return held[index, subindex] or 0

        def acceleration(index: int, default: float) -> float:
            return abs(units.acceleration.from_device(value(index))) if value(index) else default

        speed_limit = position_limits = effort_limit = None
        velocity = DEFAULT_VELOCITY
        lower, upper = (held[Index.SOFTWARE_POSITION_LIMIT, subindex] for subindex in (1, 2))
        if lower is not None and upper is not None and lower < upper:
            # scaled like targets, which they limit; they count from home, not from zero
            offset = value(Index.HOME_OFFSET)
            low, high = sorted(units.position.commanded(end - offset) for end in (lower, upper))
            position_limits, velocity = (low, high), (high - low) / RANGE_TIME
        lower, upper = (value(Index.POSITION_RANGE_LIMIT, subindex) for subindex in (1, 2))
        if -INT32_MAX < lower < upper < INT32_MAX:  # 0 and 0, or all of INT32: no limits
            ends = sorted(units.position.commanded(end) for end in (lower, upper))
            low, high = position_limits or ends
            position_limits = max(low, ends[0]), min(high, ends[1])
        if speed := value(Index.MAX_PROFILE_VELOCITY):
            speed_limit = abs(units.velocity.commanded(speed))
            velocity = SPEED_SHARE * speed_limit
        if speed := value(Index.PROFILE_VELOCITY):
            velocity = abs(units.velocity.commanded(speed))
        if effort := value(Index.MAX_TORQUE):
            effort_limit = abs(units.effort.commanded(effort))

        def window(index: int) -> float | None:
            increments = value(index)
            return None if increments in NO_WINDOW else abs(increments / units.position.to_dev)

        accelerates = acceleration(Index.PROFILE_ACCELERATION, velocity / RAMP_TIME)
        profile = ProfileLimits(
            velocity=min(velocity, speed_limit or velocity),
            acceleration=accelerates,
            deceleration=acceleration(Index.PROFILE_DECELERATION, accelerates),
            speed_limit=speed_limit or 0.0,
        )
        place = Index.PROFILE_VELOCITY + self._offset
        in_rpdo = self._node.image.mapped_output(place) is not None
        slope = value(Index.TORQUE_SLOPE) or DEFAULT_TORQUE_SLOPE_DEV
        return DriveParameters(
            supported_modes=held[Index.SUPPORTED_MODES, 0],
            homing_method=value(Index.HOMING_METHOD),
            position_limits=position_limits,
            speed_limit=speed_limit,
            effort_limit=effort_limit,
            following_window=window(Index.FOLLOWING_ERROR_WINDOW),
            position_window=window(Index.POSITION_WINDOW),
            profile=profile,
            quick_stop_deceleration=acceleration(
                Index.QUICK_STOP_DECELERATION, profile.deceleration
            ),
            torque_slope=abs(units.effort.commanded(slope)),
            profile_velocity_inc=None if in_rpdo else held[Index.PROFILE_VELOCITY, 0],
            offsets={index: value(index) for index in OFFSET_OBJECTS.values()},
            units=self._units_from,
        )

    async def _read_units(self) -> str:
        """Use the units of the factor group (CiA 402-2, clause 8); return their source."""
        config, source = self._config, 'bus.yml'
        if not config.scale_from_factor_group and config.scale_acc_from_dev is not None:
            return source
        addresses = FACTOR_ADDRESSES if config.scale_from_factor_group else ACCELERATION_ADDRESSES
        factors = await self.factor_group(addresses)
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

    async def _read_each(
        self, addresses: Sequence[tuple[int, int]]
    ) -> dict[tuple[int, int], int | None]:
        """Read CiA 402 objects of this axis; None for those that the drive lacks."""
        return {address: await self._read(*address) for address in addresses}

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
            return None  # a drive may lack objects of its EDS; the default applies
        return value if isinstance(value, int) else None


@dataclass(frozen=True, slots=True)
class Quirks:
    """Deviations of one kind of drive from CiA 402."""

    state_timeout: float = 5.0  # time for all steps to a state in [s], as in ros2_canopen
    mode_timeout: float = 5.0  # time for 0x6061 to follow 0x6060 in [s]
    homed_without_arrival: bool = False  # only bit 12 shows the end of homing, never bit 10
    # the drive refuses 0x6060 = 0, so its present mode stays selected
    no_mode_zero: bool = False


STANDARD = Quirks()

QUIRKS: dict[str, Quirks] = {
    '': STANDARD,
    # 3 to 6 s to switch to interpolated position (ros_canopen issue 457)
    'festo_cmmp': Quirks(mode_timeout=10.0),
    # methods 35 and 37 end with bit 12 only (ros2_canopen issue 236)
    'homing_bit_12_only': Quirks(homed_without_arrival=True),
    # drives that answer 0x6060 = 0 with an abort, or ignore it
    'no_mode_zero': Quirks(no_mode_zero=True),
    # large drives that discharge and charge their DC link when they are switched
    'slow_states': Quirks(state_timeout=20.0),
}
"""By name; the sources are the reports of users."""


def quirks_of(name: str) -> Quirks:
    """Return the quirks that a name in bus.yml selects."""
    try:
        return QUIRKS[name]
    except KeyError:
        known = ', '.join(sorted(key for key in QUIRKS if key))
        raise DriveError(f'quirks {name!r} are unknown; known: {known}') from None
