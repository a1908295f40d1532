# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Which code means what on which gamepad.

Sources: the kernel's Documentation/input/gamepad.rst; its drivers xpad (whose X is BTN_NORTH and
Y is BTN_WEST, against the specification), hid-playstation and hid-sony; for pads that no driver
knows, the order in which HID usages become BTN_TRIGGER and what follows (hid-input).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
import difflib
import re

from ..devices.events import DeviceInfo
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
    0x130: Button.SOUTH,
    0x131: Button.EAST,
    0x133: Button.NORTH,
    0x134: Button.WEST,
    0x136: Button.LEFT_SHOULDER,
    0x137: Button.RIGHT_SHOULDER,
    0x138: Button.LEFT_TRIGGER,
    0x139: Button.RIGHT_TRIGGER,
    0x13A: Button.SELECT,
    0x13B: Button.START,
    0x13C: Button.GUIDE,
    0x13D: Button.LEFT_STICK,
    0x13E: Button.RIGHT_STICK,
}
"""Buttons of the kernel's specification."""

XBOX_BUTTONS = STANDARD_BUTTONS | {0x133: Button.WEST, 0x134: Button.NORTH}
"""Buttons of the driver xpad, and of pads that imitate it."""

HID_BUTTONS = {
    BTN_JOYSTICK + index: button
    for index, button in enumerate(
        (
            Button.WEST,
            Button.SOUTH,
            Button.EAST,
            Button.NORTH,
            Button.LEFT_SHOULDER,
            Button.RIGHT_SHOULDER,
            Button.LEFT_TRIGGER,
            Button.RIGHT_TRIGGER,
            Button.SELECT,
            Button.START,
            Button.LEFT_STICK,
            Button.RIGHT_STICK,
            Button.GUIDE,
        )
    )
}
"""Buttons of pads without a driver, in the order that most of them have."""

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
        axes: Its axes by code; a stick's are reversed, the kernel counts down and right as up.
        buttons: Its buttons by code.
    """

    name: str
    names: re.Pattern[str]
    vendors: frozenset[int]
    axes: Mapping[int, Axis]
    buttons: Mapping[int, Button]

    def fits(self, info: DeviceInfo) -> bool:
        """Return whether a device is of this kind.

        Args:
            info: The device.
        """
        return info.vendor in self.vendors or self.names.search(info.name) is not None


PRESETS = (
    Preset(
        'xbox',
        re.compile(r'x-?box|x-input|xinput', re.IGNORECASE),
        frozenset({0x045E}),
        STANDARD_AXES,
        XBOX_BUTTONS,
    ),
    Preset(
        'ps',
        re.compile(r'playstation|dualshock|dualsense|sony', re.IGNORECASE),
        frozenset({0x054C}),
        STANDARD_AXES,
        STANDARD_BUTTONS,
    ),
    Preset(
        'generic',
        re.compile(''),
        frozenset(),
        HID_AXES,
        STANDARD_BUTTONS | HID_BUTTONS,
    ),
)
"""All presets, the first that fits is used."""

AUTO = 'auto'
"""Name that means: whichever fits the device."""


def is_gamepad(info: DeviceInfo) -> bool:
    """Return whether a device is a gamepad or joystick, not a keyboard, mouse or tilt sensor.

    Args:
        info: The device.
    """
    buttons = {BTN_SOUTH, *range(BTN_JOYSTICK, BTN_JOYSTICK + 4)} & info.keys
    return bool(buttons) and {ABS_X, ABS_Y} <= info.axes.keys()


def choose_preset(name: str, info: DeviceInfo) -> Preset:
    """Choose the preset of a device.

    Args:
        name: Name of a preset, or :data:`AUTO`.
        info: The device. One that has a stick on ABS_RX is no self-describing one.

    Raises:
        PresetError: There is no preset of that name.
    """
    preset = next(each for each in PRESETS if each.fits(info)) if name == AUTO else _named(name)
    axes = STANDARD_AXES if {ABS_RX, ABS_RY} <= info.axes.keys() else HID_AXES
    # a pad by Bluetooth without its driver has the buttons of its kind, but axes of its own
    return Preset(preset.name, preset.names, preset.vendors, axes, preset.buttons)


def check_preset(name: str) -> None:
    """Refuse a name that is no preset.

    Args:
        name: Name of a preset, or :data:`AUTO`.

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
