# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Which code means what on which gamepad.

Sources: the kernel's Documentation/input/gamepad.rst; its drivers xpad (whose X is BTN_NORTH and
Y is BTN_WEST, against the specification), hid-playstation and hid-sony; for pads that no driver
knows, the order in which HID usages become BTN_TRIGGER and what follows (hid-input).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
import difflib
import re

from ..devices import DeviceInfo
from ..exceptions import PresetError
from .controls import Axis, Button

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
"""Axes of the kernel's specification."""

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
"""Buttons of the kernel's specification."""

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
"""Buttons of pads that have four of them for the d-pad: the axis and the side that they mean."""


@dataclass(frozen=True, slots=True)
class Preset:
    """The codes of a kind of gamepad.

    Attributes:
        name: What the user calls it.
        names: Expression for names of such devices.
        vendors: USB vendor ids of such devices.
        buttons: Its buttons by code.
        axes: Its axes by code; a stick's are reversed, the kernel counts down and right as up.
    """

    name: str
    names: re.Pattern[str]
    vendors: frozenset[int]
    buttons: Mapping[int, Button]
    axes: Mapping[int, Axis]

    def fits(self, info: DeviceInfo) -> bool:
        """Return whether a device is of this kind."""
        return info.vendor in self.vendors or self.names.search(info.name) is not None


def _preset(name: str, names: str, vendors: set[int], buttons: Mapping[int, Button]) -> Preset:
    expression = re.compile(names, re.IGNORECASE)
    return Preset(name, expression, frozenset(vendors), buttons, STANDARD_AXES)


PRESETS = (
    _preset('xbox', 'x-?box|x-input|xinput', {0x045E}, XBOX_BUTTONS),
    _preset('ps', 'playstation|dualshock|dualsense|sony', {0x054C}, STANDARD_BUTTONS),
    _preset('generic', '', set(), STANDARD_BUTTONS | HID_BUTTONS),
)
"""All presets, the first that fits is used."""

AUTO = 'auto'  # name that means: whichever fits the device


def is_gamepad(info: DeviceInfo) -> bool:
    """Return whether a device is a gamepad or joystick, not a keyboard, mouse or tilt sensor."""
    buttons = {BTN_SOUTH, *range(BTN_JOYSTICK, BTN_JOYSTICK + 4)} & info.keys
    return bool(buttons) and {ABS_X, ABS_Y} <= info.axes.keys()


def choose_preset(name: str, info: DeviceInfo) -> Preset:
    """Choose the preset of a device, by its name or by :data:`AUTO`.

    A device that has a stick on ABS_RX is no self-describing one.

    Raises:
        PresetError: There is no preset of that name.
    """
    preset = next(each for each in PRESETS if each.fits(info)) if name == AUTO else _named(name)
    has_standard_axes = {ABS_RX, ABS_RY} <= info.axes.keys()
    # a pad by Bluetooth without its driver has the buttons of its kind, but axes of its own
    return replace(preset, axes=STANDARD_AXES if has_standard_axes else HID_AXES)


def check_preset(name: str) -> None:
    """Refuse a name that is neither that of a preset nor :data:`AUTO`.

    Raises:
        PresetError: There is none of that name.
    """
    if name != AUTO:
        _named(name)


def _named(name: str) -> Preset:
    for preset in PRESETS:
        if preset.name == name:
            return preset
    names = [AUTO, *(preset.name for preset in PRESETS)]
    close = difflib.get_close_matches(name, names, n=1)
    hint = f'; did you mean {close[0]!r}?' if close else ''
    raise PresetError(f'there is no gamepad preset {name!r}{hint} There are: {", ".join(names)}')
