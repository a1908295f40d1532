# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Limits of the states, watchdogs and protections."""

from __future__ import annotations

from dataclasses import dataclass
import math

from quad_description import EMPTY_BATTERY, MAX_TILT

from ..exceptions import ParameterError
from ..settings import check_settings, setting, switch


@dataclass(frozen=True, slots=True)
class StateParameters:
    """Tuning of everything but the gait and the policy."""

    period: float = setting(0.02, 0.002, 0.1, 'time between two steps [s]')
    command_timeout: float = setting(0.5, 0.05, 10.0, 'an older velocity counts as zero [s]')
    warn_age: float = setting(0.06, 0.01, 5.0, 'older joint states and attitudes are reported [s]')
    hold_age: float = setting(0.2, 0.02, 5.0, 'with older ones nothing moves on [s]')
    fault_age: float = setting(0.5, 0.05, 10.0, 'older ones are a fault [s]')
    max_tilt: float = setting(MAX_TILT, 0.1, math.pi, 'more is a fall [rad]')
    max_turn_rate: float = setting(8.0, 1.0, 100.0, 'a faster body is falling [rad/s]')
    fall_time: float = setting(0.1, 0.0, 2.0, 'how long it must be so [s]')
    low_battery: float = setting(
        EMPTY_BATTERY, 0.0, 0.9, 'charge 0 to 1 below which the robot lies down; 0: never'
    )
    battery_time: float = setting(3.0, 0.0, 60.0, 'how long it must be so [s]')
    require_imu: bool = switch(True, 'no leg moves without a known attitude')
    lie_height: float = setting(
        0.055, 0.01, 1.0, "hip axes above the feet's centres when it lies [m]"
    )
    blend_speed: float = setting(1.0, 0.1, 10.0, 'fastest joint between two poses [rad/s]')
    blend_time: float = setting(1.0, 0.2, 10.0, 'shortest time between two poses [s]')
    hold_band: float = setting(
        0.25, 0.02, 3.2, 'a held joint that is further off is not pulled back [rad]'
    )
    # the set-points of soft servos are ahead of the joints, and faster for a moment; cutting them
    # at the speed of the joints costs a trot 1 to 7 % of its own, with 1.1 to 10 N m/rad
    setpoint_speed_ratio: float = setting(
        1.0, 0.05, 5.0, 'speed of set-points per speed of joints; 2: nothing of a trot is cut'
    )
    policy_fallback_walks: bool = switch(
        False, 'the gait walks on when a policy fails, instead of standing'
    )
    get_up_swings: bool = switch(
        False, 'the mode get_up may throw the robot off its back, at full speed'
    )

    def __post_init__(self) -> None:
        """Refuse what makes no sense.

        Raises:
            ParameterError: A value is outside of its range; the message has name and range.
        """
        check_settings(self)
        if not self.warn_age <= self.hold_age <= self.fault_age:
            raise ParameterError(
                f'warn_age {self.warn_age}, hold_age {self.hold_age} and fault_age '
                f'{self.fault_age} must grow in this order'
            )
