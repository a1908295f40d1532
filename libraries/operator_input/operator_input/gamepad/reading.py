# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""From the events of a gamepad to its state; pure."""

from __future__ import annotations

from ..devices.events import AxisRange, DeviceInfo, DeviceState, EV_ABS, EV_KEY, InputEvent
from .controls import Axis, Button, GamepadState
from .presets import DPAD_BUTTONS, Preset


class GamepadReading:
    """Keeps the state of one gamepad.

    Axes are scaled by the range that the device names; what is within the dead zone is 0, and
    beyond it they begin at 0 again, without a jump.
    """

    def __init__(self, info: DeviceInfo, preset: Preset, dead_zone: float) -> None:
        """Start at rest.

        Args:
            info: The device.
            preset: What its codes mean.
            dead_zone: Share of the way about the middle that counts as rest, 0 to below 1.

        Raises:
            ValueError: The dead zone is no such share.
        """
        if not 0 <= dead_zone < 1:
            raise ValueError(f'dead zone {dead_zone}: wanted 0 to below 1')
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
        """Take an event of the kernel.

        Args:
            event: Any; what the preset does not know is passed over.
        """
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
        """Take the whole state, as at the start and after events were lost.

        Args:
            state: As the device reports it.
        """
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
