# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Modes that command a position each cycle: 7 (interpolated) and 8 (cyclic synchronous)."""

from __future__ import annotations

from collections.abc import Callable

from canopen_core.standard import Controlword, OperationMode

from ..master.process_image import IN_THE_IMAGE, Writer
from ..master.scheduler import Promise
from .modes import Actual, fitting, Mode, NO_BITS
from .setpoint_profile import ProfileLimits, SetpointProfile
from .units import Units


class CyclicPosition(Mode):
    """Mode 8: a set-point each cycle, of a motion source or from a profile towards targets."""

    number = OperationMode.CYCLIC_POSITION
    halts_by_bit = False
    cyclic = True
    bits = NO_BITS

    def __init__(self, units: Units, target: Writer, limits: Callable[[], ProfileLimits]) -> None:
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

    def reached(self, statusword: int) -> bool:
        """Whether the profile has ended; bit 10 is none of these modes'."""
        return not self.goes_to_single_target

    def preload(self, actual: Actual) -> Promise[None]:
        """Hold the actual position."""
        self._streamed = None
        position = self._units.position.commanded(actual.position_inc)
        self._profile = SetpointProfile(position, actual.velocity)
        return self._target.deliver(actual.position_inc)

    def set_target(self, target: float) -> Promise[None]:
        """Go to a single target by a profile."""
        self._require_fitting(target)
        self._profile.go(target)
        return IN_THE_IMAGE

    def follow_target(self, target: float) -> Promise[None]:
        """Go to the next target of a stream by a profile that is as even as they come."""
        self._require_fitting(target)
        self._profile.track(target)
        return IN_THE_IMAGE

    @property
    def velocity(self) -> float:
        """Rate of the set-point in user units per second."""
        return self._profile.velocity

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
        self._require_fitting(setpoint)
        self._streamed = setpoint

    def _require_fitting(self, position: float) -> None:
        """Refuse now what could not be sent on arrival."""
        fitting(self._target, self._units.position.to_device(position))

    def step(self, now: float, period: float, statusword: int) -> int:
        """Write the streamed set-point, or the profile's; a stream that ends is braked."""
        if self._streamed is not None:
            self._profile.follow(self._streamed, period)
            self._streamed = None
        else:
            self._profile.step(period, self._limits())
        self._target.write(self._units.position.to_device(self._profile.position))
        return self.bits


class InterpolatedPosition(CyclicPosition):
    """Mode 7: as mode 8, into 0x60C1:1, with bit 4 enabling the interpolation."""

    number = OperationMode.INTERPOLATED_POSITION
    bits = int(Controlword.ENABLE_INTERPOLATION)
