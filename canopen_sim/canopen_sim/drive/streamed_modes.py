# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Modes in which the master streams positions, velocities or torques (CiA 402-2, 13 to 15).

While SYNC arrives regularly, a written set-point is applied at the next SYNC, otherwise at once.
It lasts until the next one is due: for the period of SYNC if each SYNC had a set-point, else for
the interpolation time period 0x60C2.
"""

from __future__ import annotations

from abc import abstractmethod
from collections import deque
import math

from canopen_core.standard import Controlword, OperationMode, Statusword

from ..messages import SyncConsumer
from ..object_store import NEVER
from .axis import Axis, Limits, TORQUE_STEP
from .modes import Mode, TARGET_REACHED
from .objects import DriveObjects, NO_WINDOW, PERIOD_MIN

FOLLOWS_COMMAND = int(Statusword.FOLLOWS_COMMAND)
ENABLE_INTERPOLATION = int(Controlword.ENABLE_INTERPOLATION)
INTERPOLATION_ACTIVE = int(Statusword.INTERPOLATION_ACTIVE)


class Streamed(Mode):
    """Follows set-points that arrive at regular times.

    An enabled drive stands still until the first set-point is written; the earlier value of the
    target object is not a set-point.
    """

    def __init__(self, objects: DriveObjects, axis: Axis, clock: SyncConsumer) -> None:
        super().__init__(objects, axis, clock)
        self._fresh = False  # written since the last SYNC
        self._streaming = False  # there was one for the SYNC before

    @property
    def following(self) -> bool:
        """Set-points are applied."""
        return not self.halted

    def start(self, word: int, now: float) -> None:
        """Stop and wait for a set-point."""
        super().start(word, now)
        self._fresh = self._streaming = False

    def halt(self, now: float) -> None:
        """Discard a pending set-point."""
        self._fresh = self._streaming = False

    def setpoint(self, now: float) -> bool:
        """Keep the set-point for the next SYNC, or apply it."""
        if not self.following:
            return False
        if self.clock.alive(now):
            self._fresh = True
            return False
        return self.take(self.objects.setpoint_period, now)

    def sync(self, now: float) -> bool:
        """Apply the set-point received since the last SYNC."""
        fresh, self._fresh = self._fresh, False
        steady, self._streaming = self._streaming and fresh, fresh
        if not fresh:
            return False
        period = self.clock.period if steady else 0.0
        return self.take(period or self.objects.setpoint_period, now)

    @abstractmethod
    def take(self, period: float, now: float) -> bool:
        """Apply the set-point, the axis at an earlier time; return whether it moves.

        The next one is due after the ``period`` in [s].
        """

    def go(self, wanted: int, period: float, now: float) -> bool:
        """Move to a position within a period; return whether the motion has changed."""
        axis = self.axis
        axis.advance(now)
        target = self.objects.within_limits(wanted, axis.demand)
        self.limited = target != wanted
        if axis.arrived and axis.demand == target:
            return False
        axis.line(target, max(period, PERIOD_MIN))
        return True

    def status(self) -> int:
        """Return "drive follows the command value"."""
        return FOLLOWS_COMMAND if self.following and not self.limited else 0


class CyclicPosition(Streamed):
    """Cyclic synchronous position mode: 0x607A plus the position offset 0x60B0."""

    number = OperationMode.CYCLIC_POSITION

    def take(self, period: float, now: float) -> bool:
        """Move to the set-point within a period."""
        objects = self.objects
        return self.go(objects.target_position.value + objects.position_offset.value, period, now)


class CyclicVelocity(Streamed):
    """Ramps from set-point to set-point within a cycle, as far as 0x60C5 and 0x60C6 allow.

    The velocity is 0x60FF plus the velocity offset 0x60B1. The last one holds when the stream
    ends; software position limits stop the axis.
    """

    number = OperationMode.CYCLIC_VELOCITY

    def take(self, period: float, now: float) -> bool:
        """Ramp to the velocity within a period."""
        objects, axis = self.objects, self.axis
        wanted = float(objects.target_velocity.value + objects.velocity_offset.value)
        axis.advance(now)
        change = abs(wanted - axis.demand_velocity)
        if not change and axis.arrived:
            return False
        needed = max(change / period, objects.slow_down)
        limits = Limits(
            axis.speed,
            min(needed, objects.max_acceleration.value or needed),
            min(needed, objects.max_deceleration.value or needed),
        )
        bounded = axis.ramp(wanted, limits, objects.position_limits())
        self.limited = abs(wanted) > axis.speed or (bounded and axis.arrived)
        return True


class InterpolatedPosition(Streamed):
    """Interpolated position mode, linear; bit 4 of the controlword enables it.

    With a buffer of more than one record (0x60C4:02), set-points are queued, and each SYNC takes
    one. Writing 0 to 0x60C4:06 clears the buffer and disables it until 1 is written.
    """

    number = OperationMode.INTERPOLATED_POSITION

    def __init__(self, objects: DriveObjects, axis: Axis, clock: SyncConsumer) -> None:
        super().__init__(objects, axis, clock)
        self._enabled = False
        self._buffer: deque[int] = deque()
        objects.buffer_clear.listener = self._on_clear

    @property
    def following(self) -> bool:
        """Set-points are applied."""
        return self._enabled and not self.halted

    def start(self, word: int, now: float) -> None:
        """Stop; bit 4 may be set already."""
        super().start(word, now)
        self._buffer.clear()
        self._enabled = bool(word & ENABLE_INTERPOLATION)

    def take(self, period: float, now: float) -> bool:
        """Move to the interpolation data record 0x60C1:01 within a period."""
        return self.go(self.objects.interpolation_target.value, period, now)

    def setpoint(self, now: float) -> bool:
        """Keep the set-point for its SYNC, or apply it."""
        size = min(self.objects.buffer_size.value, self.objects.buffer_maximum.value)
        if not self.objects.buffer_clear.value:
            return False
        if size > 1 and self.clock.alive(now):
            if self.following and len(self._buffer) < size:
                self._buffer.append(self.objects.interpolation_target.value)
            return False
        return super().setpoint(now)

    def sync(self, now: float) -> bool:
        """Apply the oldest set-point of the buffer, or the one since the last SYNC."""
        if not self._buffer:
            return super().sync(now)
        if not self.following:
            return False
        return self.go(self._buffer.popleft(), self.clock.period, now)

    def _on_clear(self, _now: float) -> None:
        if not self.objects.buffer_clear.value:
            self._buffer.clear()
            self._fresh = False

    def halt(self, now: float) -> None:
        """Discard pending set-points."""
        super().halt(now)
        self._buffer.clear()

    def command(self, word: int, previous: int, now: float) -> None:
        """Enable or disable interpolation."""
        enabled = bool(word & ENABLE_INTERPOLATION)
        if enabled is not self._enabled:
            self._enabled = enabled
            self.halt(now)
            self.axis.stop(self.objects.slow_down)

    def status(self) -> int:
        """Return "target reached" and "interpolation active"."""
        window = self.objects.position_window.value
        near = window == NO_WINDOW or abs(self.axis.following_error) <= window
        reached = TARGET_REACHED if self.axis.arrived and near else 0
        return reached | (INTERPOLATION_ACTIVE if self.following else 0)


class TorqueMode(Mode):
    """Applies a torque in steps, each of which begins exactly where the one before has ended.

    The axis turns torque into motion. Torques are in [0.1 % of the rated torque]. Software
    position limits do not apply; the highest speed does. During halt the axis ramps down and
    holds its position.
    """

    def __init__(self, objects: DriveObjects, axis: Axis, clock: SyncConsumer) -> None:
        super().__init__(objects, axis, clock)
        self._torque = 0.0
        self._acting = False

    @property
    def waiting(self) -> bool:
        """Whether the torque acts on a motor that moves or may move."""
        return self.due < NEVER

    @property
    def torque(self) -> float | None:
        """Applied torque; None while the axis is held in position."""
        return self._torque if self._acting else None

    @property
    def slope(self) -> float:
        """Greatest change of torque per second; infinite for steps."""
        return math.inf

    @property
    def wanted(self) -> float:
        """Target torque within its limits."""
        return 0.0

    def start(self, word: int, now: float) -> None:
        """Hold the axis; the torque starts at the value that keeps the velocity."""
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
        """Apply the torque for another step when the last one has ended."""
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
        """Discard set-points and hold the axis."""
        Streamed.halt(self, now)
        TorqueMode.halt(self, now)

    def take(self, period: float, now: float) -> bool:
        """Apply the set-point from now on."""
        wanted = self.objects.target_torque.value + self.objects.torque_offset.value
        self._target = self.objects.held_torque(wanted)
        self.limited = self._target != wanted
        self.act(now)
        return True
