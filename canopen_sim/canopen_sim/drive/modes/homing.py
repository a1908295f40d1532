# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Homing mode with all methods of CiA 402-2, clause 11."""

from __future__ import annotations

import math

from arm_canopen import OperationMode
from arm_canopen.standard import Controlword, Statusword

from ...timed import NEVER
from ..axis import Axis
from ..homing_run import HomingRun, Phase
from ..objects import DriveObjects
from ..profile import Limits, plan_velocity
from ..switches import INDEX_METHODS, PRESENT_POSITION_METHODS, REFERENCES
from .mode import Mode, SyncClock, TARGET_REACHED

HOMING_START = int(Controlword.HOMING_START)
ATTAINED = int(Statusword.HOMING_ATTAINED)
HOMING_ERROR = int(Statusword.HOMING_ERROR)

NO_HOMING = 0
STEP = 0.001  # [s] how often the switches are looked at; edges are latched exactly


class Homing(Mode):
    """Finds home: the home position becomes the home offset 0x607C.

    Method 0 attains home without changing anything. A method that the drive has not, a speed
    of 0 and a search that meets both limit switches end in "homing error". The start bit taken
    back interrupts the search.
    """

    number = OperationMode.HOMING

    def __init__(self, objects: DriveObjects, axis: Axis, clock: SyncClock) -> None:
        super().__init__(objects, axis, clock)
        self._attained = False
        self._failed = False
        self._run: HomingRun | None = None
        self._next = NEVER

    @property
    def next_event(self) -> float:
        """When the switches are looked at."""
        return self._next

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
        self._attained = self._failed = False
        if method == NO_HOMING:
            self._attained = True
        elif method in PRESENT_POSITION_METHODS:
            self._attain(self.axis.position - self.axis.origin)
        elif method in REFERENCES or method in INDEX_METHODS:
            position = self.axis.position - self.axis.origin
            self._run = HomingRun(method, self.axis.switches, position)
            self._move(now)
            self._next = now
        else:
            self._failed = True

    def halt(self, now: float) -> None:
        """Wait with the search."""
        self._next = NEVER

    def resume(self, now: float) -> None:
        """Go on with the search."""
        if self._run is not None and not self._run.done:
            self._move(now)
            self._next = now

    def event(self, now: float) -> None:
        """Look at the switches."""
        run = self._run
        if run is None:
            self._next = NEVER
            return
        before = (run.phase, run.direction)
        run.look(self.axis.position - self.axis.origin)
        self._next = NEVER if run.done else now + STEP
        if run.done:
            self.axis.stop(self.objects.homing_ramp)
            self._failed = run.phase is Phase.FAILED
        elif before != (run.phase, run.direction):
            self._move(now)

    def _move(self, now: float) -> None:
        """Go where the search leads."""
        run, objects = self._run, self.objects
        if run is None:
            return
        speeds = (objects.homing_speed_zero.value, objects.homing_speed_switch.value)
        if not all(speeds):
            self._failed = True
            self._cancel()
            return
        limits = Limits(objects.speed, objects.homing_ramp, objects.homing_ramp)
        velocity = math.copysign(speeds[run.fast], run.direction)
        self.axis.follow(plan_velocity(self.axis.demand, velocity, limits, now))

    def update(self, now: float) -> None:
        """Take home over when the axis stands."""
        run = self._run
        if run is None or not run.done or not self.axis.settled:
            return
        self._cancel()
        if run.phase is Phase.FOUND:
            self._attain(run.home)

    def _attain(self, home: float) -> None:
        self.axis.shift(self.objects.home_offset.value - home - self.axis.origin)
        self._attained = True

    def _cancel(self) -> None:
        self._run = None
        self._next = NEVER

    def status(self) -> int:
        """Return "target reached", "homing attained" and "homing error"."""
        word = TARGET_REACHED if self.axis.settled and self._run is None else 0
        if self._attained:
            word |= ATTAINED
        return word | (HOMING_ERROR if self._failed else 0)
