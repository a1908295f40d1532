# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Modes that command a position each cycle: 7 (interpolated) and 8 (cyclic synchronous)."""

from __future__ import annotations

from collections.abc import Callable

from canopen_core.standard import Controlword, OperationMode

from ...master.process_image import IN_THE_IMAGE, Writer
from ...master.scheduler import Promise
from ..motion import Setpoint
from ..parameters import ProfileLimits
from ..state import Actual
from ..units import Units
from .mode import Mode, NO_BITS
from .setpoint_profile import SetpointProfile


class CyclicPosition(Mode):
    """Mode 8: a set-point each cycle, of a motion source or from a profile towards targets."""

    number = OperationMode.CYCLIC_POSITION
    halts_by_bit = False
    cyclic = True
    bits = NO_BITS

    def __init__(self, units: Units, target: Writer, limits: Callable[[], ProfileLimits]) -> None:
        self._scale = units.position
        self._target = target
        self._limits = limits
        self._profile = SetpointProfile(0.0)
        self._streamed: tuple[float, int] | None = None  # position, the same in [inc]
        self._position_inc = 0  # that was written last
        self._stands = False  # the set-point is that one

    @property
    def setpoint(self) -> float:  # type: ignore[override]  # never none, and never written
        """Set-point of this cycle, in user units."""
        return self._profile.position

    @property
    def velocity(self) -> float:
        """Rate of the set-point in user units per second."""
        return self._profile.velocity

    @property
    def goes_to_single_target(self) -> bool:
        """Whether the profile is on the way to a single target."""
        return self._profile.target is not None and not self._profile.at_rest

    def reached(self, statusword: int) -> bool:
        """Whether the profile has ended; modes 7 and 8 do not use bit 10."""
        return not self.goes_to_single_target

    def preload(self, actual: Actual) -> Promise[None]:
        """Hold the actual position."""
        self._streamed, self._stands = None, False
        position = self._scale.commanded(actual.position_inc)
        self._profile = SetpointProfile(position, actual.velocity)
        return self._target.deliver(actual.position_inc)

    def set_target(self, target: float) -> Promise[None]:
        """Go to a single target by a profile."""
        self._scale.to_device(target, self._target.limits)  # else it would fail on arrival
        self._profile.go(target)
        return IN_THE_IMAGE

    def follow_target(self, target: float) -> Promise[None]:
        """Go to the next target of a stream by a profile that is as even as they come."""
        self._scale.to_device(target, self._target.limits)
        self._profile.track(target)
        return IN_THE_IMAGE

    def brake(self) -> None:
        """Come to a stop within the limits, wherever that is."""
        self._streamed = None
        self._profile.go(None)

    @property
    def braked(self) -> bool:
        """Whether the set-point stands."""
        return self._profile.velocity == 0.0

    def stream(self, setpoint: float) -> None:
        """Set the set-point of a motion source for this cycle.

        Raises:
            DriveError: It is not finite or does not fit the object.
        """
        self._streamed = setpoint, self._scale.to_device(setpoint, self._target.limits)

    def step(self, now: float, period: float, statusword: int) -> int:
        """Write the streamed set-point, or the profile's; a stream that ends is braked."""
        profile = self._profile
        if self._streamed is not None:
            position, self._position_inc = self._streamed
            profile.follow(position, period)
            self._streamed, self._stands = None, False
        elif not (self._stands and profile.is_idle):
            self._position_inc = self._scale.to_device(profile.step(period, self._limits()))
            self._stands = profile.is_idle
        self._target.write(self._position_inc)
        return self.bits


class InterpolatedPosition(CyclicPosition):
    """Mode 7: as mode 8, into 0x60C1:1, with bit 4 enabling the interpolation."""

    number = OperationMode.INTERPOLATED_POSITION
    bits = int(Controlword.ENABLE_INTERPOLATION)


class FeedForward:
    """What a drive adds in mode 8 to its own control: velocity 0x60B1, torque 0x60B2.

    As far as RPDOs carry them (CiA 402-2, clause 13). In the modes 9 and 10 a drive adds them to
    the target, so none may be left over from a stream. An offset that no stream has set is left as
    it is: another program may have written it.
    """

    def __init__(self, velocity: Writer | None, torque: Writer | None, units: Units) -> None:
        self._velocity, self._torque = velocity, torque
        self._units = units
        self._acts = False

    def follow(self, setpoint: Setpoint) -> None:
        """Write what belongs to a set-point.

        Raises:
            DriveError: A value is not finite or does not fit its object; nothing is written.
        """
        units, velocity, torque = self._units, self._velocity, self._torque
        limits = None if velocity is None else velocity.limits
        velocity_dev = units.velocity.to_device(setpoint.velocity, limits)
        limits = None if torque is None else torque.limits
        torque_dev = units.effort.to_device(setpoint.effort, limits)
        if velocity_dev or torque_dev:
            self._acts = True
            self._write(velocity_dev, torque_dev)
        else:
            self.end()

    def end(self) -> None:
        """Reset the offsets that were written."""
        if self._acts:
            self._acts = False
            self._write(0, 0)

    def _write(self, velocity_dev: int, torque_dev: int) -> None:
        if self._velocity is not None:
            self._velocity.write(velocity_dev)
        if self._torque is not None:
            self._torque.write(torque_dev)
