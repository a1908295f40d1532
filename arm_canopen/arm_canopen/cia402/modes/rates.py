# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Modes that command a velocity or a torque: 2, 3 and 9, 4 and 10.

In the profile modes (2, 3, 4) the drive makes the ramp; in the cyclic synchronous ones (9, 10) it
follows each value at once, so the master makes it.
"""

from __future__ import annotations

from collections.abc import Callable

from canopen_core.standard import OperationMode

from ...master.process_image import IN_THE_IMAGE, Writer
from ...master.scheduler import completed, Promise
from ..state import Actual
from ..units import Scale
from .mode import Mode, NO_BITS

VL_RAMP = 0x70
"""Bits 4 to 6 of the velocity mode: ramp enabled, not locked, reference used (CiA 402-2, 16.3)."""


class DriveRamped(Mode):
    """Base of the modes in which the drive ramps to the target."""

    bits = NO_BITS

    def __init__(self, target: Writer, scale: Scale) -> None:
        self.by_sdo = target.by_sdo
        self._target = target
        self._scale = scale
        self._delivery = completed()

    @property
    def taken(self) -> bool:
        """Whether the drive has the last commanded value."""
        return self._delivery.done and self._delivery.error is None

    def set_target(self, target: float) -> Promise[None]:
        """Command a value."""
        return self._deliver(self._scale.to_device(target, self._target.limits))

    def brake(self) -> None:
        """Command standstill; the drive makes the ramp."""
        self._deliver(0)

    def step(self, now: float, period: float, statusword: int) -> int:
        """Do nothing: the drive makes the ramp."""
        return self.bits

    def _deliver(self, value: int) -> Promise[None]:
        self._delivery = self._target.deliver(value)
        return self._delivery


class ProfileVelocity(DriveRamped):
    """Mode 3: velocity 0x60FF in user units per second."""

    number = OperationMode.PROFILE_VELOCITY

    def preload(self, actual: Actual) -> Promise[None]:
        """Command standstill."""
        return self._deliver(0)


class Velocity(ProfileVelocity):
    """Mode 2 of frequency converters: velocity in 0x6042, an INTEGER16."""

    number = OperationMode.VELOCITY
    bits = VL_RAMP


class ProfileTorque(DriveRamped):
    """Mode 4: torque 0x6071 in units of effort."""

    number = OperationMode.PROFILE_TORQUE

    def preload(self, actual: Actual) -> Promise[None]:
        """Command the actual torque, so that the drive does not drop a load."""
        return self._deliver(actual.torque)

    def brake(self) -> None:
        """Rely on bit 8: commanding zero torque would drop a load."""


class MasterRamped(Mode):
    """Base of the modes in which the master ramps the value, cycle by cycle."""

    cyclic = True

    def __init__(
        self,
        target: Writer,
        scale: Scale,
        slope: Callable[[], float],
        braking: Callable[[], float] | None = None,
    ) -> None:
        """Begin at zero.

        Args:
            slope: Greatest change away from zero in user units per second.
            braking: Greatest change towards zero, likewise; None for ``slope``.
        """
        self._target = target
        self._scale = scale
        self._slope, self._braking = slope, braking or slope
        self._value = 0.0
        self._goal = 0.0

    def set_target(self, target: float) -> Promise[None]:
        """Ramp to a value."""
        # refuse now a target that could not be sent at the end of the ramp
        self._scale.to_device(target, self._target.limits)
        self._goal = target
        return IN_THE_IMAGE

    def brake(self) -> None:
        """Ramp to zero."""
        self._goal = 0.0

    def step(self, now: float, period: float, statusword: int) -> int:
        """Advance the ramp."""
        difference = self._goal - self._value
        change = (self._braking if difference * self._value < 0.0 else self._slope)() * period
        step = max(-change, min(change, difference))
        if self._value * (self._value + step) < 0.0:  # the other slope applies beyond zero
            step = -self._value
        self._value += step
        self._target.write(self._scale.to_device(self._value))
        return NO_BITS


class CyclicVelocity(MasterRamped):
    """Mode 9: velocity 0x60FF in user units per second, each cycle."""

    number = OperationMode.CYCLIC_VELOCITY
    halts_by_bit = False

    @property
    def braked(self) -> bool:
        """Whether standstill is commanded."""
        return self._value == 0.0

    def preload(self, actual: Actual) -> Promise[None]:
        """Start at the actual velocity and ramp to zero."""
        self._value, self._goal = self._scale.commanded(actual.velocity_dev), 0.0
        return self._target.deliver(actual.velocity_dev)


class CyclicTorque(MasterRamped):
    """Mode 10: torque 0x6071 in units of effort, each cycle.

    A torque cannot be braked by another torque, so the drive itself stops the axis (bit 8).
    """

    number = OperationMode.CYCLIC_TORQUE

    def brake(self) -> None:
        """Rely on bit 8, and stop the ramp: the present torque may hold a load."""
        self._goal = self._value

    def preload(self, actual: Actual) -> Promise[None]:
        """Command the actual torque, so that the drive does not drop a load."""
        self._value = self._goal = self._scale.commanded(actual.torque)
        return self._target.deliver(actual.torque)
