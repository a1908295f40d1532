# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""From one motion to another while the robot moves, and back when the new one does not do.

::

    WARM_UP -> BLEND -> PROBATION -> KEPT
       '---------+----------+-> RETURN -> RETURNED      (a watchdog, see watchdogs.py)

Both motions are stepped all the time, each with what it has observed itself, so that either is
there at once: the new one when the blend begins, the former one when the new one is given up.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
import math

from quad_description import Targets

from .motion import Motion, Situation
from .policy_motion import PolicyMotion
from .watchdogs import Watchdogs


class Phase(Enum):
    """How far it is; the value is for people."""

    WARM_UP = 'warming up'
    BLEND = 'blending'
    PROBATION = 'on probation'
    RETURN = 'going back'
    KEPT = 'kept'
    RETURNED = 'gone back'


WARM_UP_TIME = 0.5  # [s] of watching before it moves anything: histories fill, clocks go
BLEND_TIME = 1.0  # [s] from the former targets to the new ones
PROBATION_TIME = 5.0  # [s] after the blend in which the former one stays ready
RETURN_TIME = 0.3  # [s] back to the former targets

FOLLOWING: Mapping[Phase, tuple[float, Phase]] = {
    Phase.WARM_UP: (WARM_UP_TIME, Phase.BLEND),
    Phase.BLEND: (BLEND_TIME, Phase.PROBATION),
    Phase.PROBATION: (PROBATION_TIME, Phase.KEPT),
    Phase.RETURN: (RETURN_TIME, Phase.RETURNED),
}
"""How long a phase goes on in [s], and what comes then."""


class Handover(Motion):
    """Goes over from a motion to another.

    Attributes:
        before: The former motion.
        after: The new one.
        phase: How far it is.
        warm_up: Time of watching before the blend in [s].
        reason: Why it went back; empty as long as it does not.
    """

    def __init__(
        self,
        before: Motion,
        after: Motion,
        last: Targets,
        watchdogs: Watchdogs | None,
        warm_up: float = 0.0,
    ) -> None:
        """Begin with what the former motion does.

        Args:
            before: The former motion, which goes on.
            after: The new one, which begins.
            last: The last targets of all joints in [rad].
            watchdogs: What ends the new one; None for one that is trusted.
            warm_up: Least time of watching before the blend in [s].
        """
        self.before, self.after = before, after
        self.phase = Phase.BLEND if watchdogs is None else Phase.WARM_UP
        self.reason = ''
        self._watchdogs = watchdogs
        self.warm_up = max(warm_up, WARM_UP_TIME) if watchdogs is not None else 0.0
        self._last = self._left = last
        self._time = 0.0

    @property
    def over(self) -> bool:
        """Whether one of both motions is left alone."""
        return self.phase not in FOLLOWING

    @property
    def current(self) -> Motion:
        """Which of both moves the robot, or will when the blend is over."""
        return self.before if self.phase in {Phase.RETURN, Phase.RETURNED} else self.after

    @property
    def settled(self) -> bool:
        """Whether the robot is at rest, and no blend goes on."""
        return self.finished and self.current.settled

    @property
    def finished(self) -> bool:
        """Whether no blend goes on."""
        return self.phase is Phase.PROBATION or self.over

    @property
    def failure(self) -> str:
        """Why both are of no use; empty when one is."""
        if self.current is self.after or not self.before.failure:
            return ''
        return f'{self.reason}; and the one before it failed: {self.before.failure}'

    def step(self, situation: Situation, dt: float) -> Targets:
        """Return the next targets."""
        before = self.before.step(situation, dt)
        if self.current is self.before:
            self._pass(dt)
            self._last = _mixed(self._left, before, self._share(RETURN_TIME))
            return self._last
        after = self.after.step(situation, dt)
        self._pass(dt)
        if reason := self._refusal(situation, dt):
            self._go_back(reason)
            return self._last
        if self.phase is Phase.WARM_UP:
            self._last = before
        elif self.phase is Phase.BLEND:
            self._last = _mixed(before, after, self._share(BLEND_TIME))
        else:
            self._last = after
        return self._last

    def _refusal(self, situation: Situation, dt: float) -> str:
        """Return why the new motion is given up, nothing while it is not."""
        if self.after.failure:
            return self.after.failure
        if self._watchdogs is None or not isinstance(self.after, PolicyMotion):
            return ''
        answer = self.after.answer
        return self._watchdogs.step(situation, answer, dt, moves=self.phase is not Phase.WARM_UP)

    def _go_back(self, reason: str) -> None:
        self.reason, self._left, self._time = reason, self._last, 0.0
        self.phase = Phase.RETURN

    def _pass(self, dt: float) -> None:
        """Let time pass in the phase, and begin the next one."""
        self._time += dt
        while self.phase in FOLLOWING:
            lasts, following = FOLLOWING[self.phase]
            if self.phase is Phase.WARM_UP:
                lasts = self.warm_up
            elif self.phase is Phase.PROBATION and self._watchdogs is None:
                lasts = 0.0
            if self._time < lasts:
                return
            self._time -= lasts
            self.phase = following

    def _share(self, lasts: float) -> float:
        """Return how far a blend is, 0 to 1, with a soft start and end."""
        share = 1.0 if self.over else min(self._time / lasts, 1.0)
        return 0.5 * (1.0 - math.cos(math.pi * share))


def _mixed(start: Targets, end: Targets, share: float) -> Targets:
    return tuple(a + share * (b - a) for a, b in zip(start, end, strict=True))
