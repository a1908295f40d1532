# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The input devices of this machine, by the package evdev."""

from __future__ import annotations

from collections.abc import Iterable
import contextlib
import importlib.util
import os
from pathlib import Path
from typing import Any

from ..exceptions import DeviceError
from .events import AxisRange, DeviceInfo, DeviceState, EV_ABS, EV_KEY, InputDevice, InputEvent

FOLDER = '/dev/input'
MISSING = 'the Python package evdev is missing: sudo apt-get install python3-evdev'
PERMISSION = (
    'members of the group input may read it (sudo usermod -aG input $USER, then log in again)'
)


class KernelDevice:
    """An open file of /dev/input."""

    def __init__(self, path: str) -> None:
        """Open it.

        Args:
            path: such as ``/dev/input/event3``.

        Raises:
            DeviceError: It is gone, or may not be read, or the package evdev is missing.
        """
        try:
            # not every installation has it, and keys work without
            import evdev
        except ImportError:
            raise DeviceError(MISSING) from None
        try:
            self._device = evdev.InputDevice(path)
            capabilities = self._device.capabilities(absinfo=True)
        except OSError as error:
            raise DeviceError(f'{path}: {error.strerror}; {PERMISSION}') from None
        axes: list[Any] = capabilities.get(EV_ABS, [])  # its types do not know of absinfo
        self._info = DeviceInfo(
            path=path,
            name=self._device.name,
            vendor=self._device.info.vendor,
            product=self._device.info.product,
            keys=frozenset(capabilities.get(EV_KEY, [])),
            axes={code: AxisRange(info.min, info.max, info.flat) for code, info in axes},
        )

    @property
    def info(self) -> DeviceInfo:
        """What it is."""
        return self._info

    def fileno(self) -> int:
        """Return what to wait for."""
        return self._device.fd

    def read(self) -> Iterable[InputEvent]:
        """Return the events that have come, without waiting.

        Raises:
            DeviceError: It was unplugged.
        """
        try:
            return [InputEvent(each.type, each.code, each.value) for each in self._device.read()]
        except BlockingIOError:
            return []
        except OSError as error:
            raise self._gone(error) from None

    def state(self) -> DeviceState:
        """Return its present state.

        Raises:
            DeviceError: It was unplugged.
        """
        try:
            axes = {code: self._device.absinfo(code).value for code in self._info.axes}
            return DeviceState(frozenset(self._device.active_keys()), axes)
        except OSError as error:
            raise self._gone(error) from None

    def close(self) -> None:
        """Let the kernel have it back; one that was unplugged is no error."""
        with contextlib.suppress(OSError):
            self._device.close()

    def _gone(self, error: OSError) -> DeviceError:
        return DeviceError(f'{self._info.name} ({self._info.path}) is gone: {error.strerror}')


class KernelDevices:
    """All devices of this machine that this user may read."""

    def __init__(self, folder: str = FOLDER) -> None:
        """Look in a folder.

        Args:
            folder: Where the kernel has them.
        """
        self._folder = folder

    def paths(self) -> list[str]:
        """Return the files of the devices that this user may read."""
        files = sorted(Path(self._folder).glob('event*'), key=_number)
        return [str(file) for file in files if os.access(file, os.R_OK)]

    def open(self, path: str) -> InputDevice:
        """Open a device.

        Args:
            path: One of paths().

        Raises:
            DeviceError: It is gone, or may not be read.
        """
        return KernelDevice(path)

    def problem(self) -> str:
        """Return why nothing can be read, and what helps; empty when something can."""
        if importlib.util.find_spec('evdev') is None:
            return MISSING
        folder = Path(self._folder)
        if not any(folder.glob('event*')):
            return f'{folder} has no devices: plug one in, or give the container --device {folder}'
        if not self.paths():
            return f'no device of {folder} may be read; {PERMISSION}'
        return ''


def _number(file: Path) -> int:
    digits = file.name.removeprefix('event')
    return int(digits) if digits.isdigit() else -1
