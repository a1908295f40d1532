# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Homing mode with all methods of CiA 402-2, clause 11."""

from __future__ import annotations

from collections.abc import Generator
import math
from typing import NamedTuple

from canopen_core.standard import Controlword, OperationMode, Statusword

from ..messages import SyncConsumer
from ..object_store import NEVER
from .axis import Axis, Limits, Switch, Switches
from .modes import Mode, TARGET_REACHED
from .objects import DriveObjects

HOMING_START = int(Controlword.HOMING_START)
ATTAINED = int(Statusword.HOMING_ATTAINED)
HOMING_ERROR = int(Statusword.HOMING_ERROR)

NO_HOMING = 0
STEP = 0.001  # [s] how often the switches are looked at; edges are latched exactly


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
"""Methods 1 to 14, and 17 to 30, the same without index pulse (CiA 402-2, 0x6098)."""

INDEX_METHODS = {33: -1, 34: 1}  # the next index pulse in a direction becomes home

PRESENT_POSITION_METHODS = frozenset({35, 37})  # the present position becomes home


class Move(NamedTuple):
    """A move of a search: its direction, and whether it seeks a switch, at the faster speed."""

    direction: int
    fast: bool = False


Search = Generator[Move, float, float | None]
"""Yields moves, gets the mechanical position in [inc] after each step, returns home or None."""


def search(method: int, switches: Switches, position: float) -> Search:
    """Search for a switch and an index pulse; return None if both limit switches are reached.

    A search that is so fast that it overruns the whole home switch returns to it.
    """
    reference = REFERENCES.get(method)
    if reference is None:
        direction, start = INDEX_METHODS[method], position
        position = yield Move(direction)
        return (yield from _to_index(switches, position, start, direction))
    switch, side, final, direction, to_index = reference
    is_turned = False
    position = yield Move(direction, fast=True)
    while not switches.active(switch, position):
        if switches.limit_ahead(direction, position):
            if is_turned:
                return None
            direction, is_turned = -direction, True
        position = yield Move(direction, fast=True)
    edge = switches.edge(switch, side)
    while (is_active := switches.active(switch, position)) or (position - edge) * side < 0.0:
        if is_active and switches.limit_ahead(side, position):
            return None
        position = yield Move(side)
    while final != side and not switches.active(switch, position):
        position = yield Move(final)
    return (yield from _to_index(switches, position, edge, final)) if to_index else edge


def _to_index(switches: Switches, position: float, start: float, direction: int) -> Search:
    """Move to the next index pulse after a start."""
    pulse = switches.next_index(start, direction)
    while (position - pulse) * direction < 0.0:
        if switches.limit_ahead(direction, position):
            return None
        position = yield Move(direction)
    return pulse


class Homing(Mode):
    """Finds home: the home position becomes the home offset 0x607C.

    Method 0 attains home without changing anything. An unsupported method, a speed of 0, and a
    search that reaches both limit switches end in "homing error". Clearing the start bit
    interrupts the search.
    """

    number = OperationMode.HOMING

    def __init__(self, objects: DriveObjects, axis: Axis, clock: SyncConsumer) -> None:
        super().__init__(objects, axis, clock)
        self._attained = False
        self._failed = False
        self._search: Search | None = None
        self._move = Move(0)
        self._home: float | None = None  # found; the axis has to stand

    @property
    def waiting(self) -> bool:
        """Whether a search is under way."""
        return self._search is not None or self._home is not None

    def reset(self) -> None:
        """Forget home, as after switching on."""
        self._attained = self._failed = False
        self._cancel()

    def start(self, word: int, now: float) -> None:
        """Stop and wait for the start bit; clear an earlier error."""
        super().start(word, now)
        self._failed = False
        self._cancel()

    def command(self, word: int, previous: int, now: float) -> None:
        """Home at the rising edge of bit 4, stop at its falling edge."""
        if not word & HOMING_START and self.waiting:
            self._cancel()
            self.axis.stop(self.objects.homing_ramp)
        if not word & ~previous & HOMING_START or self.halted:
            return
        self._begin(self.objects.homing_method.value, now)

    def _begin(self, method: int, now: float) -> None:
        position = self.axis.position - self.axis.origin
        self._attained = self._failed = False
        if method == NO_HOMING:
            self._attained = True
        elif method in PRESENT_POSITION_METHODS:
            self._attain(position)
        elif method in REFERENCES or method in INDEX_METHODS:
            objects = self.objects
            if objects.homing_speed_zero.value and objects.homing_speed_switch.value:
                self._search = search(method, self.axis.switches, position)
                self._go(next(self._search), now)
            else:
                self._failed = True
        else:
            self._failed = True

    def halt(self, now: float) -> None:
        """Pause the search."""
        self.due = NEVER

    def resume(self, now: float) -> None:
        """Continue the search."""
        if self._search is not None:
            self._go(self._move, now)

    def step(self, now: float) -> None:
        """Read the switches; apply home once the axis is at rest."""
        axis = self.axis
        if self._search is not None and now >= self.due:
            self.due = now + STEP
            try:
                move = self._search.send(axis.position - axis.origin)
            except StopIteration as end:
                self._cancel()
                self._home = end.value
                self._failed = end.value is None
                axis.stop(self.objects.homing_ramp)
            else:
                if move != self._move:
                    self._go(move, now)
        if self._home is not None and axis.settled:
            self._attain(self._home)
            self._cancel()

    def _go(self, move: Move, now: float) -> None:
        """Start the next move of the search."""
        objects = self.objects
        self._move, self.due = move, now
        speed = objects.homing_speed_switch if move.fast else objects.homing_speed_zero
        limits = Limits(objects.speed, objects.homing_ramp, objects.homing_ramp)
        self.axis.ramp(math.copysign(speed.value, move.direction), limits)

    def _attain(self, home: float) -> None:
        self.axis.shift(self.objects.home_offset.value - home - self.axis.origin)
        self._attained = True

    def _cancel(self) -> None:
        self._search = self._home = None
        self.due = NEVER

    def status(self) -> int:
        """Return "target reached", "homing attained" and "homing error"."""
        word = TARGET_REACHED if self.axis.settled and not self.waiting else 0
        if self._attained:
            word |= ATTAINED
        return word | (HOMING_ERROR if self._failed else 0)
