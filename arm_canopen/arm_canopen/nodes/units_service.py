# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How an axis counts: what bus.yml says, what the drive says, and in which file it stands."""

from __future__ import annotations

from concurrent.futures import Future
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from arm_msgs.srv import ReadUnits

from ..cia402.axis import Axis
from ..config.model.factor_group import FactorGroup
from ..master.runner import NetworkThread

if TYPE_CHECKING:
    from .device_node import DeviceNode

KEYS = (
    'scale_from_factor_group',
    'scale_pos_to_dev',
    'scale_pos_from_dev',
    'scale_vel_to_dev',
    'scale_vel_from_dev',
    'scale_eff_to_dev',
    'scale_eff_from_dev',
    'offset_pos_from_dev',
)
"""Keys of bus.yml, which are the names of the fields of the answer, too."""


@dataclass(frozen=True, slots=True)
class BusFile:
    """A bus.yml as the master has read it, so that a client recognizes the very file."""

    path: Path  # where it is on this computer
    inode: int = 0  # its inode; 0 when it is gone
    changed: int = 0  # when it was changed last in [ns]; 0 when it is gone

    @classmethod
    def at(cls, path: Path) -> BusFile:
        """Remember a file that was just read."""
        try:
            stat = path.stat()
        except OSError:
            return cls(path.absolute())
        return cls(path.absolute(), stat.st_ino, stat.st_mtime_ns)


class UnitsService:
    """``~/read_units`` of one axis."""

    def __init__(
        self, node: DeviceNode, drive: Axis, place: str, thread: NetworkThread, file: BusFile
    ) -> None:
        self._node, self._drive = node, drive
        self._thread, self._file = thread, file
        node.offer(ReadUnits, f'{place}/read_units', self._read, self._answer)

    def _read(self, _request: ReadUnits.Request) -> Future[FactorGroup]:
        return self._thread.run_coroutine(self._drive.view.cache.factor_group)

    def _answer(
        self, response: ReadUnits.Response, future: Future[FactorGroup]
    ) -> ReadUnits.Response:
        error = future.exception()
        if error is not None:
            response.message = str(error)
            return response
        factors, drive = future.result(), self._drive
        response.gear = factors.gear or 0.0
        response.factor_scale = factors.position_scale
        for key in KEYS:
            setattr(response, key, getattr(drive.view.units.config, key))
        response.bus_config = str(self._file.path)
        response.bus_config_inode = self._file.inode
        response.bus_config_changed = self._file.changed
        config = drive.node.config
        response.device = config.name
        response.channel = drive.config.channel if len(config.axes) > 1 else -1
        response.success = True  # last: an answer of which one part fails is sent, too
        return response
