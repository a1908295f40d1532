# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What arm_trajectory raises, beside the errors of arm_model.

::

    CommandError (of arm_model)   a request is refused before anything moves
    └── GoalError                 a trajectory is refused; carries the code of the action
        └── StateMovedError       the arm is elsewhere than where it was planned
"""

from __future__ import annotations

from enum import IntEnum

from arm_model import CommandError


class GoalCode(IntEnum):
    """Codes of control_msgs/action/FollowJointTrajectory."""

    SUCCESSFUL = 0
    INVALID_GOAL = -1
    INVALID_JOINTS = -2
    OLD_HEADER_TIMESTAMP = -3
    PATH_TOLERANCE_VIOLATED = -4
    GOAL_TOLERANCE_VIOLATED = -5


class GoalError(CommandError):
    """A trajectory is refused before anything moves.

    Scenarios: times that do not increase, a joint that the arm lacks, a point beyond a limit.
    """

    def __init__(self, code: GoalCode, reason: str) -> None:
        super().__init__(reason)
        self.code = code


class StateMovedError(GoalError):
    """The arm is elsewhere than where a trajectory was planned; planned anew it may begin."""
