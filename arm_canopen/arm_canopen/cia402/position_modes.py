# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Modes that command a position: 1 (profile), 7 (interpolated) and 8 (cyclic synchronous)."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
import math

from ..exceptions import DriveError
from ..master.process_image import Writer
from ..standard.drive import Controlword, OperationMode, Statusword
from .modes import Actual, Mode, NO_BITS
from .setpoint_profile import ProfileLimits, SetpointProfile
from .units import Units

ACKNOWLEDGE_TIMEOUT = 1.0  # [s] a drive acknowledges a set-point within a few cycles
QUEUE_MAX = 16  # moves that may wait for the drive


@dataclass(frozen=True, slots=True)
class Move:
    """A set-point of mode 1, and how the drive shall take it (CiA 402-2, 10.3).

    Attributes:
        target: Position in user units; a distance when it is relative.
        relative: From the last set-point on (bit 6).
        immediate: At once, ending the move that runs (bit 5); else after it.
        blend: Pass the set-point before at speed instead of stopping there (bit 9).
    """

    target: float
    relative: bool = False
    immediate: bool = True
    blend: bool = False

    @property
    def bits(self) -> Controlword:
        """Bits of the controlword that say so."""
        bits = NO_BITS
        if self.relative:
            bits |= Controlword.RELATIVE
        if self.immediate:
            bits |= Controlword.CHANGE_IMMEDIATELY
        if self.blend:
            bits |= Controlword.CHANGE_ON_SET_POINT
        return bits


class Handshake(Enum):
    """Where the exchange of a set-point stands (CiA 402-2, 10.3)."""

    IDLE = 'the drive takes a set-point'
    WRITTEN = 'the value is on its way, bit 4 follows in the next cycle'
    OFFERED = 'bit 4 is set, the drive has not acknowledged yet'
    RELEASED = 'acknowledged, bit 4 is cleared, the drive still shows bit 12'


class ProfilePosition(Mode):
    """Mode 1: the drive makes the profile; set-points are handed over by bits 4 and 12.

    Of immediate moves the newest counts: it replaces those that still wait for the handshake.
    Others queue, and none of them is lost.
    """

    number = OperationMode.PROFILE_POSITION

    def __init__(
        self,
        units: Units,
        target: Writer,
        warn: Callable[[str], None],
        *,
        target_waits_for_sync: bool,
    ) -> None:
        """Take the way to 0x607A.

        Args:
            units: Units of the drive.
            target: Writer of 0x607A.
            warn: Takes a warning in words.
            target_waits_for_sync: 0x607A is in a synchronous RPDO without the controlword. Which
                of the two a drive looks at first is its own affair, so the value goes ahead.
        """
        self._target_waits_for_sync = target_waits_for_sync
        self._units = units
        self._target = target
        self._warn = warn
        self._queue: deque[tuple[int, Move]] = deque()
        self._bits = Controlword.CHANGE_IMMEDIATELY
        self._offered_at = 0.0
        self._blocked_since: float | None = None
        self._setpoint: float | None = None
        self.handshake = Handshake.IDLE

    @property
    def setpoint(self) -> float | None:
        """Target of the last move, in user units."""
        return self._setpoint

    @property
    def handing_over(self) -> bool:
        """Whether a set-point waits or is being handed over."""
        return bool(self._queue) or self.handshake in (Handshake.WRITTEN, Handshake.OFFERED)

    def preload(self, actual: Actual) -> None:
        """Write the actual position as the target, without announcing it."""
        self._queue.clear()
        self.handshake = Handshake.IDLE
        self._bits = Controlword.CHANGE_IMMEDIATELY
        self._setpoint = self._units.position_commanded(actual.position_inc)
        self._target.write(actual.position_inc)

    def set_target(self, target: float) -> None:
        """Go to a position at once."""
        self.move(Move(target))

    def destination(self, move: Move) -> float:
        """Return where a move ends, in user units."""
        return move.target + ((self._setpoint or 0.0) if move.relative else 0.0)

    def move(self, move: Move) -> None:
        """Queue a move for the handshake.

        Raises:
            DriveError: The value does not fit 0x607A, or too many moves wait.
        """
        to_device = self._units.distance_to_device if move.relative else None
        value = (to_device or self._units.position_to_device)(move.target)
        if move.immediate:
            self._queue.clear()
        elif len(self._queue) >= QUEUE_MAX:
            raise DriveError(
                f'{QUEUE_MAX} moves wait for the drive already; send the next one later'
            )
        self._setpoint = self.destination(move)
        self._queue.append((value, move))

    def step(self, now: float, period: float, statusword: int) -> Controlword:
        """Advance the handshake."""
        acknowledged = bool(statusword & Statusword.SET_POINT_ACKNOWLEDGE)
        if self.handshake is Handshake.OFFERED:
            self._watch_acknowledge(now, acknowledged=acknowledged)
        elif self.handshake is Handshake.WRITTEN:
            self._offer(now)
        elif acknowledged:
            self._watch_release(now)
        else:
            self._take_waiting(now)
        if self.handshake is Handshake.OFFERED:
            return self._bits | Controlword.NEW_SET_POINT
        return self._bits

    def _take_waiting(self, now: float) -> None:
        self.handshake = Handshake.IDLE
        self._blocked_since = None
        if not self._queue:
            return
        value, move = self._queue.popleft()
        self._target.write(value)
        self._bits = move.bits
        if self._target_waits_for_sync:
            self.handshake = Handshake.WRITTEN
        else:
            self._offer(now)

    def _offer(self, now: float) -> None:
        self._offered_at = now
        self.handshake = Handshake.OFFERED

    def _watch_release(self, now: float) -> None:
        if not self._queue or not self._queue[0][1].immediate:
            self._blocked_since = None  # a full buffer empties when the move that runs has ended
        elif self._blocked_since is None:
            self._blocked_since = now
        elif now - self._blocked_since > ACKNOWLEDGE_TIMEOUT:
            self._blocked_since = math.inf  # said once
            self._warn(
                f'bit 12 has been set for {ACKNOWLEDGE_TIMEOUT:g} s, so a new set-point cannot be '
                'handed over; it will be when the drive takes the bit back'
            )

    def _watch_acknowledge(self, now: float, *, acknowledged: bool) -> None:
        if acknowledged:
            self.handshake = Handshake.RELEASED
        elif now - self._offered_at > ACKNOWLEDGE_TIMEOUT:
            self.handshake = Handshake.RELEASED
            self._warn(
                f'the set-point was not acknowledged within {ACKNOWLEDGE_TIMEOUT:g} s (bit 12); '
                'it may not have been taken'
            )


class CyclicPosition(Mode):
    """Mode 8: a set-point each cycle, from a stream or from a profile towards a single target."""

    number = OperationMode.CYCLIC_POSITION
    halts_by_bit = False
    cyclic = True
    bits = NO_BITS

    def __init__(self, units: Units, target: Writer, limits: Callable[[], ProfileLimits]) -> None:
        """Take the way to the target object.

        Args:
            units: Units of the drive.
            target: Writer of 0x607A (or 0x60C1:1).
            limits: Gives the profile limits of the drive.
        """
        self._units = units
        self._target = target
        self._limits = limits
        self._profile = SetpointProfile(0.0)
        self._streamed: float | None = None

    @property
    def setpoint(self) -> float:
        """Set-point of this cycle, in user units."""
        return self._profile.position

    @property
    def goes_to_single_target(self) -> bool:
        """Whether the profile is on the way to a single target."""
        return self._profile.target is not None and not self._profile.at_rest

    def preload(self, actual: Actual) -> None:
        """Hold the actual position."""
        self._streamed = None
        position = self._units.position_commanded(actual.position_inc)
        self._profile = SetpointProfile(position, actual.velocity)
        self._target.write(actual.position_inc)

    def set_target(self, target: float) -> None:
        """Go to a single target by a profile."""
        self._units.position_to_device(target)  # refuse now what could not be sent on arrival
        self._profile.target = target

    @property
    def velocity(self) -> float:
        """Rate of the set-point in user units per second."""
        return self._profile.velocity

    def brake(self) -> None:
        """Come to a stop within the limits, wherever that is."""
        self._streamed = None
        self._profile.target = None

    @property
    def braked(self) -> bool:
        """Whether the set-point stands."""
        return self._profile.velocity == 0.0

    def stream(self, setpoint: float) -> None:
        """Take the set-point of a motion source for this cycle.

        Raises:
            DriveError: It is not finite or does not fit the object.
        """
        self._units.position_to_device(setpoint)
        self._streamed = setpoint

    def step(self, now: float, period: float, statusword: int) -> Controlword:
        """Write the streamed set-point, or the profile's; a stream that ends is braked."""
        if self._streamed is not None:
            self._profile.follow(self._streamed, period)
            self._streamed = None
        else:
            self._profile.step(period, self._limits())
        self._target.write(self._units.position_to_device(self._profile.position))
        return self.bits


class InterpolatedPosition(CyclicPosition):
    """Mode 7: as mode 8, into 0x60C1:1, with bit 4 enabling the interpolation."""

    number = OperationMode.INTERPOLATED_POSITION
    bits = Controlword.ENABLE_INTERPOLATION
