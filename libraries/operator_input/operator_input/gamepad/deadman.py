# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The button without which nothing moves, and a pad that may have lost its person."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum

from ..exceptions import SettingError
from .controls import Axis, Button, GamepadState

DEADMAN_BUTTONS: Mapping[str, Button | None] = {
    **{button.value: button for button in Button},
    'none': None,
}
"""What may be chosen for a button of a deadman, by its name."""

TRIGGER_PRESSED = 0.5  # way of a trigger that counts as pressed


class Grip(Enum):
    """What the person allows."""

    RELEASED = 'released'
    HELD = 'held'
    TURBO = 'turbo'


@dataclass(frozen=True, slots=True)
class Timeout:
    """How long something may last.

    Attributes:
        parameter: Name of its parameter.
        duration: Time [s].
    """

    parameter: str
    duration: float


@dataclass(frozen=True, slots=True)
class Deadman:
    """Which buttons allow motion.

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
        """Return what the person allows.

        Args:
            state: The gamepad.
        """
        if self.turbo is not None and is_pressed(self.turbo, state):
            return Grip.TURBO
        if self.enable is None or is_pressed(self.enable, state):
            return Grip.HELD
        return Grip.RELEASED

    def timeout_at(self, state: GamepadState) -> Timeout:
        """Return for how long a gamepad may report no change while it moves something."""
        if state.at_full_deflection:
            return Timeout('deadman_full_deflection_timeout', self.full_deflection_timeout)
        return Timeout('deadman_timeout', self.timeout)


def is_pressed(button: Button, state: GamepadState) -> bool:
    """Return whether a button is pressed; a trigger is, too, when its axis is beyond the middle.

    Args:
        button: Which.
        state: The gamepad.
    """
    if button in state.buttons:
        return True
    if button is Button.LEFT_TRIGGER:
        return state.axis(Axis.LEFT_TRIGGER) > TRIGGER_PRESSED
    if button is Button.RIGHT_TRIGGER:
        return state.axis(Axis.RIGHT_TRIGGER) > TRIGGER_PRESSED
    return False
