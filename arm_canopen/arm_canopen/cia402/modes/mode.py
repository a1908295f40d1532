# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Base class of the modes of operation (CiA 402-2, clauses 10 to 16), and checks of targets.

A mode writes its target object and returns its bits of the controlword. Every mode is
preloaded with the actual value before the drive is enabled or the mode switched, so that nothing
moves before a command.

Unreachable targets are refused, not clamped: :func:`check_target` refuses targets beyond a limit
or without effect, :meth:`.Scale.to_device` those that do not fit the object.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
import math

from canopen_core import DriveError
from canopen_core.standard import (
    Controlword,
    OperationMode,
    Statusword,
    TORQUE_MODES,
    VELOCITY_MODES,
)

from ...config.model.drive_units import POSITION_TOLERANCE
from ...master.process_image import Writer
from ...master.scheduler import completed, Promise
from ..motion import Setpoint
from ..parameters import DriveParameters
from ..state import Actual
from ..units import Units

TARGET_REACHED = int(Statusword.TARGET_REACHED)
NO_BITS = 0  # plain integers in the cycle, as IntFlag operators are too slow


class OffsetTarget:
    """A target object written as target minus offset, as the drive adds the offset again.

    The offset is read when a target is preloaded: an offset that is written while the drive is
    enabled moves the axis, as its author intends.
    """

    def __init__(self, target: Writer, offset: Callable[[], int]) -> None:
        """``offset`` returns the value of the offset object in device units."""
        self.by_sdo = target.by_sdo
        self._target = target
        self._read = offset
        self._offset = 0

    @property
    def limits(self) -> tuple[float, float]:
        """Smallest and largest sum of target and offset."""
        low, high = self._target.limits
        return low + self._offset, high + self._offset

    def write(self, value: float) -> None:
        """Command a value in device units."""
        self._target.write(value - self._offset)

    def deliver(self, value: float) -> Promise[None]:
        """Command the holding value, using the current offset."""
        self._offset = self._read()
        return self._target.deliver(value - self._offset)


class Mode(ABC):
    """One mode of operation of one drive."""

    number: OperationMode  # its value in 0x6060
    halts_by_bit = True  # bit 8 of the controlword halts it; else the master ramps set-points
    cyclic = False  # the drive follows its target in each cycle
    by_sdo = False  # its target goes by SDO, because no RPDO carries it
    # last commanded position in user units; None if the mode commands no position
    setpoint: float | None = None

    @abstractmethod
    def preload(self, actual: Actual) -> Promise[None]:
        """Discard any target and command the value that holds the drive in place.

        Returns:
            Done when the drive has it; an earlier value of the target object has no effect then.
        """

    @abstractmethod
    def set_target(self, target: float) -> Promise[None]:
        """Accept a single target in user units.

        Returns:
            Done when the drive has it; rejected if the drive refuses it or is stopped before.

        Raises:
            DriveError: The mode has no target, or the value does not fit.
        """

    def follow_target(self, target: float) -> Promise[None]:
        """Accept a target of a stream; like :meth:`set_target` if the drive makes the profile."""
        return self.set_target(target)

    @abstractmethod
    def step(self, now: float, period: float, statusword: int) -> int:
        """Advance by a cycle in which the drive accepts targets; return the controlword bits."""

    def brake(self) -> None:  # noqa: B027  # most modes leave it to the drive
        """Ramp the set-points to rest for a halt, a mode switch or the end of a stream."""

    @property
    def braked(self) -> bool:
        """Whether the set-points stand still; True if the drive makes the profile."""
        return True

    def reached(self, statusword: int) -> bool:
        """Whether the drive has reached the last target, as far as the mode can determine."""
        return bool(statusword & TARGET_REACHED)

    @property
    def taken(self) -> bool:
        """Whether the drive has a target commanded after the last :meth:`brake`."""
        return True


class NoMode(Mode):
    """Mode 0: nothing is commanded."""

    number = OperationMode.NO_MODE

    def preload(self, actual: Actual) -> Promise[None]:
        """Preload nothing."""
        return completed()

    def set_target(self, target: float) -> Promise[None]:
        """Refuse every target."""
        raise DriveError('no mode of operation is selected; select position_mode or another first')

    def step(self, now: float, period: float, statusword: int) -> int:
        """Command nothing."""
        return NO_BITS


class Homing(Mode):
    """Mode 6: bit 4 is set while the drive homes."""

    number = OperationMode.HOMING

    def __init__(self) -> None:
        self.started = False  # whether bit 4 is set

    def preload(self, actual: Actual) -> Promise[None]:
        """Preload nothing: without bit 4 nothing moves."""
        self.started = False
        return completed()

    def set_target(self, target: float) -> Promise[None]:
        """Refuse every target."""
        raise DriveError('the drive is homing and takes no target')

    def step(self, now: float, period: float, statusword: int) -> int:
        """Keep bit 4 while homing runs."""
        return Controlword.HOMING_START if self.started else NO_BITS


NEGLIGIBLE = 2e-3  # share of the profile velocity that may round to 0, as at the end of a stream
NEGLIGIBLE_EFFORT = 1e-3  # [unit of effort] likewise
RANGE_SHARE = 1e-3  # largest rounding error to whole increments, as share of the range (0x607D)


def check_target(
    name: str,
    mode: Mode,
    parameters: DriveParameters,
    units: Units,
    target: float,
    *,
    position: float = math.nan,
) -> None:
    """Refuse a target beyond the limits of the drive, or one without any effect."""
    if mode.setpoint is not None:
        _check_position(name, parameters.position_limits, target, position)
        _check_rounding(name, units, target, parameters.position_limits)
        if mode.number is OperationMode.PROFILE_POSITION and parameters.profile_velocity_inc == 0:
            raise DriveError(
                f'{name}: its profile velocity (0x6081) is 0, so it would not move; write it, for '
                'good in the sdo list of bus.yml'
            )
    elif mode.number in VELOCITY_MODES:
        _check_size(name, parameters.speed_limit, target, 'velocity {:g} (0x607F)')
        _check_effect(
            name,
            units.velocity.raw(target),
            target,
            'scale_vel_to_dev',
            NEGLIGIBLE * parameters.profile.velocity,
        )
    elif mode.number in TORQUE_MODES:
        _check_size(name, parameters.effort_limit, target, 'torque {:g} (0x6072)')
        _check_effect(
            name, units.effort.raw(target), target, 'scale_eff_to_dev', NEGLIGIBLE_EFFORT
        )


def check_setpoint(name: str, mode: Mode, parameters: DriveParameters, setpoint: Setpoint) -> None:
    """Refuse a set-point of a motion source beyond limits; raises as for targets.

    Rounding is not checked: along a path it is half an increment at most.
    """
    before = math.nan if mode.setpoint is None else mode.setpoint
    _check_position(name, parameters.position_limits, setpoint.position, before)
    if mode.number is not OperationMode.CYCLIC_POSITION:
        return  # the other modes have no feed-forward
    _check_size(name, parameters.speed_limit, setpoint.velocity, 'velocity {:g} (0x607F)')
    _check_size(name, parameters.effort_limit, setpoint.effort, 'torque {:g} (0x6072)')


def _check_position(
    name: str, limits: tuple[float, float] | None, target: float, start: float
) -> None:
    """Refuse a position beyond the limits, unless it leads back towards them."""
    if limits is None or limits[0] <= target <= limits[1]:
        return
    if limits[1] < target <= start or start <= target < limits[0]:
        return
    raise DriveError(
        f'{name}: target {target:g} is beyond the software limits '
        f'{limits[0]:g} to {limits[1]:g} (0x607D less 0x607C, in 0x607B)'
    )


def _check_rounding(
    name: str, units: Units, target: float, limits: tuple[float, float] | None
) -> None:
    """Refuse a position that rounding to whole increments changes beyond the tolerance."""
    increments, tolerance = units.position.raw(target), POSITION_TOLERANCE
    nearest = target
    if math.isfinite(increments):
        nearest = units.position.commanded(round(increments))
    if limits is not None:
        tolerance = min(tolerance, RANGE_SHARE * (limits[1] - limits[0]))
    if abs(nearest - target) > tolerance:
        raise DriveError(
            f'{name}: target {target:g} is between two increments, the nearest is {nearest:g}; is '
            'scale_pos_to_dev in bus.yml right? It is increments per user unit'
        )


def _check_effect(name: str, scaled: float, target: float, key: str, negligible: float) -> None:
    """Refuse a nonzero velocity or torque that rounds to 0."""
    if abs(target) > negligible and math.isfinite(scaled) and round(scaled) == 0:
        raise DriveError(
            f'{name}: target {target:g} is {scaled:g} device units, of which the object has whole '
            f'ones only, so it would become 0; is {key} in bus.yml right? It is device units per '
            'user unit'
        )


def _check_size(name: str, limit: float | None, target: float, what: str) -> None:
    if limit is not None and abs(target) > limit:
        raise DriveError(f'{name}: target {target:g} is beyond the greatest {what.format(limit)}')
