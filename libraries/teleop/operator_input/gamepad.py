# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Gamepads: vendor-independent names, deadman buttons, and the meaning of each code.

Sources of the presets: the kernel's Documentation/input/gamepad.rst; its drivers xpad (whose X
is BTN_NORTH and Y is BTN_WEST, against the specification), hid-playstation and hid-sony; for pads
that no driver knows, the order in which HID usages become BTN_TRIGGER and on (hid-input).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
import contextlib
from dataclasses import dataclass, field, replace
import difflib
from enum import Enum
import math
import re
import select
import time
from typing import NamedTuple

from .devices import (
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
from .exceptions import DeviceError, PresetError, SettingError


class Axis(Enum):
    """An axis; up and left are +1, as in REP 103, rest is 0. A trigger goes from 0 to 1."""

    LEFT_X = 'left stick, left'
    LEFT_Y = 'left stick, up'
    RIGHT_X = 'right stick, left'
    RIGHT_Y = 'right stick, up'
    LEFT_TRIGGER = 'left trigger'
    RIGHT_TRIGGER = 'right trigger'
    DPAD_X = 'd-pad, left'
    DPAD_Y = 'd-pad, up'

    @property
    def is_trigger(self) -> bool:
        """Whether the axis rests at its end, not in its middle."""
        return self in {Axis.LEFT_TRIGGER, Axis.RIGHT_TRIGGER}


class Button(Enum):
    """A button, by its place: south is A of an Xbox pad and the cross of a PlayStation one."""

    SOUTH = 'south'
    EAST = 'east'
    WEST = 'west'
    NORTH = 'north'
    LEFT_SHOULDER = 'left_shoulder'
    RIGHT_SHOULDER = 'right_shoulder'
    LEFT_TRIGGER = 'left_trigger'
    RIGHT_TRIGGER = 'right_trigger'
    SELECT = 'select'
    START = 'start'
    GUIDE = 'guide'
    LEFT_STICK = 'left_stick'
    RIGHT_STICK = 'right_stick'


FULL_DEFLECTION = 0.95  # way of a stick or trigger at which it may lean against its end
TRIGGER_PRESSED = 0.5  # way of a trigger that counts as pressed
STICKS = (Axis.LEFT_X, Axis.LEFT_Y), (Axis.RIGHT_X, Axis.RIGHT_Y)
TRIGGERS = {
    Button.LEFT_TRIGGER: Axis.LEFT_TRIGGER,
    Button.RIGHT_TRIGGER: Axis.RIGHT_TRIGGER,
}


@dataclass(frozen=True, slots=True)
class GamepadState:
    """State of all axes and buttons at one moment."""

    # positions from -1 to 1, triggers from 0; an axis that is not there is not in it
    axes: Mapping[Axis, float] = field(default_factory=dict)
    buttons: frozenset[Button] = frozenset()  # what is pressed
    # how many changes the device has reported, those within a dead zone too: a sign of life.
    # States are equal whatever it is.
    changes: int = field(default=0, compare=False)

    def axis(self, axis: Axis) -> float:
        """Return the position of an axis; 0 if the gamepad does not have it."""
        return self.axes.get(axis, 0.0)

    def is_pressed(self, button: Button) -> bool:
        """Return whether a button is pressed; a trigger is when beyond the middle of its axis."""
        trigger = TRIGGERS.get(button)
        return button in self.buttons or (
            trigger is not None and self.axis(trigger) > TRIGGER_PRESSED
        )

    @property
    def at_full_deflection(self) -> bool:
        """Whether every deflected stick and trigger is at its end.

        At the end a hand may be perfectly still; anywhere else it trembles.
        """
        ways = [
            *(math.hypot(self.axis(x), self.axis(y)) for x, y in STICKS),
            *(self.axis(trigger) for trigger in TRIGGERS.values()),
        ]
        return all(way == 0.0 or way >= FULL_DEFLECTION for way in ways)

    def pressed_since(self, before: GamepadState) -> frozenset[Button]:
        """Return the buttons that went down since an earlier state."""
        return self.buttons - before.buttons


AT_REST = GamepadState()  # nothing is touched

DEADMAN_BUTTONS: Mapping[str, Button | None] = {
    **{button.value: button for button in Button},
    'none': None,
}
"""Choices for a deadman button, by name."""


class Grip(Enum):
    """Motion that the operator permits."""

    RELEASED = 'released'
    HELD = 'held'
    TURBO = 'turbo'


class Timeout(NamedTuple):
    """How long [s] something may last, and the parameter that sets it."""

    parameter: str
    duration: float


@dataclass(frozen=True, slots=True)
class Deadman:
    """Deadman buttons that permit motion, and time-outs for a gamepad without any change.

    Raises:
        SettingError: The second time is shorter than the first.
    """

    # must be held for any motion; None when none is needed
    enable: Button | None = Button.LEFT_SHOULDER
    # held too, or alone: fast; None for no such button
    turbo: Button | None = Button.RIGHT_SHOULDER
    # time without any change of the gamepad [s] after which a motion ends: receivers of wireless
    # ones repeat the last state when the pad is out of reach or its battery empty
    timeout: float = 3.0
    # the same while what is deflected leans against its end, where a pad in a hand has nothing to
    # report either [s]
    full_deflection_timeout: float = 10.0

    def __post_init__(self) -> None:
        if self.full_deflection_timeout < self.timeout:
            raise SettingError(
                f'deadman_full_deflection_timeout is {self.full_deflection_timeout:g}: it must be '
                f'at least deadman_timeout, {self.timeout:g}; raise it, or lower deadman_timeout'
            )

    def grip(self, state: GamepadState) -> Grip:
        """Return the motion that the operator permits."""
        if self.turbo is not None and state.is_pressed(self.turbo):
            return Grip.TURBO
        if self.enable is None or state.is_pressed(self.enable):
            return Grip.HELD
        return Grip.RELEASED

    def timeout_at(self, state: GamepadState) -> Timeout:
        """Return how long a gamepad may report no change during a motion."""
        if state.at_full_deflection:
            return Timeout('deadman_full_deflection_timeout', self.full_deflection_timeout)
        return Timeout('deadman_timeout', self.timeout)


ABS_X, ABS_Y, ABS_Z, ABS_RX, ABS_RY, ABS_RZ = range(6)
ABS_GAS, ABS_BRAKE = 0x09, 0x0A
ABS_HAT0X, ABS_HAT0Y = 0x10, 0x11
BTN_JOYSTICK, BTN_SOUTH = 0x120, 0x130

_LEFT_STICK_AND_DPAD = {
    ABS_X: Axis.LEFT_X,
    ABS_Y: Axis.LEFT_Y,
    ABS_HAT0X: Axis.DPAD_X,
    ABS_HAT0Y: Axis.DPAD_Y,
}
STANDARD_AXES = _LEFT_STICK_AND_DPAD | {
    ABS_RX: Axis.RIGHT_X,
    ABS_RY: Axis.RIGHT_Y,
    ABS_Z: Axis.LEFT_TRIGGER,
    ABS_RZ: Axis.RIGHT_TRIGGER,
}
"""Axes by the kernel's specification."""

HID_AXES = _LEFT_STICK_AND_DPAD | {
    ABS_Z: Axis.RIGHT_X,
    ABS_RZ: Axis.RIGHT_Y,
    ABS_BRAKE: Axis.LEFT_TRIGGER,
    ABS_GAS: Axis.RIGHT_TRIGGER,
}
"""Axes of a pad that describes itself (HID usages Z and Rz, Brake and Accelerator)."""

STANDARD_BUTTONS = {
    0x130: Button.SOUTH, 0x131: Button.EAST, 0x133: Button.NORTH, 0x134: Button.WEST,
    0x136: Button.LEFT_SHOULDER, 0x137: Button.RIGHT_SHOULDER,
    0x138: Button.LEFT_TRIGGER, 0x139: Button.RIGHT_TRIGGER,
    0x13A: Button.SELECT, 0x13B: Button.START, 0x13C: Button.GUIDE,
    0x13D: Button.LEFT_STICK, 0x13E: Button.RIGHT_STICK,
}  # fmt: skip
"""Buttons by the kernel's specification."""

XBOX_BUTTONS = STANDARD_BUTTONS | {0x133: Button.WEST, 0x134: Button.NORTH}
"""Buttons of the driver xpad, and of pads that imitate it."""

HID_BUTTONS = {
    0x120: Button.WEST, 0x121: Button.SOUTH, 0x122: Button.EAST, 0x123: Button.NORTH,
    0x124: Button.LEFT_SHOULDER, 0x125: Button.RIGHT_SHOULDER,
    0x126: Button.LEFT_TRIGGER, 0x127: Button.RIGHT_TRIGGER,
    0x128: Button.SELECT, 0x129: Button.START,
    0x12A: Button.LEFT_STICK, 0x12B: Button.RIGHT_STICK, 0x12C: Button.GUIDE,
}  # fmt: skip
"""Buttons of pads without a driver, from BTN_JOYSTICK in the order that most of them have."""

DPAD_BUTTONS = {
    0x220: (Axis.DPAD_Y, 1.0),
    0x221: (Axis.DPAD_Y, -1.0),
    0x222: (Axis.DPAD_X, 1.0),
    0x223: (Axis.DPAD_X, -1.0),
}
"""Axis and direction of d-pad buttons, on pads that have four buttons for it."""


@dataclass(frozen=True, slots=True)
class Preset:
    """The codes of a kind of gamepad."""

    name: str  # what the user calls it
    names: re.Pattern[str]  # expression for names of such devices
    vendors: frozenset[int]  # USB vendor ids of such devices
    buttons: Mapping[int, Button]  # its buttons by code
    # its axes by code; a stick's are reversed, the kernel counts down and right as up
    axes: Mapping[int, Axis]

    def fits(self, info: DeviceInfo) -> bool:
        """Return whether the preset fits a device."""
        return info.vendor in self.vendors or self.names.search(info.name) is not None


def _preset(name: str, names: str, vendors: set[int], buttons: Mapping[int, Button]) -> Preset:
    expression = re.compile(names, re.IGNORECASE)
    return Preset(name, expression, frozenset(vendors), buttons, STANDARD_AXES)


PRESETS = (
    _preset('xbox', 'x-?box|x-input|xinput', {0x045E}, XBOX_BUTTONS),
    _preset('ps', 'playstation|dualshock|dualsense|sony', {0x054C}, STANDARD_BUTTONS),
    _preset('generic', '', set(), STANDARD_BUTTONS | HID_BUTTONS),
)
"""All presets; the first that fits is used."""

AUTO = 'auto'  # name that means: whichever fits the device


def is_gamepad(info: DeviceInfo) -> bool:
    """Return whether a device is a gamepad or joystick, not a keyboard, mouse or tilt sensor."""
    buttons = {BTN_SOUTH, *range(BTN_JOYSTICK, BTN_JOYSTICK + 4)} & info.keys
    return bool(buttons) and {ABS_X, ABS_Y} <= info.axes.keys()


def choose_preset(name: str, info: DeviceInfo) -> Preset:
    """Choose the preset of a device, by its name or by :data:`AUTO`.

    A device with a stick on ABS_RX does not get the preset for self-describing pads.

    Raises:
        PresetError: There is no preset of that name.
    """
    preset = next(each for each in PRESETS if each.fits(info)) if name == AUTO else _named(name)
    has_standard_axes = {ABS_RX, ABS_RY} <= info.axes.keys()
    # a pad by Bluetooth without its driver has the buttons of its kind, but axes of its own
    return replace(preset, axes=STANDARD_AXES if has_standard_axes else HID_AXES)


def _named(name: str) -> Preset:
    for preset in PRESETS:
        if preset.name == name:
            return preset
    names = [AUTO, *(preset.name for preset in PRESETS)]
    close = difflib.get_close_matches(name, names, n=1)
    hint = f'; did you mean {close[0]!r}?' if close else ''
    raise PresetError(f'there is no gamepad preset {name!r}{hint} There are: {", ".join(names)}')


SCAN_PERIOD = 1.0  # [s] between two looks for a gamepad when there is none
OTHERS_PERIOD = 10.0  # [s] for which a device that is no gamepad is not opened again


class Gamepad(contextlib.AbstractContextManager['Gamepad']):
    """Reads the first gamepad that fits; when it is unplugged, all axes and buttons are at rest.

    A context manager that closes it. Times are in [s].
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
        """Start without a gamepad; the first scan() opens one.

        Args:
            devices: Where to search; None for the devices of this machine.
            preset: Name of a preset, or ``auto``.
            device: Path of a device, or regular expression for its name; empty for any.
            dead_zone: Fraction of the travel around the middle that counts as rest.
            log: Called with a message when a gamepad is connected or lost.
            warn: Called with the reason when the first scan finds none.

        Raises:
            PresetError: There is no preset of that name, or the expression is malformed.
            ValueError: The dead zone is no fraction.
        """
        if preset != AUTO:
            _named(preset)
        if not 0 <= dead_zone < 1:
            raise ValueError(f'dead zone {dead_zone}: wanted 0 to below 1')
        try:
            self._wanted = re.compile(device)
        except re.error as error:
            raise PresetError(
                f'device {device!r} is neither a path nor an expression: {error}'
            ) from None
        self.name = ''  # what the device calls itself and its preset; empty when there is none
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
        """Whether a gamepad is connected."""
        return self._device is not None

    @property
    def state(self) -> GamepadState:
        """Current state; at rest without a gamepad."""
        return self._reading.state() if self._reading is not None else AT_REST

    def scan(self, now: float) -> None:
        """Search for a gamepad if there is none and a scan is due."""
        if self._device is None:
            for device in self._search.found(now, lambda path: self._path not in {'', path}):
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
        """Read pending reports, without waiting.

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

    Axes are scaled by the range that the device reports; values in the dead zone are 0, and values
    beyond it start from 0, without a jump.
    """

    def __init__(self, info: DeviceInfo, preset: Preset, dead_zone: float) -> None:
        """Start at rest; the dead zone is the fraction of the travel that counts as rest."""
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
        axis: The axis; a trigger rests at its minimum, all others in the middle.
        span: Its range, as the device reports it.
        value: Reported value in [device units].
        dead_zone: Fraction of the travel that counts as rest.

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
