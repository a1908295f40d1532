# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How a motion ends."""

from __future__ import annotations

from dataclasses import dataclass

from arm_model import ArmError
from arm_trajectory import GoalCode, GoalError


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a motion ended.

    Attributes:
        code: Code of the action's result.
        reason: Why, in words.
        canceled: Whether it was asked to end.
    """

    code: GoalCode
    reason: str
    canceled: bool = False


CONTINUED = Outcome(GoalCode.SUCCESSFUL, 'a further target goes on from it')
"""A single target that was not reached, as another one took its place."""


def refused(error: BaseException) -> Outcome:
    """Return the outcome of a motion that does not begin.

    Args:
        error: Why.
    """
    code = error.code if isinstance(error, GoalError) else GoalCode.INVALID_GOAL
    if isinstance(error, ArmError):
        return Outcome(code, str(error))
    return Outcome(code, f'the motion could not be planned: {type(error).__name__}: {error}')
