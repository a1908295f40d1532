# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What leaves the motion core in a cycle."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from arm_model import RobotState

from ..report import MotionReport


class Source(Enum):
    """What moves the arm."""

    NONE = 'none'
    JOG = 'jog'
    TRAJECTORY = 'trajectory'
    TARGET = 'target'


JOGGING = (Source.JOG, Source.TARGET)  # what the servo commands
MOTIONS = (*JOGGING, Source.TRAJECTORY)  # what moves the arm


@dataclass(frozen=True, slots=True, eq=False)
class SetPoint:
    """What to command in a cycle."""

    state: RobotState  # positions, velocities and accelerations
    source: Source  # what moves the arm
    report: MotionReport  # what limits the motion
