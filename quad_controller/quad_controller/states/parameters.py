# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Limits of the states, watchdogs and protections."""

from __future__ import annotations

from dataclasses import dataclass
import math

from ..exceptions import ParameterError


@dataclass(frozen=True, slots=True)
class StateParameters:
    """Tuning of everything but the gait and the policy."""

    period: float = 0.02  # nominal time between two steps in [s]
    command_timeout: float = 0.5  # a velocity older than this counts as zero, in [s]
    warn_age: float = 0.06  # joint states and attitude older than this are reported, in [s]
    hold_age: float = 0.2  # older than this, nothing moves on, in [s]
    fault_age: float = 0.5  # older than this is a fault, in [s]
    max_tilt: float = 0.9  # a larger angle between the body's z axis and up is a fall, in [rad]
    max_turn_rate: float = 8.0  # a body that turns faster is falling, in [rad/s]
    fall_time: float = 0.1  # how long it must be so in [s]
    low_battery: float = 0.1  # charge below which the robot lies down; 0 never
    battery_time: float = 3.0  # how long the charge must be lower in [s]
    require_imu: bool = True  # whether the robot may move its legs only with a known attitude
    lie_height: float = 0.055  # hip axes above the centres of the feet when it lies, in [m]
    blend_speed: float = 1.0  # speed of the fastest joint between two poses in [rad/s]
    blend_time: float = 1.0  # shortest time between two poses in [s]
    # how far a joint may be off a set-point that holds it, in [rad]; it follows then
    hold_band: float = 0.25
    # speed of a set-point per speed of its joint; a soft servo that is compensated for has its
    # set-point further ahead, and needs 2
    setpoint_speed_ratio: float = 1.0
    # whether the gait goes on walking when a policy fails, or stands
    policy_fallback_walks: bool = False
    # whether the mode get_up may throw the robot off its back, at full speed
    get_up_swings: bool = False

    def __post_init__(self) -> None:
        """Refuse what makes no sense.

        Raises:
            ParameterError: A value is outside of its range; the message has name and range.
        """
        for name, (least, most) in STATE_RANGES.items():
            value = getattr(self, name)
            if not least <= value <= most:
                raise ParameterError(f'{name} {value} is not within {least} to {most}')
        if not self.warn_age <= self.hold_age <= self.fault_age:
            raise ParameterError(
                f'warn_age {self.warn_age}, hold_age {self.hold_age} and fault_age '
                f'{self.fault_age} must grow in this order'
            )


STATE_RANGES: dict[str, tuple[float, float]] = {
    'period': (0.002, 0.1),
    'command_timeout': (0.05, 10.0),
    'warn_age': (0.01, 5.0),
    'hold_age': (0.02, 5.0),
    'fault_age': (0.05, 10.0),
    'max_tilt': (0.1, math.pi),
    'max_turn_rate': (1.0, 100.0),
    'fall_time': (0.0, 2.0),
    'low_battery': (0.0, 0.9),
    'battery_time': (0.0, 60.0),
    'lie_height': (0.01, 1.0),
    'blend_speed': (0.1, 10.0),
    'blend_time': (0.2, 10.0),
    'setpoint_speed_ratio': (0.05, 5.0),
    'hold_band': (0.02, 3.2),
}
"""Range of each parameter, both ends included; units as in :class:`StateParameters`."""
