# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What can move the joints, one thing at a time: holding, going to a pose, swinging, walking."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
import math

from quad_description import JointLimits, Targets

from ..gait.generator import GaitGenerator
from ..policy.observation import Situation

MAX_PERIODS = 1.5  # periods; a step that comes late may not be a leap


class StepLimiter:
    """Keeps targets within the joints' ranges, and steps within their speed.

    The last thing that a target passes. A joint that is found outside of its limits is not pulled
    into them before something is requested: its range reaches to where it is, and shrinks with it.
    """

    def __init__(self, limits: Sequence[JointLimits], period: float, speed: float = 1.0) -> None:
        """Start at no target; ``speed`` is that of a target per speed of its joint."""
        self._limits = tuple(limits)
        self._longest = MAX_PERIODS * period
        self._speed = speed
        self.last: Targets | None = None  # what was let through last; None at the beginning
        self.limited = 0  # how many targets of single joints were too fast so far, and were cut

    def start(self, positions: Sequence[float]) -> Targets:
        """Begin where the joints are [rad], even if that is outside of their limits."""
        self.last = tuple(positions)
        return self.last

    def reset(self) -> None:
        """Forget what was let through: joints were moved by something else."""
        self.last = None

    def step(self, targets: Sequence[float], dt: float) -> Targets:
        """Return what may be sent instead of some finite targets."""
        if self.last is None:
            return self.start(targets)
        dt = min(dt, self._longest) * self._speed
        sent = []
        for limits, before, wanted in zip(self._limits, self.last, targets, strict=True):
            most = limits.velocity * dt
            target = min(max(wanted, min(limits.lower, before)), max(limits.upper, before))
            if abs(target - before) > most:
                target = before + math.copysign(most, target - before)
                self.limited += 1
            sent.append(target)
        self.last = tuple(sent)
        return self.last


class Motion(ABC):
    """Makes joint targets, step after step.

    A motion is wound down by a velocity of zero; it may be left for one that begins elsewhere as
    soon as it is :attr:`settled`.
    """

    finished = True  # whether it has come to where it leads
    failure = ''  # why it is of no use any more; empty while it works

    @property
    def settled(self) -> bool:
        """Whether the robot is at rest on its feet, or was not walking in the first place."""
        return True

    @abstractmethod
    def step(self, situation: Situation, dt: float) -> Targets:
        """Return the next targets of all joints in [rad]."""


class Hold(Motion):
    """Stays; a joint that something else has moved is not pulled back, the set-point follows.

    So servos that were switched off can be moved by hand and do not leap when they are switched
    on again.
    """

    def __init__(self, targets: Targets, band: float) -> None:
        """Hold some targets; a joint may be off by the band [rad]."""
        self._targets = targets
        self._band = band

    def step(self, situation: Situation, dt: float) -> Targets:
        """Return the targets, near to where the joints are."""
        if situation.joints is not None:
            self._targets = tuple(
                min(max(target, position - self._band), position + self._band)
                for target, position in zip(self._targets, situation.joints.positions, strict=True)
            )
        return self._targets


class Blend(Motion):
    """Goes from one pose to another, all joints together, with a soft start and end."""

    def __init__(self, start: Targets, end: Targets, speed: float, least: float) -> None:
        """Plan it: fastest joint at a speed [rad/s], at least so long [s]."""
        self._start, self._end = start, end
        way = max(abs(b - a) for a, b in zip(start, end, strict=True))
        # a cosine is pi / 2 times as fast in its middle as on average
        self.duration = max(least, way * math.pi / 2 / speed)  # how long it takes in [s]
        self._time, self.finished = 0.0, False

    def step(self, situation: Situation, dt: float) -> Targets:
        """Return the next targets."""
        self._time += dt
        self.finished = self._time >= self.duration
        if self.finished:
            return self._end
        share = 0.5 * (1.0 - math.cos(math.pi * self._time / self.duration))
        return tuple(a + share * (b - a) for a, b in zip(self._start, self._end, strict=True))


class Swing(Motion):
    """Takes each joint to a pose by itself, as fast as it may: no soft start, no common end."""

    def __init__(self, start: Targets, end: Targets, speed: float, duration: float) -> None:
        """Plan it: each joint at a speed [rad/s]; what is not there in time is left short."""
        self._targets, self._end, self._speed = start, end, speed
        self._left, self.finished = duration, False

    def step(self, situation: Situation, dt: float) -> Targets:
        """Return the next targets."""
        self._left -= dt
        self.finished = self._left < 1e-6
        most = self._speed * dt
        self._targets = tuple(
            a + min(max(b - a, -most), most) for a, b in zip(self._targets, self._end, strict=True)
        )
        return self._targets


class Walk(Motion):
    """The geometric gait; stands when the velocity is zero."""

    def __init__(self, generator: GaitGenerator) -> None:
        self._generator = generator
        self.reachable = True  # whether the legs reached where they should in the last step

    @property
    def settled(self) -> bool:
        """Whether all feet stand at their places."""
        return self._generator.standing

    def step(self, situation: Situation, dt: float) -> Targets:
        """Return the next targets."""
        imu = situation.imu
        attitude = None if imu is None or imu.is_uncertain else imu.roll_pitch_yaw
        step = self._generator.step(situation.velocity, situation.pose, attitude, dt)
        self.reachable = step.reachable
        return step.targets
