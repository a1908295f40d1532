# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A policy that is asked but not followed, to see what it would do."""

from __future__ import annotations

from quad_description import Targets

from ..policy.interface import Policy
from .motion import Situation
from .status import Asked


class Shadow:
    """Runs a policy beside what really moves the robot.

    Attributes:
        asked: What it was asked in the last step, and answered; None when it was not.
    """

    def __init__(self, policy: Policy) -> None:
        """Use a policy; it is reset in the first step."""
        self._policy = policy
        self._steps = 0
        self.asked: Asked | None = None

    def step(self, situation: Situation, dt: float, last: Targets) -> Targets | None:
        """Return what the policy would send, None when it has nothing to go by or fails.

        Args:
            situation: What is known.
            dt: Duration of the step in [s].
            last: The last targets of all joints in [rad].
        """
        self.asked = None
        inputs = situation.policy_inputs
        if inputs is None:
            return None
        if not self._steps:
            self._policy.reset(last)
        self._steps += 1
        answer = self._policy.step(inputs, dt)
        self.asked = Asked(self._policy, answer, self._steps)
        return answer.targets
