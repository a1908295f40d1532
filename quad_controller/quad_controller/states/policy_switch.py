# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Which policy is loaded, and how another one takes its place, also while the robot walks."""

from __future__ import annotations

from quad_description import Targets

from ..policy.interface import Policy
from .handover import BLEND_TIME, Handover, Phase, PROBATION_TIME
from .machine import StateMachine
from .modes import Answer, GAIT_STATES, State
from .motion import Situation
from .policy_motion import PolicyMotion
from .shadow import Shadow
from .status import Asked, Event, EventKind
from .watchdogs import Watchdogs

NO_POLICY = 'no policy is loaded (parameter policy, or ~/load_policy)'

GAIT_NAME = 'the gait'
"""What is followed without a policy."""


class PolicySwitch:
    """Has the state machine follow one policy after another.

    Attributes:
        policy: What the mode ``policy`` follows; None for nothing.
    """

    def __init__(
        self, machine: StateMachine, policy: Policy | None, refusal: str, *, dry_run: bool
    ) -> None:
        """Begin with the policy that the machine has.

        Args:
            machine: Follows what is chosen.
            policy: The policy.
            refusal: Why there is none.
            dry_run: Whether a policy is only asked, and never followed.
        """
        self.policy = policy
        self._machine, self._refusal, self._dry_run = machine, refusal, dry_run
        self._shadow = self._shadow_of(policy)
        self._handover: Handover | None = None
        self._former: Policy | None = None  # that the handover leads back to
        self._reported_phase: Phase | None = None

    @property
    def mode_refusal(self) -> str:
        """Why the policy keeps the robot from the mode ``policy``; empty if it does not."""
        if self.policy is None:
            return self._refusal
        if self._dry_run:
            return 'the policy is only watched in a dry run (parameter policy_dry_run)'
        return ''

    @property
    def is_handing_over(self) -> bool:
        """Whether one policy takes the place of another at the moment."""
        return self._handover is not None

    @property
    def moves(self) -> bool:
        """Whether another policy would move the robot at once."""
        return self._machine.can_hand_over and not self._dry_run

    @property
    def followed(self) -> str:
        """Name of what moves the robot, or would in the mode policy."""
        state = self._machine.state
        is_followed = state is State.POLICY or state not in GAIT_STATES
        return _name(self.policy) if is_followed else GAIT_NAME

    @property
    def text(self) -> str:
        """Name of the policy, and how far its handover is; empty without either."""
        if self._handover is not None:
            return f'{_name(self.policy)}: {self._handover.phase.value}'
        return self.policy.name if self.policy is not None else ''

    def follow(
        self, policy: Policy | None, last: Targets | None, watchdogs: Watchdogs | None
    ) -> Answer:
        """Follow another policy from now on, or the gait; for when nothing is against it.

        Args:
            policy: Which one; None for the gait.
            last: The last targets of all joints in [rad]; None before the first.
            watchdogs: What ends the policy on its probation; None for one that is trusted.
        """
        machine = self._machine
        moves, leaves = self.moves, policy is None and machine.state is not State.POLICY
        former, self._former = self.followed, self.policy
        self._set(policy)
        if not moves or leaves or last is None:
            return Answer(True, self._installed(policy))
        self._handover = handover = machine.hand_over(policy, last, watchdogs)
        self._reported_phase = None
        if policy is None:
            return Answer(True, f'from {former} to the gait, within {BLEND_TIME:g} s')
        return Answer(
            True,
            f'from {former} to {policy.name} within {BLEND_TIME:g} s, after it has watched for '
            f'{handover.warm_up:g} s; then it is on probation for {PROBATION_TIME:g} s',
        )

    def step(self) -> list[Event]:
        """Report how far a handover is, and end it; one that a fault ended is undone."""
        handover, machine = self._handover, self._machine
        if handover is None:
            return []
        name, former = _name(self.policy), _name(self._former)
        events = []
        if machine.motion is not handover:
            self._handover = None
            if machine.state is not State.FAULT and not handover.reason:
                return []
            self._set(self._former)
            text = f'{name} was given up for {former}, which the mode policy follows'
            return [Event(EventKind.TROUBLE, text)]
        if handover.phase is not self._reported_phase:
            self._reported_phase = handover.phase
            if handover.phase is Phase.RETURN:
                text = f'{name} was given up: {handover.reason}; back to {former}'
                events.append(Event(EventKind.TROUBLE, text))
            elif not handover.over:
                events.append(Event(EventKind.NEWS, f'{name}: {handover.phase.value}'))
        if handover.over:
            self._handover = None
            machine.conclude(handover)
            if handover.phase is Phase.RETURNED:
                self._set(self._former)
            events.append(Event(EventKind.NEWS, f'{name}: {handover.phase.value}'))
        return events

    def watch(self, situation: Situation, dt: float, last: Targets) -> Targets | None:
        """Return what a policy that is only watched would send; None without one.

        Args:
            situation: What is known.
            dt: Duration of the step in [s].
            last: The last targets of all joints in [rad].
        """
        return self._shadow.step(situation, dt, last) if self._shadow is not None else None

    def asked(self, *, is_held: bool) -> Asked | None:
        """Return what the policy that moves the robot, or that is watched, was asked in this step.

        Args:
            is_held: Whether no motion was stepped.
        """
        if self._shadow is not None:
            return self._shadow.asked
        motion = self._machine.motion
        if isinstance(motion, Handover):
            motion = motion.current
        if is_held or not isinstance(motion, PolicyMotion) or motion.answer is None:
            return None
        return Asked(motion.policy, motion.answer, motion.steps)

    def _installed(self, policy: Policy | None) -> str:
        if policy is None:
            return 'no policy is loaded any more'
        if self._dry_run:
            return f'{policy.name} is watched (parameter policy_dry_run)'
        return f'the mode policy follows {policy.name}'

    def _set(self, policy: Policy | None) -> None:
        self.policy = policy
        if policy is None:
            self._refusal = NO_POLICY
        self._machine.set_policy(policy)
        self._shadow = self._shadow_of(policy)

    def _shadow_of(self, policy: Policy | None) -> Shadow | None:
        return Shadow(policy) if policy is not None and self._dry_run else None


def _name(policy: Policy | None) -> str:
    return policy.name if policy is not None else GAIT_NAME
