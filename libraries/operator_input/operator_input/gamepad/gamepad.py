# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A gamepad that may be plugged in and out at any time."""

from __future__ import annotations

from collections.abc import Callable
import contextlib
import re

from ..devices.events import EV_SYN, InputDevice, InputDevices, SYN_DROPPED
from ..exceptions import DeviceError, PresetError
from .controls import AT_REST, GamepadState
from .presets import AUTO, check_preset, choose_preset, is_gamepad
from .reading import GamepadReading

SCAN_PERIOD = 1.0  # [s] between two looks for a gamepad when there is none
OTHERS_PERIOD = 10.0  # [s] for which a device that is no gamepad is not opened again


class Gamepad:
    """Reads the first gamepad that fits; when it is unplugged, all is at rest.

    Attributes:
        name: What the device calls itself and its preset; empty when there is none.
    """

    def __init__(
        self,
        devices: InputDevices,
        *,
        preset: str = AUTO,
        device: str = '',
        dead_zone: float = 0.05,
        log: Callable[[str], None] = lambda _: None,
    ) -> None:
        """Start without one; the first scan() opens it.

        Args:
            devices: Where to look.
            preset: Name of a preset, or ``auto``.
            device: Path of a device, or expression that its name has to match; empty for any.
            dead_zone: Share of the way about the middle that counts as rest.
            log: Called with a message when a gamepad comes and goes.

        Raises:
            PresetError: There is no preset of that name, or the expression is none.
            ValueError: The dead zone is no share.
        """
        check_preset(preset)
        if not 0 <= dead_zone < 1:
            raise ValueError(f'dead zone {dead_zone}: wanted 0 to below 1')
        try:
            self._wanted = re.compile(device)
        except re.error as error:
            raise PresetError(
                f'device {device!r} is neither a path nor an expression: {error}'
            ) from None
        self.name = ''
        self._path = device if device.startswith('/') else ''
        self._devices = devices
        self._preset = preset
        self._dead_zone = dead_zone
        self._log = log
        self._device: InputDevice | None = None
        self._reading: GamepadReading | None = None
        self._next_scan = float('-inf')
        self._others: dict[str, float] = {}  # until when [s] a path is passed over

    @property
    def is_connected(self) -> bool:
        """Whether there is a gamepad."""
        return self._device is not None

    @property
    def state(self) -> GamepadState:
        """Where everything is; at rest without a gamepad."""
        return self._reading.state() if self._reading is not None else AT_REST

    def filenos(self) -> list[int]:
        """Return what to wait for; empty without a gamepad."""
        return [self._device.fileno()] if self._device is not None else []

    def scan(self, now: float) -> None:
        """Look for a gamepad if there is none and it is time to.

        Args:
            now: Time [s].
        """
        if self._device is not None or now < self._next_scan:
            return
        self._next_scan = now + SCAN_PERIOD
        for path in self._devices.paths():
            if (self._path and path != self._path) or now < self._others.get(path, now):
                continue
            with contextlib.suppress(DeviceError):
                device = self._devices.open(path)
                if self._use(device):
                    return
                device.close()
                self._others[path] = now + OTHERS_PERIOD  # opening wakes a sleeping device

    def read(self) -> list[GamepadState]:
        """Read what has come, without waiting.

        Returns:
            The state after each report of the device, so that no short press is missed; a last one
            at rest if it was unplugged.
        """
        if self._device is None or self._reading is None:
            return []
        states = []
        try:
            for event in self._device.read():
                if event.type != EV_SYN:
                    self._reading.feed(event)
                    continue
                if event.code == SYN_DROPPED:
                    self._reading.reset(self._device.state())
                states.append(self._reading.state())
        except DeviceError as error:
            self._lose(str(error))
            states.append(AT_REST)
        return states

    def close(self) -> None:
        """Close the device."""
        if self._device is not None:
            self._device.close()
        self._device, self._reading, self.name = None, None, ''

    def _use(self, device: InputDevice) -> bool:
        info = device.info
        if not is_gamepad(info) or not (self._path or self._wanted.search(info.name)):
            return False
        preset = choose_preset(self._preset, info)
        reading = GamepadReading(info, preset, self._dead_zone)
        reading.reset(device.state())
        self._device, self._reading = device, reading
        self.name = f'{info.name} ({preset.name})'
        self._log(f'gamepad: {info.name}, preset {preset.name}, {info.path}')
        return True

    def _lose(self, reason: str) -> None:
        self.close()
        self._log(f'{reason}; everything counts as released, waiting for a gamepad')
