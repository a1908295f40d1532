# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Reads input devices of the kernel by the package evdev.

Codes: include/uapi/linux/input-event-codes.h.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
import contextlib
from dataclasses import dataclass
import importlib.util
import os
from pathlib import Path
from typing import Any, NamedTuple

from .exceptions import DeviceError

EV_SYN, EV_KEY, EV_ABS = 0x00, 0x01, 0x03
SYN_REPORT, SYN_DROPPED = 0, 3

FOLDER = '/dev/input'
MISSING = 'the Python package evdev is missing: sudo apt-get install python3-evdev'
PERMISSION = (
    'members of the group input may read it (sudo usermod -aG input $USER, then log in again)'
)


class InputEvent(NamedTuple):
    """One event; the value is 0 up, 1 down, 2 repeated, or a position in [device units]."""

    type: int
    code: int
    value: int


class AxisRange(NamedTuple):
    """Range of an axis in [device units]; values within ``flat`` of the middle mean rest."""

    minimum: int
    maximum: int
    flat: int = 0


@dataclass(frozen=True, slots=True)
class DeviceInfo:
    """Identity of a device: its file, its own name, its USB or Bluetooth vendor."""

    path: str
    name: str
    vendor: int
    keys: frozenset[int]  # codes of its keys and buttons
    axes: Mapping[int, AxisRange]  # its axes by code


@dataclass(frozen=True, slots=True)
class DeviceState:
    """The pressed codes, and the position of each axis by its code in [device units]."""

    keys: frozenset[int]
    axes: Mapping[int, int]


class InputDevice:
    """An open file of /dev/input."""

    def __init__(self, path: str) -> None:
        """Open it.

        Raises:
            DeviceError: The device is gone or not readable, or the package evdev is missing.
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
        # what it is
        self.info = DeviceInfo(
            path=path,
            name=self._device.name,
            vendor=self._device.info.vendor,
            keys=frozenset(capabilities.get(EV_KEY, [])),
            axes={code: AxisRange(info.min, info.max, info.flat) for code, info in axes},
        )

    def fileno(self) -> int:
        """Return the file descriptor to wait for."""
        return self._device.fd

    def read(self) -> Iterable[InputEvent]:
        """Return pending events, without waiting.

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
            axes = {code: self._device.absinfo(code).value for code in self.info.axes}
            return DeviceState(frozenset(self._device.active_keys()), axes)
        except OSError as error:
            raise self._gone(error) from None

    def close(self) -> None:
        """Close the device; an unplugged one is no error."""
        with contextlib.suppress(OSError):
            self._device.close()

    def _gone(self, error: OSError) -> DeviceError:
        return DeviceError(f'{self.info.name} ({self.info.path}) is gone: {error.strerror}')


class InputDevices:
    """All input devices of this machine that the user may read."""

    def __init__(self, folder: str = FOLDER) -> None:
        self._folder = folder

    def paths(self) -> list[str]:
        """Return the files of the devices that the user may read."""
        files = sorted(Path(self._folder).glob('event*'), key=_number)
        return [str(file) for file in files if os.access(file, os.R_OK)]

    def open(self, path: str) -> InputDevice:
        """Open a device of paths().

        Raises:
            DeviceError: The device is gone or not readable.
        """
        return InputDevice(path)

    def problem(self) -> str:
        """Return why no device is readable, and the remedy; empty if one is."""
        if importlib.util.find_spec('evdev') is None:
            return MISSING
        folder = Path(self._folder)
        if not any(folder.glob('event*')):
            return f'{folder} has no devices: plug one in, or give the container --device {folder}'
        if not self.paths():
            return f'no device of {folder} may be read; {PERMISSION}'
        return ''


class DeviceSearch:
    """Searches periodically for plugged-in devices of one kind. Times are in [s]."""

    def __init__(
        self,
        devices: InputDevices,
        fits: Callable[[DeviceInfo], bool],
        period: float,
        others_period: float,
    ) -> None:
        """Scan once a period; open devices that do not fit less often, as that wakes them."""
        self._devices = devices
        self._fits = fits
        self._period = period
        self._others_period = others_period
        self._others: dict[str, float] = {}  # until when a path is passed over
        self._next = float('-inf')

    def found(self, now: float, skip: Callable[[str], bool]) -> Iterator[InputDevice]:
        """Open the devices that fit, except skipped paths, if a scan is due."""
        if now < self._next:
            return
        self._next = now + self._period
        for path in self._devices.paths():
            if skip(path) or now < self._others.get(path, now):
                continue
            with contextlib.suppress(DeviceError):
                device = self._devices.open(path)
                if self._fits(device.info):
                    yield device
                else:
                    self._others[path] = now + self._others_period
                    device.close()


def _number(file: Path) -> int:
    digits = file.name.removeprefix('event')
    return int(digits) if digits.isdigit() else -1
