# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A policy as one of the motions, and which policy that is: eased in, given up when it fails."""

from __future__ import annotations

from quad_description import Targets

from ..policy.observation import Situation
from ..policy.runner import PolicyRunner, PolicyStep
from .motion import Motion
from .status import Asked

NO_POLICY = 'no policy is loaded (parameter policy, or ~/load_policy)'

MAX_BAD_STEPS = 3  # in a row; one may be a glitch, the robot stands on its last targets meanwhile
WIND_DOWN = 0.5  # [s] without velocity before the gait takes over


class PolicyMotion(Motion):
    """Follows a policy."""

    def __init__(self, policy: PolicyRunner, start: Targets, ease_time: float) -> None:
        """Begin where the joints are.

        Args:
            start: Last targets of all joints in [rad].
            ease_time: Over how long the policy's targets take over in [s].
        """
        policy.reset(start)
        self.policy = policy
        # what it answered last; None when there was nothing to ask it by
        self.answer: PolicyStep | None = None
        self.steps = 0  # how often it was stepped
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
        self.answer = None
        if situation.joints is None or situation.imu is None:
            return self._last
        self.steps += 1
        step = self.answer = self.policy.step(situation, dt)
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


class PolicyChoice:
    """Which policy the mode ``policy`` follows, or which is only watched in a dry run.

    Attributes:
        policy: The policy; None for none.
        dry_run: Whether it is only asked, and never followed.
    """

    def __init__(self, policy: PolicyRunner | None, refusal: str, *, dry_run: bool) -> None:
        """Begin with a policy, or with why there is none."""
        self.policy, self._refusal, self.dry_run = policy, refusal, dry_run
        self._watched_steps = 0
        self._asked: Asked | None = None

    @property
    def mode_refusal(self) -> str:
        """Why the policy keeps the robot from the mode ``policy``; empty if it does not."""
        if self.policy is None:
            return self._refusal
        if self.dry_run:
            return 'the policy is only watched in a dry run (parameter policy_dry_run)'
        return ''

    def choose(self, policy: PolicyRunner | None) -> str:
        """Choose another policy; return what becomes of it as long as nothing moves."""
        self.policy, self._watched_steps, self._asked = policy, 0, None
        if policy is None:
            self._refusal = NO_POLICY
            return 'no policy is loaded any more'
        if self.dry_run:
            return f'{policy.name} is watched (parameter policy_dry_run)'
        return f'the mode policy follows {policy.name}'

    def watch(self, situation: Situation, dt: float, last: Targets) -> Targets | None:
        """Return what a policy that is only watched would send, None without one."""
        self._asked = None
        unknown = situation.joints is None or situation.imu is None
        if self.policy is None or not self.dry_run or unknown:
            return None
        if not self._watched_steps:
            self.policy.reset(last)
        self._watched_steps += 1
        answer = self.policy.step(situation, dt)
        self._asked = Asked(self.policy, answer, self._watched_steps)
        return answer.targets

    def asked(self, motion: Motion) -> Asked | None:
        """Return what the policy that is watched, or that moves the robot, was asked last."""
        if self._asked is not None or not isinstance(motion, PolicyMotion):
            return self._asked
        return Asked(motion.policy, motion.answer, motion.steps) if motion.answer else None
