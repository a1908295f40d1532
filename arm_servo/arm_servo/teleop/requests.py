# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a person can ask for besides a motion."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum


class CommandType(IntEnum):
    """Kinds of commands; as in moveit_msgs/srv/ServoCommandType."""

    JOINT_JOG = 0
    TWIST = 1


@dataclass(frozen=True, slots=True)
class SwitchType:
    """Tell the servo which kind of command comes.

    Attributes:
        command_type: Which.
    """

    command_type: CommandType


@dataclass(frozen=True, slots=True)
class TogglePause:
    """Pause the servo, or let it go on."""


@dataclass(frozen=True, slots=True)
class Note:
    """Tell the person something.

    Attributes:
        text: What.
    """

    text: str


@dataclass(frozen=True, slots=True)
class Quit:
    """End the program."""


@dataclass(frozen=True, slots=True)
class Suspend:
    """Give the terminal back to the shell for a while."""


Request = SwitchType | TogglePause | Note | Quit | Suspend
