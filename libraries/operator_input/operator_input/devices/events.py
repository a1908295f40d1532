# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Input devices of the kernel (evdev), behind an interface that tests implement too.

Codes: include/uapi/linux/input-event-codes.h.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Protocol

EV_SYN, EV_KEY, EV_ABS = 0x00, 0x01, 0x03
SYN_REPORT, SYN_DROPPED = 0, 3


@dataclass(frozen=True, slots=True)
class InputEvent:
    """One event of the kernel.

    Attributes:
        type: EV_KEY, EV_ABS, ...
        code: Which key or axis.
        value: 0 up, 1 down, 2 repeated; or the position of an axis [device units].
    """

    type: int
    code: int
    value: int


@dataclass(frozen=True, slots=True)
class AxisRange:
    """Range and position of an axis, as the device reports them.

    Attributes:
        minimum: Smallest value [device units].
        maximum: Largest value [device units].
        flat: Values about the middle that mean rest [device units].
    """

    minimum: int
    maximum: int
    flat: int = 0


@dataclass(frozen=True, slots=True)
class DeviceInfo:
    """What a device is.

    Attributes:
        path: Its file.
        name: What it calls itself.
        vendor: USB or Bluetooth vendor id.
        product: Product id.
        keys: Codes of its keys and buttons.
        axes: Its axes by code.
    """

    path: str
    name: str
    vendor: int
    product: int
    keys: frozenset[int]
    axes: Mapping[int, AxisRange]


@dataclass(frozen=True, slots=True)
class DeviceState:
    """What is pressed and where the axes are.

    Attributes:
        keys: Codes of the keys and buttons that are down.
        axes: Position of each axis by code [device units].
    """

    keys: frozenset[int]
    axes: Mapping[int, int]


class InputDevice(Protocol):
    """An open device."""

    @property
    def info(self) -> DeviceInfo:
        """What it is."""

    def fileno(self) -> int:
        """Return what to wait for."""

    def read(self) -> Iterable[InputEvent]:
        """Return the events that have come, without waiting.

        Raises:
            DeviceError: It was unplugged.
        """

    def state(self) -> DeviceState:
        """Return its present state.

        Raises:
            DeviceError: It was unplugged.
        """

    def close(self) -> None:
        """Close it; further calls do nothing."""


class InputDevices(Protocol):
    """All devices of a machine."""

    def paths(self) -> list[str]:
        """Return the files of the devices that this user may read."""

    def open(self, path: str) -> InputDevice:
        """Open a device.

        Args:
            path: One of paths().

        Raises:
            DeviceError: It is gone, or may not be read.
        """
