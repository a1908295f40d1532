# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a gamepad has, in names that do not depend on its maker."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
import math


class Axis(Enum):
    """An axis; up and left are +1, as in REP 103, rest is 0."""

    LEFT_X = 'left stick, left'
    LEFT_Y = 'left stick, up'
    RIGHT_X = 'right stick, left'
    RIGHT_Y = 'right stick, up'
    LEFT_TRIGGER = 'left trigger'
    """From 0, rest, to 1."""
    RIGHT_TRIGGER = 'right trigger'
    """From 0, rest, to 1."""
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
STICKS = (Axis.LEFT_X, Axis.LEFT_Y), (Axis.RIGHT_X, Axis.RIGHT_Y)
TRIGGERS = Axis.LEFT_TRIGGER, Axis.RIGHT_TRIGGER


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
        """Return the position of an axis; 0 if the gamepad has none such.

        Args:
            axis: Which.
        """
        return self.axes.get(axis, 0.0)

    @property
    def at_full_deflection(self) -> bool:
        """Whether every stick and trigger that is deflected at all is so to its end.

        There a living hand need not change anything; between, it trembles.
        """
        ways = [
            *(math.hypot(self.axis(x), self.axis(y)) for x, y in STICKS),
            *(self.axis(trigger) for trigger in TRIGGERS),
        ]
        return all(way == 0.0 or way >= FULL_DEFLECTION for way in ways)

    def pressed_since(self, before: GamepadState) -> frozenset[Button]:
        """Return the buttons that went down.

        Args:
            before: An earlier state.
        """
        return self.buttons - before.buttons


AT_REST = GamepadState()
"""Nothing is touched."""
