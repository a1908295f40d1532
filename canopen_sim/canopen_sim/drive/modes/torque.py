# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Modes in which the master commands a torque: profile torque and cyclic synchronous torque.

The axis makes a motion of it. Torques are in [0.1 % of the rated torque]. Software position
limits do not act on a torque; the highest speed does. During halt the axis is ramped down and
held in position.
"""

from __future__ import annotations

import math

from canopen_core.standard import OperationMode

from ...services.sync_consumer import SyncConsumer
from ...timed import NEVER
from ..axis import Axis, TORQUE_STEP
from ..objects import DriveObjects
from .mode import Mode, TARGET_REACHED
from .streamed import Streamed


class TorqueMode(Mode):
    """Applies a torque in steps, each of which begins exactly where the one before has ended."""

    def __init__(self, objects: DriveObjects, axis: Axis, clock: SyncConsumer) -> None:
        super().__init__(objects, axis, clock)
        self._torque = 0.0
        self._acting = False

    @property
    def waiting(self) -> bool:
        """The torque acts on a motor that moves or may move."""
        return self.due < NEVER

    @property
    def torque(self) -> float | None:
        """The torque that acts; None while the axis is held in position."""
        return self._torque if self._acting else None

    @property
    def slope(self) -> float:
        """How fast the torque may change per second, infinite for at once."""
        return math.inf

    @property
    def wanted(self) -> float:
        """The torque to reach, within its limits."""
        return 0.0

    def start(self, word: int, now: float) -> None:
        """Hold the axis; the torque begins with the one that keeps its velocity."""
        super().start(word, now)
        self._acting = False

    def halt(self, now: float) -> None:
        """Hold the axis."""
        self._acting = False
        self.due = NEVER

    def act(self, now: float) -> None:
        """Apply the torque from now on."""
        if not self._acting:
            self._acting = True
            # without that of a ramp, which would turn back a motor that has all but run out
            self._torque = self.objects.held_torque(self.axis.steady_torque)
        if self.due == NEVER:
            self.axis.advance(now)
            self.due = now

    def load_changed(self, now: float) -> None:
        """React to another load, which may move a motor at rest."""
        if self._acting:
            self.act(now)

    def step(self, now: float) -> None:
        """Apply the torque for another step, when one has ended."""
        axis = self.axis
        if now < self.due:
            return
        change = self.slope * TORQUE_STEP
        self._torque += min(max(self.wanted - self._torque, -change), change)
        still = axis.settled and axis.rests(self._torque) and self._torque == self.wanted
        axis.push(self._torque)
        self.due = NEVER if still else now + TORQUE_STEP


class ProfileTorque(TorqueMode):
    """Profile torque mode (CiA 402-2, clause 13): ramps to 0x6071 by the slope 0x6087."""

    number = OperationMode.PROFILE_TORQUE

    @property
    def slope(self) -> float:
        """Torque slope 0x6087."""
        return float(self.objects.torque_slope.value) or math.inf

    @property
    def wanted(self) -> float:
        """Target torque 0x6071 within its limits."""
        target = self.objects.target_torque.value
        held = self.objects.held_torque(target)
        self.limited = held != target
        return held

    def start(self, word: int, now: float) -> None:
        """Ramp to the target torque as it stands in the dictionary."""
        super().start(word, now)
        if not self.halted:
            self.act(now)

    def resume(self, now: float) -> None:
        """Ramp to the target torque."""
        self.act(now)

    def setpoint(self, now: float) -> bool:
        """Ramp to another torque."""
        if self.halted:
            return False
        self.act(now)
        return True

    def status(self) -> int:
        """Return "target reached"."""
        return TARGET_REACHED if self._acting and self._torque == self.wanted else 0


class CyclicTorque(TorqueMode, Streamed):
    """Cyclic synchronous torque mode (CiA 402-2, clause 15): 0x6071 plus the offset 0x60B2."""

    number = OperationMode.CYCLIC_TORQUE

    def __init__(self, objects: DriveObjects, axis: Axis, clock: SyncConsumer) -> None:
        super().__init__(objects, axis, clock)
        self._target = 0.0

    @property
    def wanted(self) -> float:
        """The latest set-point, within its limits."""
        return self._target

    def halt(self, now: float) -> None:
        """Forget set-points and hold the axis."""
        Streamed.halt(self, now)
        TorqueMode.halt(self, now)

    def take(self, period: float, now: float) -> bool:
        """Apply the set-point from now on."""
        wanted = self.objects.target_torque.value + self.objects.torque_offset.value
        self._target = self.objects.held_torque(wanted)
        self.limited = self._target != wanted
        self.act(now)
        return True
