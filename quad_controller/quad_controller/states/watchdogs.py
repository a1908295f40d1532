# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What ends a policy on probation before it is a fault."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from enum import Enum
import math

from quad_description import Targets

from ..policy.interface import PolicyStep
from .motion import Situation

TILT_SHARE = 0.5  # of the tilt that is a fall: the former policy can still catch the robot
SATURATED_SHARE = 0.25  # of the joints whose targets were cut at their limits
JUMP_RATIO = 2.0  # of a joint's speed, that a target needs
LATE_SHARE = 0.5  # of the period, that the network alone computes


class Watched(Enum):
    """What is watched; the value is for people."""

    TILT = 'tilt'
    SATURATION = 'saturation'
    JUMP = 'action jump'
    LATE = 'late inference'


TOLERATED: Mapping[Watched, float] = {
    Watched.TILT: 0.0,
    Watched.SATURATION: 0.3,
    Watched.JUMP: 0.05,
    Watched.LATE: 0.1,
}
"""How long it must be so in [s]; time in which it is not counts against it, by a quarter."""
RELIEF = 0.25


class Watchdogs:
    """Watches one policy from its first step on."""

    def __init__(self, max_tilt: float, speeds: Sequence[float], period: float) -> None:
        """Begin with nothing seen.

        Args:
            max_tilt: Angle between the body's z axis and up that is a fall in [rad].
            speeds: Limits of the joints in [rad/s].
            period: Nominal time between two steps in [s].
        """
        self._max_tilt, self._speeds, self._period = TILT_SHARE * max_tilt, tuple(speeds), period
        self._lasts = dict.fromkeys(Watched, 0.0)
        self._targets: Targets | None = None
        self._held = 0.0  # [s] that the targets have not changed

    def step(
        self, situation: Situation, answer: PolicyStep | None, dt: float, *, moves: bool
    ) -> str:
        """Return what ends the policy, nothing while all is well.

        Args:
            situation: What is known of the robot.
            answer: What the policy answered; None when it was not asked.
            dt: Duration of the step in [s].
            moves: Whether the policy moves the robot; the tilt is not its own doing before.
        """
        seen = dict(self._seen(situation, answer, dt, moves=moves))
        for what in Watched:
            change = dt if what in seen else -RELIEF * dt
            self._lasts[what] = max(self._lasts[what] + change, 0.0)
        return next(
            (f'{what.value}: {text}' for what, text in seen.items() if self._over(what)), ''
        )

    def _over(self, what: Watched) -> bool:
        return self._lasts[what] > TOLERATED[what]

    def _seen(
        self, situation: Situation, answer: PolicyStep | None, dt: float, *, moves: bool
    ) -> Iterator[tuple[Watched, str]]:
        imu = situation.imu
        if moves and imu is not None and imu.tilt > self._max_tilt:
            angles = math.degrees(imu.tilt), math.degrees(self._max_tilt)
            yield Watched.TILT, '{:.0f} deg, more than {:.0f} on probation'.format(*angles)
        if answer is None or answer.targets is None:
            return
        if answer.saturated >= SATURATED_SHARE:
            share = f'{answer.saturated:.0%}'
            yield Watched.SATURATION, f'targets of {share} of the joints are at their limits'
        if answer.computing > LATE_SHARE * self._period:
            times = answer.computing * 1e3, LATE_SHARE * self._period * 1e3
            yield Watched.LATE, '{:.1f} ms, more than {:.1f}'.format(*times)
        fastest = self._fastest(answer.targets, dt)
        if fastest > JUMP_RATIO:
            yield Watched.JUMP, f'targets go {fastest:.1f} times as fast as their joints can'

    def _fastest(self, targets: Targets, dt: float) -> float:
        """Return the largest speed of a target, as a multiple of what its joint can."""
        before = self._targets
        self._held += dt
        if targets == before:  # a policy slower than the loop
            return 0.0
        time, self._targets, self._held = max(self._held, self._period), targets, 0.0
        if before is None:
            return 0.0
        return max(
            abs(b - a) / (speed * time)
            for a, b, speed in zip(before, targets, self._speeds, strict=True)
        )
