# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The parameters of a drive: read after each boot, and again after each change."""

from __future__ import annotations

from collections.abc import Callable

from ..config.model.checks.drive_units import is_coarse
from ..config.model.drive import DriveConfig
from ..config.model.factor_group import FactorGroup
from ..exceptions import SdoError
from ..master.remote_node import RemoteNode
from ..master.scheduler import Promise, Scheduler, Task
from ..standard.drive import OperationMode
from ..standard.objects import AXIS_OFFSET
from .parameters import DriveParameters, ParameterReader, REFRESHED
from .units import Units

RETRY_PERIOD = 1.0  # [s] after which what a drive did not answer is read again


class ParameterCache:
    """The parameters of one axis.

    Attributes:
        parameters: What the drive reported last.
        known: They were read since its device was booted.
    """

    def __init__(
        self,
        node: RemoteNode,
        config: DriveConfig,
        units: Units,
        scheduler: Scheduler,
        warn: Callable[[str], None],
    ) -> None:
        """Take the axis.

        Args:
            node: The device.
            config: Settings of the axis.
            units: Its units.
            scheduler: Time.
            warn: Takes a warning in words.
        """
        self.parameters = DriveParameters()
        self.known = False
        self._offset = AXIS_OFFSET * config.channel
        self._config = config
        self._units = units
        self._reader = ParameterReader(node, config, units)
        self._scheduler = scheduler
        self._warn = warn
        self._reading: Task[None] | None = None
        self._outdated = False
        node.sdo.on_download.append(self._object_downloaded)

    def begin(self) -> None:
        """Read those of a device that was booted."""
        self._reading = self._scheduler.background(self._keep_reading())

    async def factor_group(self) -> FactorGroup:
        """Read what the drive says about its increments; SdoError when it does not answer."""
        return await self._reader.factor_group()

    def forget(self, reason: str) -> None:
        """The device is lost; what comes back may be another one."""
        self.known = self._outdated = False
        self._reader.forget()
        if self._reading is not None:
            self._reading.cancel(SdoError(reason))

    def _object_downloaded(
        self, index: int, subindex: int, data: bytes, end: Promise[None]
    ) -> None:
        """One of the objects may be changed through this master, by whomever."""
        if index - self._offset in REFRESHED:
            end.when_done(self._object_written)

    def _object_written(self, end: Promise[None]) -> None:
        if not self.known or end.error is not None:
            return
        self._outdated = True
        if self._reading is None or self._reading.done:
            self._reading = self._scheduler.background(self._keep_reading())

    async def _keep_reading(self) -> None:
        reason = await self._read()
        if reason and self.known:
            self._warn(f'its limits were changed, and the new ones cannot be read: {reason}')
        elif reason:
            self._warn(f'its parameters are unknown, so it takes no commands: {reason}')
        while reason or self._outdated:
            if reason:
                await self._scheduler.timer(RETRY_PERIOD)
            reason = await self._read()

    async def _read(self) -> str:
        """Read the parameters; return why that could not be done, or nothing."""
        self._outdated = False
        try:
            self.parameters = await self._reader.read()
        except SdoError as error:
            return str(error)
        if not self.known:
            self._warn_of_silence()
        self.known = True
        return ''

    def _warn_of_silence(self) -> None:
        """Warn, after a boot, of parameters with which targets would move nothing."""
        used = self._config.position_mode in (None, OperationMode.PROFILE_POSITION)
        if used and self.parameters.profile_velocity_inc == 0:
            self._warn('its profile velocity (0x6081) is 0: targets of mode 1 are refused')
        scale = self._units.position_scale
        if self._config.scale_from_factor_group and is_coarse(scale):
            self._warn(
                f'1.0 rad is {scale:g} increments by its factor group: targets between two of '
                'them are refused'
            )
