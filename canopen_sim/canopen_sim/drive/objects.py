# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The objects of the drive profile that the simulated drive works with (CiA 402-2)."""

from __future__ import annotations

from canopen_core.standard import AXIS_OFFSET, Index, OperationMode, TARGET_OBJECTS

from ..object_store import Integer, ObjectStore
from .axis import Limits

ACCELERATIONS = frozenset(
    {
        Index.PROFILE_ACCELERATION,
        Index.PROFILE_DECELERATION,
        Index.QUICK_STOP_DECELERATION,
        Index.HOMING_ACCELERATION,
        Index.MAX_ACCELERATION,
        Index.MAX_DECELERATION,
    }
)
"""Objects in the unit of acceleration; the ramps of mode 2 are velocities over times."""
NOMINAL_TORQUE = 1000  # [0.1 % of the rated torque]
NO_TORQUE_LIMIT = 0xFFFF
NO_WINDOW = 0xFFFF_FFFF  # 0x6065 and 0x6067: not monitored
MILLISECOND = 0.001  # [s]
UNSET_RAMP = 100_000.0  # [inc/s^2] where a dictionary gives 0 for a ramp
PERIOD_MIN = 0.001  # [s] shortest interpolation period that is believed


class Rate:
    """An object in a drive's own unit, converted to increments per second (or second squared)."""

    __slots__ = ('_kind', '_units', 'variable')

    def __init__(self, variable: Integer, units: list[float], kind: int) -> None:
        self.variable = variable  # the object
        self._units = units
        self._kind = kind

    @property
    def value(self) -> float:
        """Value in [inc/s]."""
        return self.variable.value * self._units[self._kind]

    def put(self, rate: float) -> None:
        """Store a rate in [inc/s], rounded and clamped to the type of the object."""
        self.variable.put(rate / self._units[self._kind])


class DriveObjects:
    """All objects of a drive, bound once; units are increments, and [inc/s] of velocities.

    Objects missing in the dictionary get a harmless value and stay invisible.
    """

    def __init__(  # noqa: PLR0915  # a table of objects
        self, store: ObjectStore, axis: int = 0, rate_units: tuple[float, float] = (1.0, 1.0)
    ) -> None:
        """Bind the objects of an axis, numbered from 0; axis n has an index offset of 0x800 n."""

        def bind(index: int, subindex: int = 0, *, default: int = 0) -> Integer:
            return store.integer(index + self._offset, subindex, default=default)

        def rate(index: int, subindex: int = 0, *, default: int = 0) -> Rate:
            variable = bind(index, subindex, default=default)
            return Rate(variable, self.rate_units, index in ACCELERATIONS)

        # what 1 of its velocities is in [inc/s], of its accelerations in [inc/s^2]
        self.rate_units = list(rate_units)
        self._dictionary = store.dictionary
        self._offset = axis * AXIS_OFFSET
        self.abort_connection = bind(Index.ABORT_CONNECTION_OPTION, default=1)
        self.error_code = bind(Index.ERROR_CODE)
        self.controlword = bind(Index.CONTROLWORD)
        self.statusword = bind(Index.STATUSWORD)
        self.quick_stop_option = bind(Index.QUICK_STOP_OPTION, default=2)
        self.shutdown_option = bind(Index.SHUTDOWN_OPTION)
        self.disable_option = bind(Index.DISABLE_OPTION, default=1)
        self.halt_option = bind(Index.HALT_OPTION, default=1)
        self.fault_option = bind(Index.FAULT_REACTION_OPTION, default=2)
        self.mode = bind(Index.MODE_OF_OPERATION)
        self.mode_display = bind(Index.MODE_OF_OPERATION_DISPLAY)
        self.supported_modes = bind(Index.SUPPORTED_MODES, default=0xFFFF_FFFF)

        self.position_demand = bind(Index.POSITION_DEMAND)
        self.position_internal = bind(Index.POSITION_ACTUAL_INTERNAL)
        self.position_actual = bind(Index.POSITION_ACTUAL)
        self.velocity_demand = rate(Index.VELOCITY_DEMAND)
        self.velocity_actual = rate(Index.VELOCITY_ACTUAL)
        self.following_error = bind(Index.FOLLOWING_ERROR)

        self.following_window = bind(Index.FOLLOWING_ERROR_WINDOW, default=NO_WINDOW)
        self.following_timeout = bind(Index.FOLLOWING_ERROR_TIMEOUT)  # [ms]
        self.position_window = bind(Index.POSITION_WINDOW, default=NO_WINDOW)
        self.position_window_time = bind(Index.POSITION_WINDOW_TIME)  # [ms]
        self.velocity_window = rate(Index.VELOCITY_WINDOW, default=100)
        self.velocity_window_time = bind(Index.VELOCITY_WINDOW_TIME)  # [ms]
        self.velocity_threshold = rate(Index.VELOCITY_THRESHOLD, default=10)
        self.velocity_threshold_time = bind(Index.VELOCITY_THRESHOLD_TIME)  # [ms]

        self.target_position = bind(Index.TARGET_POSITION)
        self.target_velocity = rate(Index.TARGET_VELOCITY)
        self.interpolation_target = bind(Index.INTERPOLATION_DATA, 1)
        self.interpolation_period = bind(Index.INTERPOLATION_PERIOD, 1, default=10)
        self.interpolation_exponent = bind(Index.INTERPOLATION_PERIOD, 2, default=-3)
        self.home_offset = bind(Index.HOME_OFFSET)
        self.position_offset = bind(Index.POSITION_OFFSET)
        self.velocity_offset = rate(Index.VELOCITY_OFFSET)
        self.buffer_maximum = bind(Index.INTERPOLATION_CONFIGURATION, 1, default=1)
        self.buffer_size = bind(Index.INTERPOLATION_CONFIGURATION, 2, default=1)
        self.buffer_clear = bind(Index.INTERPOLATION_CONFIGURATION, 6, default=1)
        self.homing_method = bind(Index.HOMING_METHOD)
        self.homing_speed_switch = rate(Index.HOMING_SPEEDS, 1, default=100)
        self.homing_speed_zero = rate(Index.HOMING_SPEEDS, 2, default=10)
        self.homing_acceleration = rate(Index.HOMING_ACCELERATION)
        self.digital_inputs = bind(Index.DIGITAL_INPUTS)

        self.limit_low = bind(Index.SOFTWARE_POSITION_LIMIT, 1)
        self.limit_high = bind(Index.SOFTWARE_POSITION_LIMIT, 2)
        self.max_velocity = rate(Index.MAX_PROFILE_VELOCITY)
        self.profile_velocity = rate(Index.PROFILE_VELOCITY)
        self.profile_acceleration = rate(Index.PROFILE_ACCELERATION)
        self.profile_deceleration = rate(Index.PROFILE_DECELERATION)
        self.quick_stop_deceleration = rate(Index.QUICK_STOP_DECELERATION)
        self.max_motor_speed = rate(Index.MAX_MOTOR_SPEED)
        self.max_acceleration = rate(Index.MAX_ACCELERATION)
        self.max_deceleration = rate(Index.MAX_DECELERATION)
        self.max_slippage = rate(Index.MAX_SLIPPAGE)

        self.vl_target = rate(Index.VL_TARGET_VELOCITY)
        self.vl_demand = rate(Index.VL_VELOCITY_DEMAND)
        self.vl_actual = rate(Index.VL_VELOCITY_ACTUAL)
        self.vl_min = rate(Index.VL_VELOCITY_MIN_MAX, 1)
        self.vl_max = rate(Index.VL_VELOCITY_MIN_MAX, 2)
        ramps = (Index.VL_ACCELERATION, Index.VL_DECELERATION, Index.VL_QUICK_STOP)
        self._vl_ramps = [(rate(ramp, 1), bind(ramp, 2, default=1)) for ramp in ramps]

        self.target_torque = bind(Index.TARGET_TORQUE)
        self.torque_offset = bind(Index.TORQUE_OFFSET)
        self.torque_demand = bind(Index.TORQUE_DEMAND)
        self.torque_actual = bind(Index.TORQUE_ACTUAL)
        self.current_actual = bind(Index.CURRENT_ACTUAL)
        self.dc_voltage = bind(Index.DC_LINK_VOLTAGE)
        self.torque_slope = bind(Index.TORQUE_SLOPE)
        self.max_torque = bind(Index.MAX_TORQUE, default=NOMINAL_TORQUE)
        self.positive_torque = bind(Index.POSITIVE_TORQUE_LIMIT, default=NO_TORQUE_LIMIT)
        self.negative_torque = bind(Index.NEGATIVE_TORQUE_LIMIT, default=NO_TORQUE_LIMIT)

    @property
    def possible_modes(self) -> int:
        """Bits of 0x6502 for the modes that the objects of the dictionary allow."""
        modes = [
            mode
            for mode, (index, subindex) in TARGET_OBJECTS.items()
            if (index + self._offset, subindex) in self._dictionary
        ]
        if (Index.HOMING_METHOD + self._offset, 0) in self._dictionary:
            modes.append(OperationMode.HOMING)
        return sum(mode.support_bit for mode in modes)

    @property
    def speed(self) -> float:
        """Highest speed of the motor in [inc/s]; 0x607F = 0 means no limit."""
        profile = float(self.max_velocity.value) or float('inf')
        return min(profile, float(self.max_motor_speed.value) or float('inf'))

    @property
    def slow_down(self) -> float:
        """Deceleration of the slow down ramp in [inc/s^2]."""
        mode = self.mode_display.value
        if mode == OperationMode.VELOCITY:
            return self._vl_ramp(1)
        if mode == OperationMode.HOMING:
            return self.homing_ramp
        return _ramp(self.profile_deceleration, self.max_deceleration)

    @property
    def homing_ramp(self) -> float:
        """Homing acceleration in [inc/s^2]."""
        return float(self.homing_acceleration.value) or UNSET_RAMP

    @property
    def quick_stop(self) -> float:
        """Deceleration of the quick stop ramp in [inc/s^2]."""
        if self.mode_display.value == OperationMode.VELOCITY:
            return self._vl_ramp(2)
        return float(self.quick_stop_deceleration.value) or UNSET_RAMP

    def _vl_ramp(self, which: int) -> float:
        speed, time = self._vl_ramps[which]
        return speed.value / time.value if speed.value and time.value else UNSET_RAMP

    @property
    def velocity_mode_limits(self) -> Limits:
        """Limits of the velocity mode: 0x6046, 0x6048 and 0x6049."""
        highest = float(self.vl_max.value) or float('inf')
        return Limits(min(highest, self.speed), self._vl_ramp(0), self._vl_ramp(1))

    def held_torque(self, torque: float) -> float:
        """Clamp a torque to 0x6072, 0x60E0 and 0x60E1 in [0.1 % of the rated torque]."""
        high = min(self.max_torque.value, self.positive_torque.value)
        low = min(self.max_torque.value, self.negative_torque.value)
        return float(min(max(torque, -low), high))

    def profile(self, velocity: float) -> Limits:
        """Return the present limits of a profile with a velocity in [inc/s]."""
        return Limits(
            min(velocity, self.speed),
            _ramp(self.profile_acceleration, self.max_acceleration),
            self.slow_down,
        )

    @property
    def setpoint_period(self) -> float:
        """Interpolation time period 0x60C2 in [s]."""
        period = self.interpolation_period.value * 10.0**self.interpolation_exponent.value
        return max(period, PERIOD_MIN)

    def position_limits(self) -> tuple[float, float]:
        """Return the software position limits in [inc]; infinite when 0x607D sets none.

        They are relative to home, so the home offset is subtracted (CiA 402-2, 10.4).
        """
        low, high, offset = self.limit_low.value, self.limit_high.value, self.home_offset.value
        return (low - offset, high - offset) if low < high else (float('-inf'), float('inf'))

    def within_limits(self, position: float, start: float) -> float:
        """Return the position, or the limit that a move to it from a start reaches first."""
        low, high = self.position_limits()
        return min(max(position, min(low, start)), max(high, start))


def _ramp(profile: Rate, maximum: Rate) -> float:
    """Return the ramp of a profile within its maximum; 0 in either means that it is not set."""
    ramp = float(profile.value) or UNSET_RAMP
    return min(ramp, float(maximum.value) or UNSET_RAMP)
