# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The two speeds that a person sets while driving."""

from __future__ import annotations

from dataclasses import dataclass, replace

from .exceptions import SettingError

STEP = 0.1  # share by which a key makes faster or slower
MIN_SPEED = 0.01  # [m/s] and [rad/s]: slower is standing, and could not be made faster again


@dataclass(frozen=True, slots=True)
class Speeds:
    """Linear and angular speed, within limits.

    Attributes:
        linear: Speed of walking [m/s].
        angular: Speed of turning [rad/s].
        linear_limit: Highest one [m/s].
        angular_limit: Highest one [rad/s].

    Raises:
        SettingError: A speed is above its limit, or too slow to be one.
    """

    linear: float = 0.15
    angular: float = 0.6
    linear_limit: float = 0.4
    angular_limit: float = 2.0

    def __post_init__(self) -> None:
        """Check the order of the values."""
        for name, speed, limit in (
            ('speed', self.linear, self.linear_limit),
            ('turn', self.angular, self.angular_limit),
        ):
            if not MIN_SPEED <= speed <= limit:
                raise SettingError(
                    f'{name} is {speed}: it must be between {MIN_SPEED} and its limit {limit}; '
                    f'change {name} or {name}_limit'
                )

    def scaled(self, linear: int, angular: int) -> Speeds:
        """Return other speeds by steps of 10 %.

        Args:
            linear: Steps of the linear speed, negative for slower; the limits are kept.
            angular: Steps of the angular speed.
        """
        return replace(
            self,
            linear=_scaled(self.linear, linear, self.linear_limit),
            angular=_scaled(self.angular, angular, self.angular_limit),
        )


def _scaled(speed: float, steps: int, limit: float) -> float:
    return min(max(speed * (1.0 + STEP * steps), MIN_SPEED), limit)
