# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How a motion ends."""

from __future__ import annotations

from dataclasses import dataclass

from arm_model import ArmError
from arm_trajectory import GoalCode, GoalError


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a motion ended."""

    code: GoalCode  # code of the action's result
    reason: str  # why, in words
    canceled: bool = False  # whether it was asked to end


CONTINUED = Outcome(GoalCode.SUCCESSFUL, 'a further target goes on from it')
"""A single target that was not reached, as another one took its place."""


def refused(error: BaseException) -> Outcome:
    """Return the outcome of a motion that does not begin."""
    code = error.code if isinstance(error, GoalError) else GoalCode.INVALID_GOAL
    if isinstance(error, ArmError):
        return Outcome(code, str(error))
    return Outcome(code, f'the motion could not be planned: {type(error).__name__}: {error}')
