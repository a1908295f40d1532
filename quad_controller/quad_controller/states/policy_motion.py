# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A policy as one of the motions: eased in, given up when it fails."""

from __future__ import annotations

from quad_description import Targets

from ..policy.interface import Policy, PolicyStep
from .motion import Motion, Situation

MAX_BAD_STEPS = 3  # in a row; one may be a glitch, the robot stands on its last targets meanwhile
WIND_DOWN = 0.5  # [s] without velocity before the gait takes over


class PolicyMotion(Motion):
    """Follows a policy.

    Attributes:
        policy: The policy.
        answer: What it answered last; None when there was nothing to ask it by.
        steps: How often it was stepped.
    """

    def __init__(self, policy: Policy, start: Targets, ease_time: float) -> None:
        """Begin where the joints are.

        Args:
            policy: The policy; it is reset.
            start: Last targets of all joints in [rad].
            ease_time: Over how long the policy's targets take over in [s].
        """
        policy.reset(start)
        self.policy = policy
        self.answer: PolicyStep | None = None
        self.steps = 0
        self._start = self._last = start
        self._ease_time = ease_time
        self._time = 0.0
        self._rest_time = 0.0
        self._bad_steps = 0
        self._failure = ''

    @property
    def settled(self) -> bool:
        """Whether the robot has had time to stop, or the policy is of no use any more."""
        return self._rest_time >= WIND_DOWN or bool(self.failure)

    @property
    def failure(self) -> str:
        """Why it was given up; empty while it works."""
        return self._failure

    def step(self, situation: Situation, dt: float) -> Targets:
        """Return the next targets; the last ones when there is nothing to go by."""
        self._rest_time = self._rest_time + dt if situation.velocity.at_rest else 0.0
        inputs = situation.policy_inputs
        self.answer = None
        if inputs is None:
            return self._last
        self.steps += 1
        step = self.answer = self.policy.step(inputs, dt)
        if step.targets is None:
            self._bad_steps += 1
            if self._bad_steps >= MAX_BAD_STEPS:
                self._failure = step.reason
            return self._last
        self._bad_steps = 0
        self._time += dt
        share = min(self._time / self._ease_time, 1.0) if self._ease_time > 0.0 else 1.0
        self._last = tuple(
            a + share * (b - a) for a, b in zip(self._start, step.targets, strict=True)
        )
        return self._last
