# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Gets the robot up after a fall, whichever side it lies on.

::

    REST -> (back, side, nose or tail: stages of a try) -> REST -> ... until it lies on its belly
    REST -> (belly: FOLD -> STAND) -> finished
    REST -> (too many tries) -> failure

The side is measured whenever the body has come to rest, so a stage with an unexpected result is
followed by the tries for the new side. Swings follow each other without rest: the legs throw the
body over.

The poses are data for the XGO of quad_description. The cross-entropy method found them in
simulation, excluding collisions of legs and trunk; those for the sides come from the outline: the
contact points, and on which side of them the centre of mass lies. The swings off the back lift it
by 7 cm, over the tail. ``bench/bench_get_up.py`` measures their success. Other robots need their
own.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
import math

from quad_description import ImuSample, Quadruped, Targets
from quad_description.rotations import Vector

from ..policy.observation import Situation
from .health import Health
from .modes import Fault, FaultLatch
from .motion import Blend, Hold, Motion, Swing


class Lying(Enum):
    """Lowest side of the robot; the value completes the phrase "it lies"."""

    BELLY = 'on its belly or legs'
    LEFT = 'on its left side'
    RIGHT = 'on its right side'
    NOSE = 'on its nose'
    TAIL = 'on its tail'
    BACK = 'on its back'

    @property
    def mirrored(self) -> Lying:
        """The same side of the left-right mirrored robot."""
        return _MIRRORED.get(self, self)


_MIRRORED = {Lying.LEFT: Lying.RIGHT, Lying.RIGHT: Lying.LEFT}


def lying_on(down: Vector) -> Lying:
    """Return the side nearest to the ground, from the gravity direction in the body."""
    x, y, z = down
    sides = {
        Lying.BELLY: -z,
        Lying.BACK: z,
        Lying.LEFT: y,
        Lying.RIGHT: -y,
        Lying.NOSE: x,
        Lying.TAIL: -x,
    }
    return max(sides, key=lambda side: sides[side])


_SPEED = 3.0  # [rad/s]
_SWING_SPEED = 10.0  # [rad/s], all that the URDF lets a joint have


@dataclass(frozen=True, slots=True)
class Stage:
    """One pose of a recovery."""

    # hip, thigh and calf of each leg in [rad], in the order of :data:`quad_description.LEGS`
    legs: Sequence[Vector]
    speed: float  # of the fastest joint in [rad/s]
    # of a swing in [s], in which each joint goes as fast as that, and which the next stage follows
    # at once, wherever the body is; None for going softly and coming to rest
    duration: float | None = None

    @property
    def mirrored(self) -> Stage:
        """The stage for the left-right mirrored robot."""
        front_left, front_right, back_left, back_right = self.legs
        legs = front_right, front_left, back_right, back_left
        return Stage(legs, self.speed, self.duration)


def _on_left(lower: Vector, upper: Vector) -> Stage:
    """Return a stage for a robot that lies on its left side."""
    return Stage((lower, upper, lower, upper), _SPEED)


def _ends(front: Vector, back: Vector, speed: float = _SPEED) -> Stage:
    """Return a left-right symmetric stage."""
    return Stage((front, front, back, back), speed)


def _swing(duration: float, front: Vector, back: Vector) -> Stage:
    """Return a left-right symmetric swing."""
    return Stage((front, front, back, back), _SWING_SPEED, duration)


Recovery = tuple[Stage, ...]
"""Stages in a row; the body comes to rest after each."""

_ROLL: Recovery = (
    # feet of the lower legs, past the back, push the body onto their thighs, 60 deg from upright
    _on_left(lower=(0.52, -1.2, -1.1), upper=(0.52, 0.0, 0.8)),
    # thighs that point backward leave nothing below the belly: it tips over
    _on_left(lower=(0.52, 1.57, -1.1), upper=(-0.5, 0.0, 0.8)),
)
_STRAIGHT = (0.0, 0.0, 0.8)
"""Straight legs bring the centre of mass to the belly's side."""

_OFF_THE_NOSE: tuple[Recovery, ...] = (
    (_ends(front=_STRAIGHT, back=_STRAIGHT),),
    (_ends(front=(0.0, 1.57, 0.5), back=(0.0, 1.0, 0.5)),),
)
_OFF_THE_TAIL: tuple[Recovery, ...] = (
    (_ends(front=(0.1, 1.25, -0.7), back=(-0.2, -1.2, -0.5)),),
    (
        _ends(front=_STRAIGHT, back=_STRAIGHT),
        _ends(front=_STRAIGHT, back=(-0.2, -1.2, -0.5)),
    ),
)
_OFF_THE_BACK: tuple[Recovery, ...] = (
    (
        # drawn in, with the feet on the ground
        _ends(front=(-0.44, -0.97, 0.11), back=(0.43, -0.93, 0.79)),
        # a kick rears it up, onto tail and hind feet
        _swing(0.06, front=(-0.48, -0.17, 0.04), back=(0.49, -0.57, 0.31)),
        _swing(0.26, front=(0.35, 0.94, 0.82), back=(-0.38, -1.22, -1.13)),
        # front legs thrown to the belly pull it over the tail
        _swing(0.3, front=(0.11, 0.03, 0.25), back=(0.12, -0.4, -0.76)),
        # and it comes down on its legs
        _ends(front=(0.2, -0.29, -0.06), back=(0.03, -0.33, -0.6), speed=_SWING_SPEED),
    ),
    (  # for those that the first one leaves on the back
        _ends(front=(-0.45, -0.99, 0.14), back=(0.46, -0.93, 0.81)),
        _swing(0.06, front=(-0.5, -0.34, -0.07), back=(0.49, -0.53, 0.35)),
        _swing(0.3, front=(0.37, 0.94, 0.82), back=(-0.39, -1.22, -1.13)),
        _swing(0.3, front=(0.12, 0.09, 0.26), back=(0.09, -0.41, -0.69)),
        _ends(front=(0.21, -0.34, -0.11), back=(0.05, -0.43, -0.55), speed=_SWING_SPEED),
    ),
)

RECOVERIES: Mapping[Lying, tuple[Recovery, ...]] = {
    Lying.LEFT: (_ROLL,),
    Lying.RIGHT: (tuple(stage.mirrored for stage in _ROLL),),
    Lying.NOSE: _OFF_THE_NOSE,
    Lying.TAIL: _OFF_THE_TAIL,
    Lying.BACK: _OFF_THE_BACK,
}
"""For each side, in the order in which they are tried."""


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


def stands(imu: ImuSample | None) -> bool:
    """Return whether the body is upright, or its attitude unknown."""
    return imu is None or imu.is_uncertain or imu.tilt < LEVEL


def get_up_refusal(health: Health, latch: FaultLatch, *, swings: bool, arm: bool) -> str:
    """Return why a robot cannot get up now; empty if it may try. A fall is no reason.

    ``swings``: it may swing itself off its back; ``arm``: it has an arm.
    """
    if others := latch.texts_without(Fault.FALLEN):
        return f'{"; ".join(others)}; call ~/clear_fault when that is corrected'
    for fault, reason in health.faults():
        if fault is not Fault.FALLEN:
            return f'{fault.value}: {reason}'
    imu = health.attitude
    if health.newest.joints is None or imu is None:
        return 'getting up needs joint states and an attitude; there are none'
    if health.uncertainty:
        return health.uncertainty
    if health.spins:
        return 'it turns faster than max_turn_rate: wait until it is at rest, or look at the gyro'
    if not swings and lying_on(imu.down) is Lying.BACK:
        return WITH_AN_ARM if arm else ON_ITS_BACK
    return health.unmeasured(None)


class GetUp(Motion):
    """Gets a robot on its feet by a sequence of poses."""

    def __init__(
        self,
        robot: Quadruped,
        last: Targets,
        *,
        folded: Targets,
        standing: Targets,
        swings: bool,
    ) -> None:
        """Wait for rest; targets [rad]: legs folded, feet under the hips, standing.

        ``swings``: it may swing itself off its back.
        """
        self._robot, self._last = robot, last
        self._folded, self._standing = folded, standing
        self._swings = swings
        self._motion: Motion = Hold(last, math.inf)
        self._deadline = REST_DEADLINE
        self._time = self._blind = 0.0
        self._still_down: Vector | None = None  # where gravity was when the body came to rest
        self._still_time = 0.0  # [s] since then; by the attitude, as not every IMU has a gyro
        self._lying, self._tilt = Lying.BELLY, 0.0
        self._tries: Counter[Lying] = Counter()
        self.finished = False
        self.rises = False  # whether its legs are being straightened below it
        self._stages = self._script()
        self.text = 'waits until it is at rest'  # what it is doing, for people
        next(self._stages)

    def step(self, situation: Situation, dt: float) -> Targets:
        """Return the next targets; while the attitude is unknown, the last ones."""
        imu = situation.imu
        if self.finished or self.failure:
            return self._last
        if imu is None or imu.is_uncertain:
            self._blind += dt
            if self._blind > BLIND_DEADLINE:
                self.failure = f'how it lies is not measured; look at /imu, or {BY_HAND}'
            return self._last
        self._blind = 0.0
        self._time += dt
        self._last = self._motion.step(situation, dt)
        reference = self._still_down if self._motion.finished else None
        if reference is None or _angle(reference, imu.down) > STILL_ANGLE:
            self._still_down, self._still_time = imu.down, 0.0
        else:
            self._still_time += dt
        if self._is_over():
            self._lying, self._tilt = lying_on(imu.down), imu.tilt
            next(self._stages, None)
        return self._last

    def _is_over(self) -> bool:
        """Whether a stage has finished or timed out."""
        if self._time >= self._deadline:
            return True
        if isinstance(self._motion, Swing):
            return self._motion.finished
        return self._motion.finished and self._still_time >= STILL_TIME

    def _script(self) -> Iterator[None]:
        """Start the stages one after another, each when the previous one ends."""
        yield
        while self._tries.total() < MAX_TRIES:
            lying = self._lying
            self._tries[lying] += 1
            if lying is not Lying.BELLY:
                yield from self._turn_over(lying)
                if self.failure:
                    return
                continue
            yield from self._stand_up()
            if self.finished:
                return
        tried = ', '.join(f'{side.value} {count}' for side, count in self._tries.items())
        self.failure = (
            f'it lies {self._lying.value}, tilted by {math.degrees(self._tilt):.0f} deg, after '
            f'{MAX_TRIES} tries ({tried}); look for what hinders its legs, and {BY_HAND}'
        )

    def _turn_over(self, lying: Lying) -> Iterator[None]:
        """Try the next recovery for a side."""
        if lying is Lying.BACK and self._robot.others:
            self.failure = WITH_AN_ARM
            return
        recoveries = RECOVERIES[lying]
        stages = recoveries[(self._tries[lying] - 1) % len(recoveries)]
        swings = any(stage.duration is not None for stage in stages)
        if swings and not self._swings:
            self.failure = ON_ITS_BACK
            return
        how = 'throws itself over at full speed, stand clear' if swings else 'turns over'
        for stage in stages:
            targets = self._robot.with_legs(stage.legs, self._last)
            reached = self._robot.clamp(targets)
            if max(abs(a - b) for a, b in zip(reached, targets, strict=True)) > REACH_TOLERANCE:
                self.failure = f'the joints of this robot do not reach the poses; {BY_HAND}'
                return
            self._start_stage(reached, stage.speed, stage.duration)
            self.text = f'lies {lying.value}; {how}, try {self._tries[lying]}'
            yield
            if stage.duration is None and self._lying is not lying:
                return

    def _stand_up(self) -> Iterator[None]:
        """Fold the legs, then stand."""
        self.text = f'lies {Lying.BELLY.value}; folds its legs, try {self._tries[Lying.BELLY]}'
        self._start_stage(self._folded, FOLD_SPEED)
        yield
        if self._lying is not Lying.BELLY:
            return
        self.text, self.rises = 'stands up', True
        self._start_stage(self._standing, STAND_SPEED)
        yield
        self.rises = False
        self.finished = self._lying is Lying.BELLY and self._tilt < LEVEL

    def _start_stage(
        self, targets: Targets, speed: float, swing_time: float | None = None
    ) -> None:
        """Start a stage towards a pose: softly, or by a swing of a given time [s]."""
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
