# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the demo knows of the robot at a moment."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
import math

from .period_statistics import PeriodFigures
from .segments import STANDSTILL, Velocity

UNKNOWN = 'unknown'


@dataclass(frozen=True, slots=True)
class Figures:
    """What was received last.

    Attributes:
        state: State of the controller, as it calls it.
        fault: Its faults in words, empty without any.
        commanded: Velocity that is commanded.
        measured: Velocity of the simulated body over the last second, None without ground truth.
        odometry: The same of /odom.
        height: Height of base_link above the ground in [m].
        tilt: Angle of the body from the horizontal in [rad].
        tilt_max: Greatest of it since the robot began to walk, in [rad].
        targets: Joint targets in [rad] by name.
        positions: Joint positions in [rad] by name.
        periods: Of /joint_command.
        battery: Charge in [%].
    """

    state: str = UNKNOWN
    fault: str = ''
    commanded: Velocity = STANDSTILL
    measured: Velocity | None = None
    odometry: Velocity | None = None
    height: float = math.nan
    tilt: float = math.nan
    tilt_max: float = math.nan
    targets: Mapping[str, float] = field(default_factory=dict)
    positions: Mapping[str, float] = field(default_factory=dict)
    periods: PeriodFigures = PeriodFigures()  # noqa: RUF009  # frozen
    battery: float = math.nan
