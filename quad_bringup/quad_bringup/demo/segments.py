# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the demo's robot has to do, segment by segment."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
import itertools

from quad_controller.gait.parameters import GaitParameters
from quad_controller.gait.schedule import Gait

MIN_DURATION = 6.0
"""Least duration in [s] in which every segment can show something."""
SETTLING = 1.0
"""Time in [s] of a segment that is not measured: the robot takes up speed."""
SETTLING_RATIO = 0.4
"""Largest part of a segment that is settling."""
USUAL = 20.0
"""Duration in [s] of a round when the demo has no end."""


@dataclass(frozen=True, slots=True)
class Velocity:
    """A velocity of the body in its own frame (REP 103).

    Attributes:
        forward: Along x in [m/s].
        left: Along y in [m/s].
        turn: About z, counter-clockwise, in [rad/s].
    """

    forward: float = 0.0
    left: float = 0.0
    turn: float = 0.0

    def scaled(self, share: float) -> Velocity:
        """Return a share of it."""
        return Velocity(share * self.forward, share * self.left, share * self.turn)


STANDSTILL = Velocity()


@dataclass(frozen=True, slots=True)
class Segment:
    """A part of the demo with one velocity.

    Attributes:
        name: What it shows.
        velocity: What is commanded.
        duration: How long in [s].
    """

    name: str
    velocity: Velocity
    duration: float

    @property
    def settling(self) -> float:
        """Time in [s] from its beginning that is not measured."""
        return min(SETTLING, SETTLING_RATIO * self.duration)


SEGMENT_RATIOS = (
    ('walk', Velocity(forward=0.2), 0.4),
    ('turn', Velocity(turn=0.8), 0.25),
    ('strafe', Velocity(left=0.1), 0.25),
    ('stop', STANDSTILL, 0.1),
)
"""Segments of a round, with their share of its time; speeds that the XGO's trot is made for."""


def share_of(gait: str) -> float:
    """Return how fast a gait is, compared with a trot.

    Args:
        gait: Its name.
    """
    top_speed = GaitParameters().top_speed
    return top_speed(Gait(gait)) / top_speed(Gait.TROT)


def one_round(duration: float, share: float = 1.0) -> list[Segment]:
    """Plan a round.

    Args:
        duration: Its time in [s].
        share: Of the velocities of a trot.

    Raises:
        ValueError: That is too short to show anything.
    """
    if not duration >= MIN_DURATION:
        raise ValueError(f'{duration:g} s is too short; the demo needs {MIN_DURATION:g} s')
    return [
        Segment(name, velocity.scaled(share), part * duration)
        for name, velocity, part in SEGMENT_RATIOS
    ]


def segments(duration: float | None, share: float = 1.0) -> Iterator[Segment]:
    """Return what comes after what.

    Args:
        duration: Time in [s] for one round; None for rounds without end.
        share: Of the velocities of a trot.
    """
    if duration is not None:
        return iter(one_round(duration, share))
    return itertools.cycle(one_round(USUAL, share))
