# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The wave: every joint swings about the middle of its range, each a little later than the last.

A joint enters from wherever it stands. With the entry r(t/T), the quintic step of duration T,

    p(t) = start + r(t/T) (centre + A sin(omega t + phase) - start)

which begins at ``start`` with velocity and acceleration zero, is twice continuously
differentiable, and as a convex combination never leaves the hull of the start and the swing.
With the offset D = |centre - start| its speed is at most (D + A) r1/T + A omega, where r1 = 15/8
is the greatest slope of the quintic step.

That is a path for drives to follow; the limits of the motion are those of each drive.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import math

from urdf_reader import JointRange

from ...exceptions import WaveError

STEP_SLOPE = 15 / 8
"""Greatest first derivative of the quintic step."""


def quintic_step(x: float) -> float:
    """Go from 0 at x <= 0 to 1 at x >= 1 with two continuous derivatives.

    Args:
        x: Where, without unit.
    """
    x = min(max(x, 0.0), 1.0)
    return min(x * x * x * (10.0 + x * (6.0 * x - 15.0)), 1.0)  # rounding may pass 1


@dataclass(frozen=True, slots=True)
class WaveStyle:
    """How the wave looks, and how far it stays from the limits.

    Attributes:
        amplitude: Greatest amplitude in [rad] or [m].
        period: Time of one swing in [s].
        range_share: The swing covers at most this share of a joint's range.
        velocity_share: A joint is at most at this share of its velocity limit.
        max_velocity: No joint is faster, in [rad/s] or [m/s]: drives approach their targets at
            that speed or less, and some URDFs have limits of thousands.
        shortest_entry: A joint takes at least this long to enter in [s].
    """

    amplitude: float = 0.45
    period: float = 5.0
    range_share: float = 0.5
    velocity_share: float = 0.6
    max_velocity: float = 1.2
    shortest_entry: float = 2.0

    @property
    def omega(self) -> float:
        """Angular velocity of the phase in [rad/s]."""
        return 2 * math.pi / self.period


@dataclass(frozen=True, slots=True)
class Swing:
    """The motion of one joint.

    Attributes:
        name: Name of the joint.
        centre: Middle of the swing in [rad] or [m].
        amplitude: Its amplitude in [rad] or [m].
        phase: How far it is ahead in [rad].
        velocity: Speed that it never exceeds in [rad/s] or [m/s].
    """

    name: str
    centre: float
    amplitude: float
    phase: float
    velocity: float

    def position(self, start: float, entered: float, theta: float) -> float:
        """Evaluate the path.

        Args:
            start: Where the joint stood when it entered, in [rad] or [m].
            entered: Time since then as a share of the duration of the entry.
            theta: Phase of the wave in [rad].

        Returns:
            The position in [rad] or [m].
        """
        target = self.centre + self.amplitude * math.sin(theta + self.phase)
        return start + quintic_step(entered) * (target - start)

    def entry_duration(self, start: float, style: WaveStyle) -> float:
        """Return how long the entry must take for the bound on the speed to hold, in [s].

        Args:
            start: Where the joint stands, in [rad] or [m].
            style: The style of the wave.
        """
        way = abs(self.centre - start) + self.amplitude
        left = self.velocity - self.amplitude * style.omega
        return max(style.shortest_entry, way * STEP_SLOPE / left)


def plan_swing(limits: JointRange, phase: float, style: WaveStyle) -> Swing:
    """Choose centre and amplitude within the limits of a joint.

    Args:
        limits: Limits of the joint; without a range it swings about zero.
        phase: How far it is ahead in [rad].
        style: The style of the wave.

    Raises:
        WaveError: The joint has no range, or may not move.
    """
    if not limits.upper > limits.lower or not limits.velocity > 0:
        raise WaveError(
            f'joint {limits.name} cannot swing: its range is {limits.lower:g} to '
            f'{limits.upper:g}, its velocity limit {limits.velocity:g}'
        )
    velocity = min(style.velocity_share * limits.velocity, style.max_velocity)
    half_range = (limits.upper - limits.lower) / 2
    amplitude = min(style.amplitude, style.range_share * half_range, 0.6 * velocity / style.omega)
    centre = 0.0 if math.isinf(half_range) else (limits.lower + limits.upper) / 2
    return Swing(limits.name, centre, amplitude, phase, velocity)


def plan_wave(
    limits: Mapping[str, JointRange], drives: Sequence[str], style: WaveStyle
) -> list[Swing]:
    """Plan the wave for all drives that there is a joint for.

    Args:
        limits: The joints of the robot by name.
        drives: Names of the drives of the bus.
        style: The style of the wave.

    Returns:
        One swing for each, in the order of the drives; together they are one wave long.

    Raises:
        WaveError: No drive has the name of a joint, or a joint cannot swing.
    """
    joints = [name for name in drives if name in limits]
    if not joints:
        raise WaveError(
            f'no drive has the name of a joint; drives: {", ".join(drives)}; '
            f'joints: {", ".join(limits)}'
        )
    lag = 2 * math.pi / len(joints)
    return [plan_swing(limits[name], -i * lag, style) for i, name in enumerate(joints)]
