# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Input devices of tests: they make the same events as the kernel, when the test says so."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
import os

from operator_input import DeviceError
from operator_input.devices import (
    AxisRange,
    DeviceInfo,
    DeviceState,
    EV_ABS,
    EV_KEY,
    EV_SYN,
    InputDevice,
    InputDevices,
    InputEvent,
    SYN_DROPPED,
    SYN_REPORT,
)

STICK, TRIGGER, HAT = AxisRange(-32768, 32767), AxisRange(0, 255), AxisRange(-1, 1)
BYTE_STICK = AxisRange(0, 255)


class InjectedDevice(InputDevice):
    """A device whose events a test makes; each of its methods is one report."""

    def __init__(
        self,
        name: str,
        keys: Iterable[int],
        axes: Mapping[int, AxisRange] | None = None,
        *,
        vendor: int = 0,
        path: str = '/dev/input/event7',
    ) -> None:
        self.info = DeviceInfo(path, name, vendor, frozenset(keys), dict(axes or {}))
        self.keys: set[int] = set()
        self.axes = {
            code: 0
            if span.minimum == 0 and span is TRIGGER
            else (span.minimum + span.maximum + 1) // 2
            for code, span in self.info.axes.items()
        }
        self.is_closed = False
        self._is_gone = False
        self._events: list[InputEvent] = []
        self._readable, self._writable = os.pipe()

    def report(self, *events: InputEvent) -> None:
        """Make one report of the device."""
        self._events += [*events, InputEvent(EV_SYN, SYN_REPORT, 0)]
        os.write(self._writable, b'.')

    def press(self, code: int) -> None:
        """Press a key or button."""
        self.keys.add(code)
        self.report(InputEvent(EV_KEY, code, 1))

    def release(self, code: int) -> None:
        """Release a key or button."""
        self.keys.discard(code)
        self.report(InputEvent(EV_KEY, code, 0))

    def move(self, code: int, value: int) -> None:
        """Move an axis."""
        self.axes[code] = value
        self.report(InputEvent(EV_ABS, code, value))

    def drop_events(self) -> None:
        """Lose what was not read yet, as the kernel does when its buffer is full."""
        self._events = []
        self.report(InputEvent(EV_SYN, SYN_DROPPED, 0))

    def unplug(self) -> None:
        """Pull the plug."""
        self._is_gone = True
        os.write(self._writable, b'.')

    def fileno(self) -> int:
        """Return what to wait for."""
        return self._readable

    def read(self) -> Iterable[InputEvent]:
        """Return the events that have come."""
        if self._is_gone:
            raise DeviceError(f'{self.info.name} is gone')
        events, self._events = self._events, []
        if events:
            os.read(self._readable, 4096)
        return events

    def state(self) -> DeviceState:
        """Return its present state."""
        return DeviceState(frozenset(self.keys), dict(self.axes))

    def close(self) -> None:
        """Close it."""
        self.is_closed = True


def xbox_pad() -> InjectedDevice:
    """Make a pad with two sticks and a d-pad, as the driver xpad offers it."""
    axes = dict.fromkeys((0, 1, 3, 4), STICK) | dict.fromkeys((0x10, 0x11), HAT)
    return InjectedDevice('Xbox Wireless Controller', range(0x130, 0x13F), axes, vendor=0x045E)


class InjectedDevices(InputDevices):
    """The machine's devices; a test plugs them in and out."""

    def __init__(self, *devices: InjectedDevice) -> None:
        super().__init__()
        self.plugged = list(devices)

    def paths(self) -> list[str]:
        """Return the files of the devices."""
        return [device.info.path for device in self.plugged]

    def open(self, path: str) -> InputDevice:
        """Open a device."""
        for device in self.plugged:
            if device.info.path == path:
                return device
        raise DeviceError(f'{path} is gone')
