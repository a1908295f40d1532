# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What is otherwise in each episode, so that a policy learns to live with it: as data."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
import math
from typing import Any

import numpy as np

from ..exceptions import SetupError
from ..physics.variation import Variation
from ..plant.state import BOARD, Noise, NONE

Range = tuple[float, float]
# as in Variation
_VARIED = (
    *('friction', 'trunk_mass', 'stiffness', 'damping'),
    *('delay', 'backlash', 'refresh', 'bumps'),
)
_FIXED = {'kick_interval', 'noise'}  # no ranges


def check_range(name: str, span: Range) -> None:
    """Refuse what is not two finite numbers, the lower one first.

    Raises:
        SetupError: With the name.
    """
    if len(span) != 2 or not -math.inf < span[0] <= span[1] < math.inf:
        raise SetupError(f'{name} {span}: give two finite numbers, the lower one first')


@dataclass(frozen=True, slots=True)
class Randomization:
    """Ranges from which each episode draws, all alike likely."""

    friction: Range = (0.4, 1.3)  # under the feet
    trunk_mass: Range = (0.9, 1.25)  # factor of the mass of the trunk
    stiffness: Range = (0.8, 1.2)  # factor of the servos' stiffness; alike likely in ratio
    damping: Range = (0.8, 1.2)  # factor of their damping
    delay: Range = (0.0, 0.04)  # of targets, beside that of the servos, in [s]
    backlash: Range = (0.0, 0.01)  # free play, beside that of the servos, in [rad]
    refresh: Range = (0.0, 0.04)  # time between two targets, beside that of the servos, in [s]
    bumps: Range = (0.0, 1.0)  # factor of the height of the terrain's
    gyro_bias: Range = (-0.05, 0.05)  # of each axis of the gyro in [rad/s]
    level_bias: Range = (-0.02, 0.02)  # of measured roll and pitch in [rad]
    kick: Range = (-0.4, 0.4)  # change of the velocity at once, ahead and to the side, in [m/s]
    kick_interval: float = 4.0  # mean time between two kicks in [s]; 0 for none
    noise: Noise = BOARD  # of the sensors

    def __post_init__(self) -> None:
        """Refuse what nothing can be drawn from."""
        for field in fields(self):
            if field.name not in _FIXED:
                check_range(field.name, getattr(self, field.name))
        for end in (0, 1):  # refuses what no robot has
            Variation(*(getattr(self, name)[end] for name in _VARIED))
        if not 0.0 <= self.kick_interval < math.inf:
            raise SetupError(f'kick_interval {self.kick_interval} s: give 0 or a finite time')

    def variation(self, random: np.random.Generator) -> Variation:
        """Draw a robot and its ground."""
        drawn = {name: float(random.uniform(*getattr(self, name))) for name in _VARIED}
        softest, stiffest = map(math.log, self.stiffness)
        return Variation(**drawn | {'stiffness': math.exp(random.uniform(softest, stiffest))})

    def scaled(self, share: float) -> Randomization:
        """Return ranges that are nearer to the robot as it is; kicks are weaker. Noise stays.

        Args:
            share: 0 for the robot as it is, 1 for these ranges.

        Raises:
            SetupError: The share is not from 0 to 1.
        """
        if not 0.0 <= share <= 1.0:
            raise SetupError(f'share {share}: give 0 to 1')
        spans: dict[str, Any] = {
            field.name: tuple(
                (1.0 - share) * none + share * end
                for none, end in zip(
                    getattr(NO_RANDOMIZATION, field.name), getattr(self, field.name), strict=True
                )
            )
            for field in fields(self)
            if field.name not in _FIXED
        }
        return replace(self, **spans)


NO_RANDOMIZATION = Randomization(
    friction=(0.8, 0.8),
    trunk_mass=(1.0, 1.0),
    stiffness=(1.0, 1.0),
    damping=(1.0, 1.0),
    delay=(0.0, 0.0),
    backlash=(0.0, 0.0),
    refresh=(0.0, 0.0),
    bumps=(1.0, 1.0),
    gyro_bias=(0.0, 0.0),
    level_bias=(0.0, 0.0),
    kick=(0.0, 0.0),
    kick_interval=0.0,
    noise=NONE,
)
"""The robot as it is, on level ground, with ideal sensors."""
