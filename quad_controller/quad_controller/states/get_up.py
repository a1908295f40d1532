# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Getting up after a fall: from whatever side the robot lies on to its feet.

::

    REST -> (back, side, nose or tail: stages of a try) -> REST -> ... until it lies on its belly
    REST -> (belly: FOLD -> STAND) -> finished
    REST -> (too many tries) -> failure

Where it lies is measured whenever the body has come to rest, so that a stage that did something
else than it was made for leads to the tries of where it lies now. Swings follow each other without
rest: the legs throw the body over.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
import math

from quad_description import ImuSample, Quadruped, Targets
from quad_description.rotations import Vector

from ..policy.observation import Situation
from .get_up_poses import Lying, lying_on, RECOVERIES
from .health import Health
from .modes import Fault, FaultLatch
from .motion import Blend, Hold, Motion, Swing

STILL_ANGLE = 0.05  # [rad] by which the body of a robot at rest may turn
STILL_TIME = 0.4  # [s] for which it must not have turned more
REST_DEADLINE = 3.0  # [s] after a movement; then it counts as at rest wherever it is
BLIND_DEADLINE = 2.0  # [s] without an attitude
MAX_TRIES = 8  # from all sides together
MIN_BLEND_TIME = 0.02  # [s]
LEVEL = 0.35  # [rad] of tilt of a robot that stands
FOLD_SPEED = 3.0  # [rad/s] of legs that bear nothing yet
STAND_SPEED = 1.5  # [rad/s]

REACH_TOLERANCE = 0.01  # [rad] that a joint may be short of a pose

BY_HAND = 'put it on its feet by hand, then call ~/clear_fault, or request get_up again'
ON_ITS_BACK = (
    'it lies on its back, and only a throw at full speed is known to turn it over, by servos of '
    '10 N m/rad in simulation; as published they are too soft: put it on its feet or on a side '
    'by hand, or allow that by the parameter get_up_swings and stand clear; then request get_up '
    'again'
)
WITH_AN_ARM = (
    'it lies on its back and its arm, and how it turns over there is not known; put it on its '
    'feet or on a side by hand, then request get_up again'
)


class StillnessWatch:
    """How long the body has not turned; by its attitude, as not every IMU has a gyro."""

    def __init__(self) -> None:
        """Begin in motion."""
        self._reference: Vector | None = None
        self.time = 0.0

    def reset(self) -> None:
        """Begin in motion again."""
        self._reference, self.time = None, 0.0

    def step(self, down: Vector, dt: float) -> None:
        """Process the direction of gravity in the body after a duration in [s]."""
        if self._reference is None or _angle(self._reference, down) > STILL_ANGLE:
            self._reference, self.time = down, 0.0
        else:
            self.time += dt


def stands(imu: ImuSample | None) -> bool:
    """Return whether the body of a robot is upright; also when nobody knows."""
    return imu is None or imu.is_uncertain or imu.tilt < LEVEL


def get_up_refusal(health: Health, latch: FaultLatch, *, swings: bool) -> str:
    """Return why a robot cannot get up now, nothing when it may try.

    Args:
        latch: The latched faults; a fall is what getting up is for.
        swings: Whether it may throw itself off its back.
    """
    if others := latch.texts_without(Fault.FALLEN):
        return f'{"; ".join(others)}; call ~/clear_fault when that is corrected'
    for fault, reason in health.faults():
        if fault is not Fault.FALLEN:
            return f'{fault.value}: {reason}'
    imu = health.attitude
    if health.joints is None or imu is None:
        return 'getting up needs joint states and an attitude; there are none'
    if health.uncertainty:
        return health.uncertainty
    if health.spins:
        return 'it turns faster than max_turn_rate: wait until it is at rest, or look at the gyro'
    if not swings and lying_on(imu.down) is Lying.BACK:
        return ON_ITS_BACK
    return health.unmeasured(None)


class GetUp(Motion):
    """Brings a robot to its feet by poses."""

    def __init__(
        self,
        robot: Quadruped,
        last: Targets,
        *,
        folded: Targets,
        standing: Targets,
        swings: bool,
    ) -> None:
        """Begin with waiting for rest.

        Args:
            folded: Targets of a robot that lies with its feet under its hips [rad].
            standing: Targets of one that stands [rad].
            swings: Whether it may throw itself off its back.
        """
        self._robot, self._last = robot, last
        self._folded, self._standing = folded, standing
        self._swings = swings
        self._motion: Motion = Hold(last, math.inf)
        self._deadline = REST_DEADLINE
        self._time = self._blind = 0.0
        self._still = StillnessWatch()
        self._lying, self._tilt = Lying.BELLY, 0.0
        self._tries: Counter[Lying] = Counter()
        self._finished, self._failure, self._rises = False, '', False
        self._stages = self._script()
        self.text = 'waits until it is at rest'  # what it is doing, for people
        next(self._stages)

    @property
    def finished(self) -> bool:
        """Whether it stands."""
        return self._finished

    @property
    def failure(self) -> str:
        """Why it does not get up: where it lies, what was tried and what to do."""
        return self._failure

    @property
    def rises(self) -> bool:
        """Whether its legs are being straightened below it."""
        return self._rises

    def step(self, situation: Situation, dt: float) -> Targets:
        """Return the next targets; the last ones while the attitude is not known."""
        imu = situation.imu
        if self._finished or self._failure:
            return self._last
        if imu is None or imu.is_uncertain:
            self._blind += dt
            if self._blind > BLIND_DEADLINE:
                self._failure = f'nobody measures how it lies; look at /imu, or {BY_HAND}'
            return self._last
        self._blind = 0.0
        self._time += dt
        self._last = self._motion.step(situation, dt)
        if not self._motion.finished:
            self._still.reset()
        self._still.step(imu.down, dt)
        if self._is_over():
            self._lying, self._tilt = lying_on(imu.down), imu.tilt
            next(self._stages, None)
        return self._last

    def _is_over(self) -> bool:
        """Whether a stage has come to its end, or takes too long."""
        if self._time >= self._deadline:
            return True
        if isinstance(self._motion, Swing):
            return self._motion.finished
        return self._motion.finished and self._still.time >= STILL_TIME

    def _script(self) -> Iterator[None]:
        """Begin one stage after another, each when the one before is over."""
        yield
        while self._tries.total() < MAX_TRIES:
            lying = self._lying
            self._tries[lying] += 1
            if lying is not Lying.BELLY:
                yield from self._turn_over(lying)
                if self._failure:
                    return
                continue
            yield from self._stand_up()
            if self._finished:
                return
        tried = ', '.join(f'{side.value} {count}' for side, count in self._tries.items())
        self._failure = (
            f'it lies {self._lying.value}, tilted by {math.degrees(self._tilt):.0f} deg, after '
            f'{MAX_TRIES} tries ({tried}); look for what hinders its legs, and {BY_HAND}'
        )

    def _turn_over(self, lying: Lying) -> Iterator[None]:
        """Try one of the recoveries from a side, the next one when that was tried before."""
        if lying is Lying.BACK and self._robot.others:
            self._failure = WITH_AN_ARM
            return
        recoveries = RECOVERIES[lying]
        stages = recoveries[(self._tries[lying] - 1) % len(recoveries)]
        swings = any(stage.duration is not None for stage in stages)
        if swings and not self._swings:
            self._failure = ON_ITS_BACK
            return
        how = 'throws itself over at full speed, stand clear' if swings else 'turns over'
        for stage in stages:
            targets = self._robot.with_legs(stage.legs, self._last)
            reached = self._robot.clamp(targets)
            if max(abs(a - b) for a, b in zip(reached, targets, strict=True)) > REACH_TOLERANCE:
                self._failure = f'the joints of this robot do not reach the poses; {BY_HAND}'
                return
            self._start_stage(reached, stage.speed, stage.duration)
            self.text = f'lies {lying.value}; {how}, try {self._tries[lying]}'
            yield
            if stage.duration is None and self._lying is not lying:
                return

    def _stand_up(self) -> Iterator[None]:
        """Gather the legs, and stand on them."""
        self.text = f'lies {Lying.BELLY.value}; folds its legs, try {self._tries[Lying.BELLY]}'
        self._start_stage(self._folded, FOLD_SPEED)
        yield
        if self._lying is not Lying.BELLY:
            return
        self.text, self._rises = 'stands up', True
        self._start_stage(self._standing, STAND_SPEED)
        yield
        self._rises = False
        self._finished = self._lying is Lying.BELLY and self._tilt < LEVEL

    def _start_stage(
        self, targets: Targets, speed: float, swing_time: float | None = None
    ) -> None:
        """Begin a stage that leads to a pose, softly or by a swing that takes a time [s]."""
        if swing_time is not None:
            self._motion = Swing(self._last, targets, speed, swing_time)
            self._time, self._deadline = 0.0, math.inf
            return
        blend = Blend(self._last, targets, speed, MIN_BLEND_TIME)
        self._motion = blend
        self._time, self._deadline = 0.0, blend.duration + REST_DEADLINE


def _angle(one: Vector, other: Vector) -> float:
    """Return the angle between two unit vectors in [rad]."""
    return math.acos(min(max(sum(a * b for a, b in zip(one, other, strict=True)), -1.0), 1.0))
