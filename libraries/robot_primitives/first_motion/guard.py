# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Decides when a joint may move and what ends its motion: a state machine, no clock or bus.

Positions are in the unit of the joint in bus.yml ([rad] or [m]), times on one steady clock in [s].
The joint moves only while the person holds a key that was pressed after the motion was prepared. A
loop that stalls for longer than :data:`LOOP_GAP` counts as a release: the key was not checked
meanwhile.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
import math

LOOP_GAP = 0.25  # [s] between two steps, beyond which the key has to be pressed anew
RATE_WINDOW = 0.3  # [s] over which a speed is measured
RATE_WINDOW_MIN = 0.15  # [s] below which there is none
SPEED_FACTOR = 3.0  # times the commanded speed, above which the joint is too fast
STALL_TIME = 3.0  # [s] without progress, after which the joint counts as stuck
IDLE_TIME = 60.0  # [s] without a key, after which it is over
REACHED = 0.03  # share of the distance that may be missing
BEYOND = 0.25  # share of the distance by which the joint may go too far, or the other way
OTHERS = 0.5  # share of the distance by which no other joint may move
FOLLOWING = 0.5  # share of the distance by which the joint may be off its set-points
INCREMENTS = 3  # by which a position may be off in each of these
OTHER_WAY = (
    'scale_pos_to_dev and scale_pos_from_dev have different signs, or the encoder counts the '
    'other way than the motor turns'
)


class Order(Enum):
    """Command for the drive."""

    NONE = 'go on'
    GO = 'go to the target'
    HALT = 'halt'
    END = 'it is over'


class Outcome(Enum):
    """How a motion ended; the value is the text for the user."""

    RUNNING = 'it runs'
    REACHED = 'the drive reports that it is there'
    FINISHED = 'ended by you before the target'
    IDLE = 'the key was not held'
    STALLED = 'the position that the drive reports does not change'
    PROBLEM = 'the drive cannot go on'
    FOLLOWING_ERROR = 'the joint does not follow its set-points'
    TOO_FAST = 'the joint is faster than commanded'
    TOO_FAR = 'the joint went beyond its target'
    OTHER_WAY = 'the drive reports the other direction than commanded'
    OTHER_JOINT = 'another joint has moved'

    @property
    def is_judged(self) -> bool:
        """Whether the person's observation is meaningful; other outcomes are errors."""
        return self in {Outcome.REACHED, Outcome.FINISHED, Outcome.STALLED}


@dataclass(frozen=True, slots=True)
class MotionPlan:
    """A small motion of a joint."""

    start: float  # where it stands
    distance: float  # how far it shall go; negative for the other way
    speed: float  # how fast at most, per second
    increment: float  # size of an increment of the drive
    # following error that ends it; infinite where the drive alone makes the path, and its
    # set-point is the target
    following_limit: float = math.inf
    others: Mapping[str, float] = field(default_factory=dict)  # where the other joints stand

    def __post_init__(self) -> None:
        """Reject a plan that cannot be guarded: a limit of NaN is never exceeded."""
        for name in ('start', 'distance', 'speed', 'increment'):
            if not math.isfinite(value := getattr(self, name)):
                raise ValueError(f'{name} of the motion is {value}; no motion can be guarded')
        if not self.distance or self.speed <= 0.0:
            raise ValueError(
                f'a distance of {self.distance:g} at a speed of {self.speed:g} is no motion'
            )

    @property
    def target(self) -> float:
        """End position of the motion."""
        return self.start + self.distance

    @property
    def noise(self) -> float:
        """Largest apparent motion of a joint at rest."""
        return INCREMENTS * self.increment


@dataclass(frozen=True, slots=True)
class Sample:
    """Feedback of the drives."""

    position: float  # of the joint
    following_error: float = 0.0  # of the joint
    problem: str = ''  # why it cannot be moved on, in words; else empty
    # positions of the other joints, as far as they are known
    others: Mapping[str, float] = field(default_factory=dict)


class MotionGuard:
    """Decides, sample by sample, whether the joint may keep moving."""

    def __init__(self, plan: MotionPlan, now: float) -> None:
        """Begin at rest, with no key held."""
        self.plan = plan  # the motion
        self.outcome = Outcome.RUNNING  # how it ended
        self.detail = ''  # the same with figures, for a person; empty while it runs
        self.travelled = 0.0  # way of the joint so far, positive in the direction commanded
        self._moving = self._has_begun = False
        # the key has to be released before it counts again
        self.needs_release = True  # a key that is held already was pressed for something else
        self._last = now
        self._idle_since = now
        self._progress = (now, 0.0)
        self._track: deque[tuple[float, float]] = deque()

    @property
    def moving(self) -> bool:
        """Whether the drive was ordered to move."""
        return self._moving

    def finish(self) -> Order:
        """End the motion at the person's request; it is judged if the joint has moved."""
        return self._end(Outcome.FINISHED if self._has_begun else Outcome.IDLE)

    def step(self, now: float, sample: Sample, *, held: bool, busy: bool) -> Order:
        """Check a sample of the drives; return the command for the drive.

        ``held``: the person holds the key. ``busy``: the drive still executes the last command, so
        it is not commanded to move.
        """
        if self.outcome is not Outcome.RUNNING:
            return Order.END
        gap, self._last = now - self._last, now
        self.travelled = (sample.position - self.plan.start) * math.copysign(
            1.0, self.plan.distance
        )
        if (ended := self._ended(now, sample)) is not None:
            return self._end(*ended)
        self.needs_release = held and (self.needs_release or gap > LOOP_GAP)
        permitted = held and not self.needs_release
        if self._moving and not permitted:
            self._moving, self._idle_since = False, now
            return Order.HALT
        if permitted and not self._moving and not busy:
            self._moving = self._has_begun = True
            self._progress = (now, self.travelled)
            return Order.GO
        return Order.NONE

    def _end(self, outcome: Outcome, detail: str = '') -> Order:
        self.outcome, self._moving = outcome, False
        self.detail = f'{outcome.value}{": " if detail else ""}{detail}'
        return Order.END

    def _ended(self, now: float, sample: Sample) -> tuple[Outcome, str] | None:
        """Return the reason that ends the motion now, the most dangerous first."""
        plan = self.plan
        if sample.problem:
            return Outcome.PROBLEM, sample.problem
        if not math.isfinite(sample.position):
            return Outcome.PROBLEM, 'it reports no position'
        wrong = self._went_wrong(now, sample)
        if wrong is not None:
            return wrong
        if abs(plan.target - sample.position) <= max(REACHED * abs(plan.distance), plan.increment):
            return Outcome.REACHED, ''
        if not self._moving:
            idle = now - self._idle_since > IDLE_TIME
            return (Outcome.IDLE, f'for {IDLE_TIME:g} s') if idle else None
        since, before = self._progress
        if abs(self.travelled - before) > max(plan.increment, REACHED * abs(plan.distance)):
            self._progress = (now, self.travelled)
        elif now - since > STALL_TIME:
            if self.travelled < -plan.noise:  # it went there until its targets did not go on
                return Outcome.OTHER_WAY, OTHER_WAY
            return Outcome.STALLED, f'for {STALL_TIME:g} s'
        return None

    def _went_wrong(self, now: float, sample: Sample) -> tuple[Outcome, str] | None:
        plan, size = self.plan, abs(self.plan.distance)
        if abs(sample.following_error) > plan.following_limit:
            return Outcome.FOLLOWING_ERROR, ''
        if self.travelled > size * (1.0 + BEYOND) + plan.noise:
            return Outcome.TOO_FAR, f'by {self.travelled / size - 1.0:.0%} of the distance'
        if self.travelled < -size * BEYOND - plan.noise:
            return Outcome.OTHER_WAY, OTHER_WAY
        for name, start in plan.others.items():
            position = sample.others.get(name, start)
            if abs(position - start) > OTHERS * size + plan.noise:
                return Outcome.OTHER_JOINT, f'{name}, while this one was commanded'
        return self._too_fast(now, sample.position)

    def _too_fast(self, now: float, position: float) -> tuple[Outcome, str] | None:
        self._track.append((now, position))
        while now - self._track[0][0] > RATE_WINDOW:
            self._track.popleft()
        time, before = self._track[0]
        if now - time < RATE_WINDOW_MIN:
            return None
        moved = max(0.0, abs(position - before) - self.plan.noise)
        times = moved / (now - time) / self.plan.speed
        if times <= SPEED_FACTOR:
            return None
        return Outcome.TOO_FAST, f'{times:.1f} times; look at scale_vel_to_dev'
