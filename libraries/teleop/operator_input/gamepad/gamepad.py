# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A gamepad that may be plugged in and out at any time."""

from __future__ import annotations

from collections.abc import Callable
import contextlib
import re
import select
import time

from ..devices import (
    AxisRange,
    DeviceInfo,
    DeviceSearch,
    DeviceState,
    EV_ABS,
    EV_KEY,
    EV_SYN,
    InputDevice,
    InputDevices,
    InputEvent,
    SYN_DROPPED,
)
from ..exceptions import DeviceError, PresetError
from .controls import AT_REST, Axis, Button, GamepadState
from .presets import AUTO, check_preset, choose_preset, DPAD_BUTTONS, is_gamepad, Preset

SCAN_PERIOD = 1.0  # [s] between two looks for a gamepad when there is none
OTHERS_PERIOD = 10.0  # [s] for which a device that is no gamepad is not opened again


class Gamepad(contextlib.AbstractContextManager['Gamepad']):
    """Reads the first gamepad that fits; when it is unplugged, all is at rest.

    A context manager that closes it. Times are in [s].

    Attributes:
        name: What the device calls itself and its preset; empty when there is none.
    """

    def __init__(
        self,
        devices: InputDevices | None = None,
        *,
        preset: str = AUTO,
        device: str = '',
        dead_zone: float = 0.05,
        log: Callable[[str], None] = lambda _: None,
        warn: Callable[[str], None] = lambda _: None,
    ) -> None:
        """Start without one; the first scan() opens it.

        Args:
            devices: Where to look; the devices of this machine when it is None.
            preset: Name of a preset, or ``auto``.
            device: Path of a device, or expression that its name has to match; empty for any.
            dead_zone: Share of the way about the middle that counts as rest.
            log: Called with a message when a gamepad comes and goes.
            warn: Called with the reason when the first scan finds none.

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
        self._devices = devices or InputDevices()
        self._search = DeviceSearch(self._devices, self._fits, SCAN_PERIOD, OTHERS_PERIOD)
        self._preset = preset
        self._dead_zone = dead_zone
        self._log, self._warn = log, warn
        self._is_first_scan = True
        self._device: InputDevice | None = None
        self._reading: GamepadReading | None = None

    @property
    def is_connected(self) -> bool:
        """Whether there is a gamepad."""
        return self._device is not None

    @property
    def state(self) -> GamepadState:
        """Where everything is; at rest without a gamepad."""
        return self._reading.state() if self._reading is not None else AT_REST

    def scan(self, now: float) -> None:
        """Search for a gamepad if there is none and a scan is due."""
        if self._device is None:
            for device in self._search.found(now, self._is_other_path):
                if self._use(device):
                    break
        if self._device is None and self._is_first_scan:
            problem = self._devices.problem() or 'plug one in, or switch it on'
            self._warn(f'no gamepad yet: {problem}')
        self._is_first_scan = False

    def wait(self, timeout: float) -> list[GamepadState]:
        """Search for a gamepad, wait for a change of its state, and read it."""
        self.scan(time.monotonic())
        waiting = [self._device] if self._device is not None else []
        select.select(waiting, [], [], timeout)
        return self.read()

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
            self.close()
            self._log(f'{error}; everything counts as released, waiting for a gamepad')
            states.append(AT_REST)
        return states

    def close(self) -> None:
        """Close the device."""
        if self._device is not None:
            self._device.close()
        self._device, self._reading, self.name = None, None, ''

    def __exit__(self, *_: object) -> None:
        """Close the device."""
        self.close()

    def _is_other_path(self, path: str) -> bool:
        return bool(self._path) and path != self._path

    def _fits(self, info: DeviceInfo) -> bool:
        return is_gamepad(info) and bool(self._path or self._wanted.search(info.name))

    def _use(self, device: InputDevice) -> bool:
        preset = choose_preset(self._preset, device.info)
        reading = GamepadReading(device.info, preset, self._dead_zone)
        with contextlib.suppress(DeviceError):
            reading.reset(device.state())
            self._device, self._reading = device, reading
            self.name = f'{device.info.name} ({preset.name})'
            self._log(f'gamepad: {device.info.name}, preset {preset.name}, {device.info.path}')
        return self.is_connected


class GamepadReading:
    """Keeps the state of one gamepad; pure.

    Axes are scaled by the range that the device names; what is within the dead zone is 0, and
    beyond it they begin at 0 again, without a jump.
    """

    def __init__(self, info: DeviceInfo, preset: Preset, dead_zone: float) -> None:
        """Start at rest; the dead zone is the share of the way that counts as rest."""
        self._preset = preset
        self._ranges = {code: info.axes[code] for code in preset.axes if code in info.axes}
        self._dead_zone = dead_zone
        self._axes = dict.fromkeys((preset.axes[code] for code in self._ranges), 0.0)
        self._buttons: set[Button] = set()
        self._keys = info.keys
        self._raw: dict[tuple[int, int], int] = {}  # newest value by type and code of the event
        self._changes = 0

    def state(self) -> GamepadState:
        """Return the present state."""
        return GamepadState(dict(self._axes), frozenset(self._buttons), self._changes)

    def feed(self, event: InputEvent) -> None:
        """Apply an event of the kernel; events that the preset does not know are ignored."""
        source = event.type, event.code
        self._changes += self._raw.get(source) != event.value
        self._raw[source] = event.value
        if event.type == EV_ABS:
            self._move(event.code, event.value)
        elif event.type == EV_KEY and event.code in DPAD_BUTTONS:
            axis, side = DPAD_BUTTONS[event.code]
            self._axes[axis] = side if event.value else 0.0
        elif event.type == EV_KEY and event.code in self._preset.buttons:
            button = self._preset.buttons[event.code]
            if event.value:
                self._buttons.add(button)
            else:
                self._buttons.discard(button)

    def reset(self, state: DeviceState) -> None:
        """Replace the whole state, as at the start and after events were lost."""
        self._buttons = {
            self._preset.buttons[code] for code in state.keys if code in self._preset.buttons
        }
        for code, value in state.axes.items():
            self._move(code, value)
        for code in DPAD_BUTTONS.keys() & self._keys:
            self.feed(InputEvent(EV_KEY, code, 0))
        for code in DPAD_BUTTONS.keys() & state.keys:
            self.feed(InputEvent(EV_KEY, code, 1))

    def _move(self, code: int, value: int) -> None:
        span = self._ranges.get(code)
        if span is not None:
            axis = self._preset.axes[code]
            self._axes[axis] = position(axis, span, value, self._dead_zone)


def position(axis: Axis, span: AxisRange, value: int, dead_zone: float) -> float:
    """Scale the value of an axis.

    Args:
        axis: Which; a trigger rests at its minimum, all others in the middle.
        span: Its range, as the device reports it.
        value: What it reports [device units].
        dead_zone: Share of the way that counts as rest.

    Returns:
        -1 to 1, up and left positive; 0 to 1 of a trigger.
    """
    width = span.maximum - span.minimum
    if width <= 0:
        return 0.0
    share = min(max((value - span.minimum) / width, 0.0), 1.0)
    way = share if axis.is_trigger else 1.0 - 2.0 * share
    rest = max(dead_zone, span.flat / (width if axis.is_trigger else width / 2))
    if abs(way) <= rest or rest >= 1.0:
        return 0.0
    return (abs(way) - rest) / (1.0 - rest) * (1.0 if way > 0 else -1.0)
