# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a gamepad has, in names that do not depend on its maker; and what its person allows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
import math
from typing import NamedTuple

from ..exceptions import SettingError


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
        """Whether it rests at its end, not in its middle."""
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
    """Where everything is at one moment.

    Attributes:
        axes: Positions from -1 to 1, triggers from 0; an axis that is not there is not in it.
        buttons: What is pressed.
        changes: How many changes the device has reported, those within a dead zone too: a sign of
            life. States are equal whatever it is.
    """

    axes: Mapping[Axis, float] = field(default_factory=dict)
    buttons: frozenset[Button] = frozenset()
    changes: int = field(default=0, compare=False)

    def axis(self, axis: Axis) -> float:
        """Return the position of an axis; 0 if the gamepad has none such."""
        return self.axes.get(axis, 0.0)

    def is_pressed(self, button: Button) -> bool:
        """Return whether a button is pressed; a trigger is, too, beyond the middle of its axis."""
        trigger = TRIGGERS.get(button)
        return button in self.buttons or (
            trigger is not None and self.axis(trigger) > TRIGGER_PRESSED
        )

    @property
    def at_full_deflection(self) -> bool:
        """Whether every stick and trigger that is deflected at all is so to its end.

        There a living hand need not change anything; between, it trembles.
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
"""What may be chosen for a button of a deadman, by its name."""


class Grip(Enum):
    """What the person allows."""

    RELEASED = 'released'
    HELD = 'held'
    TURBO = 'turbo'


class Timeout(NamedTuple):
    """How long [s] something may last, and the parameter that sets it."""

    parameter: str
    duration: float


@dataclass(frozen=True, slots=True)
class Deadman:
    """Which buttons allow motion, and for how long a pad may be without any change.

    Attributes:
        enable: Must be held for any motion; None when none is needed.
        turbo: Held too, or alone: fast; None for no such button.
        timeout: Time without any change of the gamepad [s] after which a motion ends: receivers of
            wireless ones repeat the last state when the pad is out of reach or its battery empty.
        full_deflection_timeout: The same while what is deflected leans against its end, where a
            pad in a hand has nothing to report either [s].

    Raises:
        SettingError: The second time is shorter than the first.
    """

    enable: Button | None = Button.LEFT_SHOULDER
    turbo: Button | None = Button.RIGHT_SHOULDER
    timeout: float = 3.0
    full_deflection_timeout: float = 10.0

    def __post_init__(self) -> None:
        if self.full_deflection_timeout < self.timeout:
            raise SettingError(
                f'deadman_full_deflection_timeout is {self.full_deflection_timeout:g}: it must be '
                f'at least deadman_timeout, {self.timeout:g}; raise it, or lower deadman_timeout'
            )

    def grip(self, state: GamepadState) -> Grip:
        """Return what the person allows."""
        if self.turbo is not None and state.is_pressed(self.turbo):
            return Grip.TURBO
        if self.enable is None or state.is_pressed(self.enable):
            return Grip.HELD
        return Grip.RELEASED

    def timeout_at(self, state: GamepadState) -> Timeout:
        """Return for how long a gamepad may report no change while it moves something."""
        if state.at_full_deflection:
            return Timeout('deadman_full_deflection_timeout', self.full_deflection_timeout)
        return Timeout('deadman_timeout', self.timeout)
