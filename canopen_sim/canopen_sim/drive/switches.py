# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Switches and index pulse of a simulated axis, and how homing uses them (CiA 402-2, 0x6098)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import auto, Enum
import math
from typing import NamedTuple


class Switch(Enum):
    """A switch that homing can look for."""

    NEGATIVE_LIMIT = auto()
    POSITIVE_LIMIT = auto()
    HOME = auto()


SWITCH_BITS: dict[Switch, int] = {
    Switch.NEGATIVE_LIMIT: 0x1,
    Switch.POSITIVE_LIMIT: 0x2,
    Switch.HOME: 0x4,
}
"""Bits of the digital inputs 0x60FD (CiA 402-2)."""

INTERLOCK_BIT = 0x8  # of 0x60FD: safe torque off


@dataclass(frozen=True, slots=True)
class Switches:
    """Where the switches of an axis are, from its mechanical zero in [inc].

    The mechanical zero is where the motor stood when it was first switched on; homing does not
    move it. The drive shows limit switches in 0x60FD, and stops at them only during homing.
    """

    # at and below it the negative limit switch is active; -inf for none
    negative_limit: float = -4000.0
    # at and above it the positive limit switch is active; inf for none
    positive_limit: float = 4000.0
    # the home switch is active from the first to the second; NaN for none
    home: tuple[float, float] = (500.0, 700.0)
    index: float = 100.0  # where one of the index pulses of the encoder is
    index_period: float = 1000.0  # between two of them; 0 for none

    def active(self, switch: Switch, position: float) -> bool:
        """Return whether a switch is active at a mechanical position."""
        match switch:
            case Switch.NEGATIVE_LIMIT:
                return position <= self.negative_limit
            case Switch.POSITIVE_LIMIT:
                return position >= self.positive_limit
        return self.home[0] <= position <= self.home[1]

    def limit_ahead(self, direction: int, position: float) -> bool:
        """Return whether the limit switch is active that lies in a direction."""
        ahead = Switch.POSITIVE_LIMIT if direction > 0 else Switch.NEGATIVE_LIMIT
        return self.active(ahead, position)

    def inputs(self, position: float) -> int:
        """Return the bits of 0x60FD at a mechanical position."""
        return sum(bit for switch, bit in SWITCH_BITS.items() if self.active(switch, position))

    def edge(self, switch: Switch, side: int) -> float:
        """Return where a switch changes; of the home switch the edge on a side."""
        if switch is Switch.HOME:
            return self.home[side > 0]
        negative = switch is Switch.NEGATIVE_LIMIT
        return self.negative_limit if negative else self.positive_limit

    def next_index(self, position: float, direction: int) -> float:
        """Return the index pulse that comes next in a direction, infinite when there is none."""
        if self.index_period <= 0.0:
            return direction * math.inf
        turns = (position - self.index) / self.index_period
        whole = math.floor(turns) + 1 if direction > 0 else math.ceil(turns) - 1
        return self.index + whole * self.index_period


class Reference(NamedTuple):
    """How a homing method finds home."""

    switch: Switch  # what it looks for
    side: int  # the edge of the active range that counts: -1 the lower, 1 the upper
    final: int  # direction in which it passes that edge, and goes on to the index pulse
    first: int  # direction in which it begins to look; at a limit switch it turns back
    to_index: bool = True  # home is the index pulse behind the edge, otherwise the edge


_NEGATIVE, _POSITIVE, _HOME = Switch.NEGATIVE_LIMIT, Switch.POSITIVE_LIMIT, Switch.HOME
_WITH_INDEX: dict[int, Reference] = {
    1: Reference(_NEGATIVE, 1, 1, -1),
    2: Reference(_POSITIVE, -1, -1, 1),
    3: Reference(_HOME, -1, -1, 1),
    4: Reference(_HOME, -1, 1, 1),
    5: Reference(_HOME, 1, 1, -1),
    6: Reference(_HOME, 1, -1, -1),
    7: Reference(_HOME, -1, -1, 1),
    8: Reference(_HOME, -1, 1, 1),
    9: Reference(_HOME, 1, -1, 1),
    10: Reference(_HOME, 1, 1, 1),
    11: Reference(_HOME, 1, 1, -1),
    12: Reference(_HOME, 1, -1, -1),
    13: Reference(_HOME, -1, 1, -1),
    14: Reference(_HOME, -1, -1, -1),
}
REFERENCES: dict[int, Reference] = _WITH_INDEX | {
    number + 16: reference._replace(to_index=False) for number, reference in _WITH_INDEX.items()
}
"""Methods 1 to 14, and 17 to 30 that are the same without index pulse (CiA 402-2, 0x6098)."""

INDEX_METHODS = {33: -1, 34: 1}
"""The next index pulse in a direction becomes home."""

PRESENT_POSITION_METHODS = frozenset({35, 37})
"""The present position becomes home."""
