# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The objects of the drive profile that the simulated drive works with (CiA 402-2)."""

from __future__ import annotations

from ..standard.objects import Index
from .object_store import ObjectStore
from .profile import Limits

NO_WINDOW = 0xFFFF_FFFF  # 0x6065 and 0x6067: not monitored
MILLISECOND = 0.001  # [s]
UNSET_RAMP = 100_000.0  # [inc/s^2] where a dictionary gives 0 for a ramp
PERIOD_MIN = 0.001  # [s] shortest interpolation period that is believed


class DriveObjects:
    """All objects of a drive, bound once; units are raw increments.

    Those that a dictionary lacks get a harmless value and stay invisible.
    """

    def __init__(self, store: ObjectStore) -> None:
        """Bind them."""
        bind = store.integer
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
        self.position_actual = bind(Index.POSITION_ACTUAL)
        self.velocity_demand = bind(Index.VELOCITY_DEMAND)
        self.velocity_actual = bind(Index.VELOCITY_ACTUAL)
        self.following_error = bind(Index.FOLLOWING_ERROR)

        self.following_window = bind(Index.FOLLOWING_ERROR_WINDOW, default=NO_WINDOW)
        self.following_timeout = bind(Index.FOLLOWING_ERROR_TIMEOUT)  # [ms]
        self.position_window = bind(Index.POSITION_WINDOW, default=NO_WINDOW)
        self.position_window_time = bind(Index.POSITION_WINDOW_TIME)  # [ms]
        self.velocity_window = bind(Index.VELOCITY_WINDOW, default=100)
        self.velocity_window_time = bind(Index.VELOCITY_WINDOW_TIME)  # [ms]
        self.velocity_threshold = bind(Index.VELOCITY_THRESHOLD, default=10)
        self.velocity_threshold_time = bind(Index.VELOCITY_THRESHOLD_TIME)  # [ms]

        self.target_position = bind(Index.TARGET_POSITION)
        self.target_velocity = bind(Index.TARGET_VELOCITY)
        self.interpolation_target = bind(Index.INTERPOLATION_DATA, 1)
        self.interpolation_period = bind(Index.INTERPOLATION_PERIOD, 1, default=10)
        self.interpolation_exponent = bind(Index.INTERPOLATION_PERIOD, 2, default=-3)
        self.home_offset = bind(Index.HOME_OFFSET)
        self.homing_method = bind(Index.HOMING_METHOD)

        self.limit_low = bind(Index.SOFTWARE_POSITION_LIMIT, 1)
        self.limit_high = bind(Index.SOFTWARE_POSITION_LIMIT, 2)
        self.max_velocity = bind(Index.MAX_PROFILE_VELOCITY)
        self.profile_velocity = bind(Index.PROFILE_VELOCITY)
        self.profile_acceleration = bind(Index.PROFILE_ACCELERATION)
        self.profile_deceleration = bind(Index.PROFILE_DECELERATION)
        self.quick_stop_deceleration = bind(Index.QUICK_STOP_DECELERATION)

    @property
    def speed(self) -> float:
        """Highest speed of the motor in [inc/s]; 0x607F = 0 means no limit."""
        return float(self.max_velocity.value) or float('inf')

    @property
    def slow_down(self) -> float:
        """Deceleration of the slow down ramp in [inc/s^2]."""
        return float(self.profile_deceleration.value) or UNSET_RAMP

    @property
    def quick_stop(self) -> float:
        """Deceleration of the quick stop ramp in [inc/s^2]."""
        return float(self.quick_stop_deceleration.value) or UNSET_RAMP

    def profile(self, velocity: float) -> Limits:
        """Return the limits of a profile with a velocity in [inc/s], as they are now."""
        return Limits(
            min(velocity, self.speed),
            float(self.profile_acceleration.value) or UNSET_RAMP,
            self.slow_down,
        )

    @property
    def setpoint_period(self) -> float:
        """Interpolation time period 0x60C2 in [s]."""
        period = self.interpolation_period.value * 10.0**self.interpolation_exponent.value
        return max(period, PERIOD_MIN)

    def position_limits(self) -> tuple[float, float]:
        """Return the software position limits in [inc]; infinite when 0x607D sets none."""
        low, high = self.limit_low.value, self.limit_high.value
        return (low, high) if low < high else (float('-inf'), float('inf'))

    def within_limits(self, position: float) -> float:
        """Return the position, or the software limit that is in its way."""
        low, high = self.position_limits()
        return min(max(position, low), high)
