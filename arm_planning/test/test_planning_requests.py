# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Values of arm_planning agree with what MoveIt's clients send and expect."""

from __future__ import annotations

import numpy as np
import pytest

from arm_model import ArmError, frozen
from arm_planning import JointGoal, MotionRequest, PlanningCode, PlanningError


def test_an_error_has_its_code_and_its_reason() -> None:
    """Whoever catches errors of arms catches it, and can answer a client."""
    with pytest.raises(ArmError, match='panda_hand touches table') as caught:
        raise PlanningError(PlanningCode.GOAL_IN_COLLISION, 'panda_hand touches table')
    assert isinstance(caught.value, PlanningError)
    assert int(caught.value.code) == -12


def test_defaults_are_those_of_move_group_interface() -> None:
    """Full speed, one attempt, five seconds, the default planner."""
    request = MotionRequest(frozen(np.zeros(7)), [JointGoal(frozen(np.ones(7)))])
    assert (request.timeout, request.attempts, request.planner_id) == (5.0, 1, '')
    assert (request.velocity_scaling, request.acceleration_scaling) == (1.0, 1.0)
