# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Exceptions of arm_planning, besides those of arm_model.

::

    ArmError (of arm_model)
    ├── PlanningError   a request is refused, or no motion was found; carries MoveIt's code
    └── ConfigError     a file or parameter of MoveIt's names is broken; names file, line and key
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from enum import IntEnum

from arm_model import ArmError


class PlanningCode(IntEnum):
    """Codes of moveit_msgs/msg/MoveItErrorCodes of Jazzy; UNABLE_TO_AQUIRE is spelled as there."""

    UNDEFINED = 0
    SUCCESS = 1
    FAILURE = 99999
    PLANNING_FAILED = -1
    INVALID_MOTION_PLAN = -2
    MOTION_PLAN_INVALIDATED_BY_ENVIRONMENT_CHANGE = -3
    CONTROL_FAILED = -4
    UNABLE_TO_AQUIRE_SENSOR_DATA = -5
    TIMED_OUT = -6
    PREEMPTED = -7
    START_STATE_IN_COLLISION = -10
    START_STATE_VIOLATES_PATH_CONSTRAINTS = -11
    GOAL_IN_COLLISION = -12
    GOAL_VIOLATES_PATH_CONSTRAINTS = -13
    GOAL_CONSTRAINTS_VIOLATED = -14
    INVALID_GROUP_NAME = -15
    INVALID_GOAL_CONSTRAINTS = -16
    INVALID_ROBOT_STATE = -17
    INVALID_LINK_NAME = -18
    INVALID_OBJECT_NAME = -19
    FRAME_TRANSFORM_FAILURE = -21
    COLLISION_CHECKING_UNAVAILABLE = -22
    ROBOT_STATE_STALE = -23
    SENSOR_INFO_STALE = -24
    COMMUNICATION_FAILURE = -25
    START_STATE_INVALID = -26
    GOAL_STATE_INVALID = -27
    UNRECOGNIZED_GOAL_TYPE = -28
    CRASH = -29
    ABORT = -30
    NO_IK_SOLUTION = -31


class PlanningError(ArmError):
    """A request is refused, or no motion was found.

    Scenarios: the start is in contact, the goal is out of reach, no path in the time allowed.
    """

    def __init__(self, code: PlanningCode, reason: str) -> None:
        super().__init__(reason)
        self.code = code


@contextmanager
def coded(code: PlanningCode | None = None, place: str = '') -> Iterator[None]:
    """Convert refusals to a PlanningError; None keeps their code. A place begins the message."""
    try:
        yield
    except ArmError as error:
        known = error.code if isinstance(error, PlanningError) else PlanningCode.FAILURE
        reason = f'{place}: {error}' if place else str(error)
        raise PlanningError(known if code is None else code, reason) from error


class ConfigError(ArmError):
    """A MoveIt Setup Assistant package, or a parameter with one of its names, is invalid.

    Scenarios: a file is not YAML, a limit is not a number, a group names an unknown planner.
    """
