# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a step is worth, as weights; terms of walking as in legged_gym (Rudin et al., 2022)."""

from __future__ import annotations

from dataclasses import dataclass, fields
import math

from quad_description.rotations import Vector

from ..exceptions import SetupError
from ..plant.state import Array, BaseVelocity


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """What a step brought about."""

    velocity: BaseVelocity  # how base_link moves
    tilt: float  # angle between its z axis and up in [rad]
    down: Vector  # direction of gravity in base_link
    torques: Array  # of the joints in [N m]
    velocities: Array  # of the joints in [rad/s]
    target_speed: Array  # of the targets since the step before in [rad/s]

    @property
    def power(self) -> float:
        """Of the servos' torques, before the damping of their motors, in [W]."""
        return float(abs(self.torques * self.velocities).sum())

    @property
    def action_rate(self) -> float:
        """Square of the speed of the targets in [rad2/s2]."""
        return float((self.target_speed * self.target_speed).sum())


@dataclass(frozen=True, slots=True)
class RewardWeights:
    """Weights of the terms of a second, of which a step has its part; a fall counts once."""

    tracking: float = 2.0  # exp(-(error / tracking_width)^2) of the linear velocity
    turning: float = 1.0  # exp(-(error / turning_width)^2) of the turning
    vertical: float = -2.0  # square of the velocity up and down in [m2/s2]
    rolling: float = -0.05  # square of the turning about x and y in [rad2/s2]
    level: float = -2.0  # square of the sine of the tilt
    power: float = -0.02  # of the servos' torques, before the damping of their motors, in [W]
    action_rate: float = -0.002  # square of the speed of the targets in [rad2/s2]
    fall: float = -5.0  # of a fall
    tracking_width: float = 0.1  # [m/s]
    turning_width: float = 0.4  # [rad/s]

    def __post_init__(self) -> None:
        """Refuse numbers of which no reward can be made."""
        for field in fields(self):
            value = getattr(self, field.name)
            if not math.isfinite(value) or (field.name.endswith('_width') and value <= 0.0):
                raise SetupError(f'{field.name} {value}: give a finite number, a width above 0')

    def terms(
        self, motion: Motion, commanded: Vector, period: float, *, fallen: bool
    ) -> dict[str, float]:
        """Return what each term is worth in one step.

        Args:
            commanded: Velocity ahead and to the left in [m/s], turning in [rad/s].
        """
        (x, y, up), (roll, pitch, yaw) = motion.velocity.linear, motion.velocity.angular
        wanted_x, wanted_y, wanted_yaw = commanded
        off = math.hypot(x - wanted_x, y - wanted_y)
        tilt = motion.down[0] ** 2 + motion.down[1] ** 2
        rates = {
            'tracking': self.tracking * _nearness(off, self.tracking_width),
            'turning': self.turning * _nearness(yaw - wanted_yaw, self.turning_width),
            'vertical': self.vertical * up * up,
            'rolling': self.rolling * (roll * roll + pitch * pitch),
            'level': self.level * tilt,
            'power': self.power * motion.power,
            'action_rate': self.action_rate * motion.action_rate,
        }
        worth = {name: period * rate for name, rate in rates.items()}
        return worth | {'fall': self.fall if fallen else 0.0}

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the terms."""
        return tuple(field.name for field in fields(self) if not field.name.endswith('_width'))


def _nearness(error: float, width: float) -> float:
    return math.exp(-((error / width) ** 2))
