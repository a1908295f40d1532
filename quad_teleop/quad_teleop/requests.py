# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a person can ask the robot for besides a velocity."""

from __future__ import annotations

from dataclasses import dataclass

from operator_input import Note, Quit, Suspend

from .body_pose import BodyPose
from .modes import Mode


@dataclass(frozen=True, slots=True)
class ModeRequest:
    """Ask the controller for a mode.

    Attributes:
        mode: Which.
    """

    mode: Mode


@dataclass(frozen=True, slots=True)
class PoseRequest:
    """Let the body stand otherwise.

    Attributes:
        pose: How.
    """

    pose: BodyPose


@dataclass(frozen=True, slots=True)
class ClearFault:
    """Ask the controller to forget its latched faults."""


@dataclass(frozen=True, slots=True)
class StopRobot:
    """Stop the whole robot: gait or policy end, whatever follows the velocity."""


Request = ModeRequest | PoseRequest | ClearFault | StopRobot | Note | Quit | Suspend
