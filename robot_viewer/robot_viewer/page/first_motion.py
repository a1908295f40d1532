# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""First motion of a joint: targets while a button is held, and the texts on the page.

Positions in [rad] or [m], times on one steady clock in [s]. The library first_motion guards
the motion, judges it and computes corrections. The page streams targets to the drive, as any
client; the robot stops by itself when the stream pauses.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from enum import Enum
import math

from first_motion import (
    AxisScales,
    Correction,
    DriveFacts,
    FOLLOWING,
    JointKind,
    Judgement,
    MotionGuard,
    MotionPlan,
    Order,
    propose,
    Sample,
    Seen,
    yaml_text,
)

from ..robot_state import ENABLED

RELEASED_AFTER = 0.15  # time in [s] without heartbeat after which a button counts as released
MAX_STEP_TIME = 0.1
"""Longest time in [s] by which one heartbeat advances the target, however late the heartbeat
is."""
FRESHNESS = 0.5  # age in [s] from which a position is too old to continue
NO_POSITION = 'its position does not arrive on joint_states'
MODES = frozenset({'Cyclic position', 'Interpolated position'})
"""Modes with position targets in which the master halts the axis when they pause."""
LEAD_TIME = 0.3
"""Maximum lead of the target over the joint, as a time in [s] at the motion's speed."""


class Saw(Enum):
    """What the user saw; the value is the label on the page."""

    LIKE_PICTURE = 'it moved like the robot in the picture'
    OTHER_WAY = 'it moved the other way'
    NOTHING = 'nothing moved'
    OTHER_JOINT = 'another joint moved'

    def seen(self, reported: float, distance: float) -> Seen:
        """Convert to the observation that first_motion judges."""
        if self in {Saw.NOTHING, Saw.OTHER_JOINT}:
            return Seen(0, other_joint=self is Saw.OTHER_JOINT)
        shown = 1 if reported >= 0.0 else -1
        direction = shown if self is Saw.LIKE_PICTURE else -shown
        return Seen(direction, distance or None)


@dataclass(frozen=True, slots=True)
class MotionRequest:
    """The motion that the user requests."""

    joint: str
    distance: float  # in [rad] or [m]; negative for the other direction
    speed: float  # in [rad/s] or [m/s]


@dataclass(frozen=True, slots=True)
class Axis:
    """Units and scales of an axis."""

    kind: JointKind  # revolute or prismatic
    scales: AxisScales
    says: DriveFacts  # reported by the drive about its increments
    where: str  # location of the scales: bus.yml, section, channel


def motion_plan(
    request: MotionRequest, axis: Axis, start: float, others: Mapping[str, float]
) -> MotionPlan:
    """Return the plan of a requested motion.

    Raises:
        ValueError: A number is not finite, or nothing would move.
    """
    plan = MotionPlan(
        start=start,
        distance=request.distance,
        speed=request.speed,
        increment=abs(axis.scales.scale_pos_from_dev),
        others={name: each for name, each in others.items() if math.isfinite(each)},
    )
    # a stuck joint lags by the maximum lead; that is a result, not an error
    stuck = lead(plan) + plan.noise
    return replace(plan, following_limit=max(FOLLOWING * abs(plan.distance), stuck))


def lead(plan: MotionPlan) -> float:
    """Return the maximum lead of the target over the joint."""
    return plan.speed * LEAD_TIME + plan.noise


class GuardedTargets:
    """Targets of one motion: at most one per heartbeat, and none without."""

    def __init__(self, plan: MotionPlan, now: float) -> None:
        self.guard = MotionGuard(plan, now)
        self._target = plan.start
        # a button counts as held until its heartbeats pause: heartbeats of an earlier press do not
        # permit this motion
        self._beat = self._since = now
        self._used = -math.inf

    @property
    def commanded(self) -> float:
        """Commanded distance so far: a motion may end before its target."""
        return self._target - self.guard.plan.start

    @property
    def press_anew(self) -> bool:
        """Whether the button is held, but must be released before it counts."""
        return self.guard.needs_release and self._beat > self._since

    def beat(self, now: float) -> None:
        """Process a valid heartbeat of the held button."""
        self._beat = now

    def release(self) -> None:
        """Process the release of the button."""
        self._beat = -math.inf

    def step(self, now: float, sample: Sample) -> float | None:
        """Return the next target; None to command nothing."""
        held = now - self._beat < RELEASED_AFTER
        if self.guard.moving:
            sample = replace(sample, following_error=self._target - sample.position)
        order = self.guard.step(now, sample, held=held, busy=False)
        if order is Order.GO:
            # start from the measured position; a single touch moves nothing
            self._target, self._used = sample.position, self._beat
        if not self.guard.moving or self._beat <= self._used:
            return None
        plan = self.guard.plan
        gap = min(self._beat - self._used, MAX_STEP_TIME)
        self._used = self._beat
        left = plan.target - self._target
        self._target += math.copysign(min(plan.speed * gap, abs(left)), left)
        # limit the lead: a stuck joint would jump when it comes free
        limit = sample.position + math.copysign(lead(plan), plan.distance)
        nearest = min if plan.distance > 0.0 else max
        self._target = nearest(self._target, limit)
        return self._target


def problem_of(drive: Mapping[str, str], age: float) -> str:
    """Return why a drive cannot be moved, with the remedy; empty when it can."""
    if age > FRESHNESS:
        return NO_POSITION
    state, mode = drive.get('state', ''), drive.get('mode', '')
    if state != ENABLED:
        return f'it is not enabled ({state or "no diagnostics"}): see Diagnose'
    if mode not in MODES:
        return (
            f'it is in {mode or "no mode"}, in which a position is not followed, or goes on when '
            'the page is lost: choose cyclic or interpolated position mode below Drives. A drive '
            'that has neither is tried without this guard: a small ~/target at a low 0x6081'
        )
    return ''


def announcement(request: MotionRequest, axis: Axis, position: float) -> Iterator[str]:
    """Yield the paragraphs that announce the motion."""
    kind = axis.kind
    unit = 'rad' if kind is JointKind.TURNS else 'm'
    source = 'the factor group' if axis.scales.scale_from_factor_group else 'bus.yml'
    yield (
        f'{request.joint} stands at {kind.shown(position)}; {axis.scales.scale_pos_to_dev:g} '
        f'increments per {unit} by {source}'
    )
    yield (
        f'It will move {kind.shown(request.distance)}, with {kind.shown(request.speed)}/s, only '
        'while you hold the button. Should the scale be wrong it moves farther, faster or the '
        'other way: look at the real joint, keep the emergency stop in reach, and let go when it '
        'is enough.'
    )


def corrections(axis: Axis, judgement: Judgement) -> Iterator[Correction]:
    """Yield corrections of a sign or scale, one per likely cause."""
    if judgement.verdict.wants_change:
        for cause in judgement.causes or (None,):
            yield propose(axis.scales, judgement, cause)


def correction_lines(where: str, correction: Correction) -> str:
    """Return the corrected lines of the file, for copying."""
    lines = [f'# {where}', f'# {correction.reason}']
    lines += [f'{key}: {yaml_text(value)}' for key, value in correction.values.items()]
    return '\n'.join(lines)
