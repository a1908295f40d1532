# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Homing mode with all methods of CiA 402-2, clause 11."""

from __future__ import annotations

from enum import auto, Enum
import math

from arm_canopen import OperationMode
from arm_canopen.standard import Controlword, Statusword

from ...services.sync_consumer import SyncConsumer
from ...timed import NEVER
from ..axis import Axis, Limits
from ..objects import DriveObjects
from ..switches import INDEX_METHODS, PRESENT_POSITION_METHODS, Reference, REFERENCES, Switches
from .mode import Mode, TARGET_REACHED

HOMING_START = int(Controlword.HOMING_START)
ATTAINED = int(Statusword.HOMING_ATTAINED)
HOMING_ERROR = int(Statusword.HOMING_ERROR)

NO_HOMING = 0
STEP = 0.001  # [s] how often the switches are looked at; edges are latched exactly


class Phase(Enum):
    """What a search does."""

    SEARCH = auto()  # fast, until the switch is active
    LEAVE = auto()  # slowly past the edge, out of the active range
    RETURN = auto()  # slowly back over the edge
    INDEX = auto()  # slowly to the index pulse
    FOUND = auto()
    FAILED = auto()


class HomingRun:
    """One search for a switch and an index pulse, as a sequence of directions and speeds.

    Attributes:
        phase: What it does.
        direction: Where it goes: -1, 1.
        home: Mechanical position of home in [inc], once found.
    """

    def __init__(self, method: int, switches: Switches, position: float) -> None:
        """Begin a search.

        Args:
            method: A number of :data:`~.switches.REFERENCES` or
                :data:`~.switches.INDEX_METHODS`.
            switches: Where the switches are.
            position: Mechanical position of the axis in [inc].
        """
        self.home = position
        self._switches = switches
        self._turned = False
        self._reference: Reference | None = REFERENCES.get(method)
        if self._reference is None:
            self.direction = INDEX_METHODS[method]
            self._seek_index(position, self.direction)
        else:
            self.phase = Phase.SEARCH
            self.direction = self._reference.first

    @property
    def fast(self) -> bool:
        """It moves with the speed of the search for a switch."""
        return self.phase is Phase.SEARCH

    @property
    def done(self) -> bool:
        """It has ended."""
        return self.phase in (Phase.FOUND, Phase.FAILED)

    def look(self, position: float) -> None:
        """See where the axis is, mechanically in [inc]."""
        if self._reference is None or self.phase is Phase.INDEX:
            self._look_for_index(position)
            return
        active = self._switches.active(self._reference.switch, position)
        if self.phase is Phase.SEARCH:
            self._search(active, position)
        elif self.phase is Phase.LEAVE:
            self._leave(self._reference, active, position)
        elif self.phase is Phase.RETURN and active:
            self._pass_edge(self._reference)

    def _search(self, active: bool, position: float) -> None:
        if active and self._reference is not None:
            self.phase, self.direction = Phase.LEAVE, self._reference.side
        elif self._switches.limit_ahead(self.direction, position):
            self.direction = -self.direction
            if self._turned:
                self.phase = Phase.FAILED
            self._turned = True

    def _leave(self, reference: Reference, active: bool, position: float) -> None:
        if active:
            if self._switches.limit_ahead(self.direction, position):
                self.phase = Phase.FAILED
            return
        edge = self._switches.edge(reference.switch, reference.side)
        if (position - edge) * self.direction < 0.0:
            return  # it ran over the whole switch, and comes back
        if reference.final == reference.side:
            self._pass_edge(reference)
        else:
            self.phase, self.direction = Phase.RETURN, reference.final

    def _pass_edge(self, reference: Reference) -> None:
        edge = self._switches.edge(reference.switch, reference.side)
        if reference.to_index:
            self._seek_index(edge, reference.final)
        else:
            self.home, self.phase = edge, Phase.FOUND

    def _seek_index(self, position: float, direction: int) -> None:
        self.phase, self.direction = Phase.INDEX, direction
        self.home = self._switches.next_index(position, direction)

    def _look_for_index(self, position: float) -> None:
        if (position - self.home) * self.direction >= 0.0:
            self.phase = Phase.FOUND
        elif self._switches.limit_ahead(self.direction, position):
            self.phase = Phase.FAILED


class Homing(Mode):
    """Finds home: the home position becomes the home offset 0x607C.

    Method 0 attains home without changing anything. A method that the drive has not, a speed
    of 0 and a search that meets both limit switches end in "homing error". The start bit taken
    back interrupts the search.
    """

    number = OperationMode.HOMING

    def __init__(self, objects: DriveObjects, axis: Axis, clock: SyncConsumer) -> None:
        super().__init__(objects, axis, clock)
        self._attained = False
        self._failed = False
        self._run: HomingRun | None = None

    @property
    def waiting(self) -> bool:
        """A search is under way."""
        return self._run is not None

    def reset(self) -> None:
        """Be not homed, as after switching on."""
        self._attained = self._failed = False
        self._cancel()

    def start(self, word: int, now: float) -> None:
        """Stand still and wait for the start; an earlier error is over."""
        super().start(word, now)
        self._failed = False
        self._cancel()

    def command(self, word: int, previous: int, now: float) -> None:
        """Home at the rising edge of bit 4, stop at its falling edge."""
        if not word & HOMING_START and self._run is not None:
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
            self._run = HomingRun(method, self.axis.switches, position)
            self._move(self._run, now)
        else:
            self._failed = True

    def halt(self, now: float) -> None:
        """Wait with the search."""
        self.due = NEVER

    def resume(self, now: float) -> None:
        """Go on with the search."""
        if self._run is not None and not self._run.done:
            self._move(self._run, now)

    def step(self, now: float) -> None:
        """Look at the switches; take home over when the axis stands."""
        run, axis = self._run, self.axis
        if run is None:
            return
        if now >= self.due:
            before = (run.phase, run.direction)
            run.look(axis.position - axis.origin)
            self.due = NEVER if run.done else now + STEP
            if run.done:
                axis.stop(self.objects.homing_ramp)
                self._failed = run.phase is Phase.FAILED
            elif before != (run.phase, run.direction):
                self._move(run, now)
        if run.done and axis.settled:
            self._cancel()
            if run.phase is Phase.FOUND:
                self._attain(run.home)

    def _move(self, run: HomingRun, now: float) -> None:
        """Go where the search leads."""
        objects = self.objects
        speeds = (objects.homing_speed_zero.value, objects.homing_speed_switch.value)
        if not all(speeds):
            self._failed = True
            self._cancel()
            return
        limits = Limits(objects.speed, objects.homing_ramp, objects.homing_ramp)
        self.axis.ramp(math.copysign(speeds[run.fast], run.direction), limits)
        self.due = now

    def _attain(self, home: float) -> None:
        self.axis.shift(self.objects.home_offset.value - home - self.axis.origin)
        self._attained = True

    def _cancel(self) -> None:
        self._run = None
        self.due = NEVER

    def status(self) -> int:
        """Return "target reached", "homing attained" and "homing error"."""
        word = TARGET_REACHED if self.axis.settled and self._run is None else 0
        if self._attained:
            word |= ATTAINED
        return word | (HOMING_ERROR if self._failed else 0)
