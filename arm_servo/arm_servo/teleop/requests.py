# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a person can ask the servo for besides a motion."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from operator_input import Note, Quit, Suspend


class CommandType(IntEnum):
    """Kinds of commands; as in moveit_msgs/srv/ServoCommandType."""

    JOINT_JOG = 0
    TWIST = 1


@dataclass(frozen=True, slots=True)
class SwitchType:
    """Choose in the servo which kind of command comes.

    Attributes:
        command_type: Which.
    """

    command_type: CommandType


@dataclass(frozen=True, slots=True)
class TogglePause:
    """Pause the servo, or let it go on."""


@dataclass(frozen=True, slots=True)
class StopRobot:
    """Stop the whole robot, whatever moves it."""


Request = SwitchType | TogglePause | StopRobot | Note | Quit | Suspend
