# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Motions that generate joint targets: hold, blend, swing and walk; and the step limiter."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
import math

from quad_description import JointLimits, Targets

from ..gait.generator import GaitGenerator
from ..policy.observation import Situation

MAX_PERIODS = 1.5  # periods; a step that comes late may not be a leap


class StepLimiter:
    """Limits targets to the joints' ranges, and their steps to the joints' speeds.

    The last stage for every target. A joint found outside of its limits is not pulled back until a
    motion is requested: its range extends to its position, and shrinks as it returns.
    """

    def __init__(self, limits: Sequence[JointLimits], period: float, speed: float = 1.0) -> None:
        """Start without targets; ``speed`` scales the joints' speed limits."""
        self._limits = tuple(limits)
        self._longest = MAX_PERIODS * period
        self._speed = speed
        self.last: Targets | None = None  # what was let through last; None at the beginning
        self.limited = 0  # how many targets of single joints were too fast so far, and were cut

    def start(self, positions: Sequence[float]) -> Targets:
        """Start at the joint positions [rad], even outside of their limits."""
        self.last = tuple(positions)
        return self.last

    def reset(self) -> None:
        """Forget the last targets, because something else moved the joints."""
        self.last = None

    def step(self, targets: Sequence[float], dt: float) -> Targets:
        """Limit finite targets to what may be sent."""
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
    """Generates joint targets, step after step.

    A velocity of zero winds a motion down; once it is :attr:`settled`, another motion may take
    over.
    """

    finished = True  # whether it has come to where it leads
    failure = ''  # why it is of no use any more; empty while it works

    @property
    def settled(self) -> bool:
        """Whether the robot stands at rest, or was not walking in the first place."""
        return True

    @abstractmethod
    def step(self, situation: Situation, dt: float) -> Targets:
        """Return the next targets of all joints in [rad]."""


class Hold(Motion):
    """Holds the joints; if something else moves one, its set-point follows.

    So servos without torque can be moved by hand, and do not jump when torque returns.
    """

    def __init__(self, targets: Targets, band: float) -> None:
        """Hold some targets; a joint may deviate by the band [rad]."""
        self._targets = targets
        self._band = band

    def step(self, situation: Situation, dt: float) -> Targets:
        """Return the targets, kept within the band around the joint positions."""
        if situation.joints is not None:
            self._targets = tuple(
                min(max(target, position - self._band), position + self._band)
                for target, position in zip(self._targets, situation.joints.positions, strict=True)
            )
        return self._targets


class Blend(Motion):
    """Moves all joints to a pose in the same time, with a soft start and end."""

    def __init__(self, start: Targets, end: Targets, speed: float, least: float) -> None:
        """Plan the motion: maximum joint speed [rad/s], minimum duration [s]."""
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
    """Moves each joint to a pose on its own at full speed: no soft start, no common end."""

    def __init__(self, start: Targets, end: Targets, speed: float, duration: float) -> None:
        """Plan the motion: joint speed [rad/s]; joints that are late stop short."""
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
    """Walks with the geometric gait; stands at zero velocity."""

    def __init__(self, generator: GaitGenerator) -> None:
        self._generator = generator
        self.reachable = True  # whether the legs reached where they should in the last step

    @property
    def settled(self) -> bool:
        """Whether all feet stand at their neutral positions."""
        return self._generator.standing

    def step(self, situation: Situation, dt: float) -> Targets:
        """Return the next targets."""
        imu = situation.imu
        attitude = None if imu is None or imu.is_uncertain else imu.roll_pitch_yaw
        step = self._generator.step(situation.velocity, situation.pose, attitude, dt)
        self.reachable = step.reachable
        return step.targets
