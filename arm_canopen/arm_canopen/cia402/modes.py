# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What each operation mode does with a target, cycle by cycle (CiA 402-2, clauses 10 to 16).

A mode writes its target object and says which mode bits the controlword gets. Every mode is
preloaded with the actual value before the drive is enabled or the mode switched, so that nothing
moves before it was asked to.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from enum import Enum
import math

from ..exceptions import DriveError
from ..master.process_image import Writer
from ..standard.drive import Controlword, OperationMode, Statusword
from .setpoint_profile import ProfileLimits, SetpointProfile
from .units import Units

ACKNOWLEDGE_TIMEOUT = 1.0  # [s] a drive acknowledges a set-point within a few cycles
NO_BITS = Controlword(0)


class Mode(ABC):
    """One operation mode of one drive.

    Attributes:
        number: Its value in 0x6060.
    """

    number: OperationMode

    @abstractmethod
    def preload(self, position_inc: int, velocity: float) -> None:
        """Forget any target and make the present position the one that is commanded.

        Args:
            position_inc: Where the drive is, or is held, in [inc]: as it says itself, so that no
                factor in bus.yml can make the target another one.
            velocity: Its velocity in user units per second; a moving drive is braked from it.
        """

    @abstractmethod
    def set_target(self, target: float) -> None:
        """Take a new target in user units.

        Raises:
            DriveError: The mode takes none, or the value does not fit.
        """

    @abstractmethod
    def step(self, now: float, period: float, statusword: int) -> Controlword:
        """Write this cycle's set-point while the drive obeys, and return the mode's bits.

        Args:
            now: Steady time in [s].
            period: Time to the next cycle in [s].
            statusword: 0x6041 as the drive sent it.
        """

    @property
    def setpoint(self) -> float | None:
        """Position last commanded in user units, None in a mode that commands none."""
        return None


class NoMode(Mode):
    """Mode 0: nothing is commanded."""

    number = OperationMode.NO_MODE

    def preload(self, position_inc: int, velocity: float) -> None:
        """Have nothing to preload."""

    def set_target(self, target: float) -> None:
        """Refuse every target."""
        raise DriveError('no mode of operation is selected; call ~/position_mode or another first')

    def step(self, now: float, period: float, statusword: int) -> Controlword:
        """Command nothing."""
        return NO_BITS


class Handshake(Enum):
    """Where the exchange of a set-point stands (CiA 402-2, 10.3)."""

    IDLE = 'the drive takes a set-point'
    WRITTEN = 'the value is on its way, bit 4 follows in the next cycle'
    OFFERED = 'bit 4 is set, the drive has not acknowledged yet'
    RELEASED = 'acknowledged, bit 4 is cleared, the drive still shows bit 12'


class ProfilePosition(Mode):
    """Mode 1: the drive makes the profile; set-points are handed over by bits 4 and 12.

    A newer target replaces one that still waits for the handshake; the drive changes to it at once
    (bit 5).
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
        self._waiting: int | None = None
        self._offered_at = 0.0
        self._blocked_since: float | None = None
        self._setpoint: float | None = None
        self.handshake = Handshake.IDLE

    @property
    def setpoint(self) -> float | None:
        """Target of the move, in user units."""
        return self._setpoint

    def preload(self, position_inc: int, velocity: float) -> None:
        """Write the actual position as the target, without announcing it."""
        self._waiting = None
        self.handshake = Handshake.IDLE
        self._setpoint = self._units.position_commanded(position_inc)
        self._target.write(position_inc)

    def set_target(self, target: float) -> None:
        """Queue the target for the handshake."""
        self._waiting = self._units.position_to_device(target)
        self._setpoint = target

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
            return Controlword.NEW_SET_POINT | Controlword.CHANGE_IMMEDIATELY
        return Controlword.CHANGE_IMMEDIATELY

    def _take_waiting(self, now: float) -> None:
        self.handshake = Handshake.IDLE
        self._blocked_since = None
        if self._waiting is None:
            return
        self._target.write(self._waiting)
        self._waiting = None
        if self._target_waits_for_sync:
            self.handshake = Handshake.WRITTEN
        else:
            self._offer(now)

    def _offer(self, now: float) -> None:
        self._offered_at = now
        self.handshake = Handshake.OFFERED

    def _watch_release(self, now: float) -> None:
        if self._waiting is None:
            self._blocked_since = None
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


class ProfileVelocity(Mode):
    """Mode 3: the drive ramps to a velocity."""

    number = OperationMode.PROFILE_VELOCITY

    def __init__(self, units: Units, target: Writer) -> None:
        """Take the way to 0x60FF."""
        self._units = units
        self._target = target

    def preload(self, position_inc: int, velocity: float) -> None:
        """Command standstill."""
        self._target.write(0)

    def set_target(self, target: float) -> None:
        """Command a velocity in user units per second."""
        self._target.write(self._units.velocity_to_device(target))

    def step(self, now: float, period: float, statusword: int) -> Controlword:
        """Leave all to the drive."""
        return NO_BITS


class CyclicPosition(Mode):
    """Mode 8: a set-point each cycle, from a stream or from a profile towards a single target."""

    number = OperationMode.CYCLIC_POSITION
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

    def preload(self, position_inc: int, velocity: float) -> None:
        """Hold the actual position."""
        self._streamed = None
        self._profile = SetpointProfile(self._units.position_commanded(position_inc), velocity)
        self._target.write(position_inc)

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


class Homing(Mode):
    """Mode 6: bit 4 starts the method of 0x6098.

    Attributes:
        started: Whether bit 4 is set.
    """

    number = OperationMode.HOMING

    def __init__(self) -> None:
        """Wait for the start."""
        self.started = False

    def preload(self, position_inc: int, velocity: float) -> None:
        """Have nothing to preload: without bit 4 nothing moves."""
        self.started = False

    def set_target(self, target: float) -> None:
        """Refuse every target."""
        raise DriveError('the drive is homing and takes no target')

    def step(self, now: float, period: float, statusword: int) -> Controlword:
        """Keep bit 4 while homing runs."""
        return Controlword.HOMING_START if self.started else NO_BITS
