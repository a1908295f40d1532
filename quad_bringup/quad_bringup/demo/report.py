# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Progress in a line, the summary at the end, and whether all went well."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
import math

from .figures import Figures, UNKNOWN
from .segments import Segment, Velocity

LINEAR_TOLERANCE = 0.04
"""Greatest difference of commanded and measured speed in [m/s]."""
TURN_TOLERANCE = 0.2
"""Greatest difference of commanded and measured rate in [rad/s]."""
RELATIVE_TOLERANCE = 0.5
"""The same as a share of what was commanded: a slow robot that stands has not walked."""
TILT_LIMIT = math.radians(15.0)
"""A body that leaned more than this in [rad] did not walk, it stumbled."""
MIN_RATE = 45.0
"""Joint commands per second below which the loop did not hold its 50 Hz."""


@dataclass(frozen=True, slots=True)
class Measured:
    """A segment of the demo, and what came of it.

    Attributes:
        segment: What was commanded.
        measured: Mean velocity of the simulated body; None without ground truth.
        odometry: Mean velocity by /odom; None without it.
    """

    segment: Segment
    measured: Velocity | None
    odometry: Velocity | None

    @property
    def best(self) -> Velocity | None:
        """What is known best of how it moved."""
        return self.measured or self.odometry


def progress_line(figures: Figures) -> str:
    """Return how it goes.

    Args:
        figures: The latest.
    """
    if figures.state == UNKNOWN or math.isnan(figures.periods.rate):
        return 'waiting for the controller'
    speed = figures.measured or figures.odometry
    return (
        f'{figures.state}, commanded {velocity_text(figures.commanded)}, '
        f'measured {velocity_text(speed)}, tilt {math.degrees(figures.tilt):.1f}°, '
        f'{period_text(figures)}'
    )


def velocity_text(velocity: Velocity | None) -> str:
    """Write a velocity: forward, left, turn.

    Args:
        velocity: What to write; None for unknown.
    """
    if velocity is None:
        return 'unknown'
    forward, left, turn = _tidy(velocity)
    return f'{forward:+.3f} {left:+.3f} m/s {turn:+.2f} rad/s'


def _columns(velocity: Velocity | None) -> str:
    if velocity is None:
        return f'{"unknown":^19}'
    forward, left, turn = _tidy(velocity)
    return f'{forward:+6.3f} {left:+6.3f} {turn:+5.2f}'


def _tidy(velocity: Velocity) -> tuple[float, float, float]:
    """Round, and turn a negative zero into zero."""
    forward, left, turn = velocity.forward, velocity.left, velocity.turn
    return round(forward, 3) + 0.0, round(left, 3) + 0.0, round(turn, 2) + 0.0


def period_text(figures: Figures) -> str:
    """Write the rate and jitter of the loop.

    Args:
        figures: The latest.
    """
    periods = figures.periods
    return (
        f'joint commands {periods.rate:.1f} Hz, jitter p50/p99 '
        f'{1000 * periods.jitter_p50:.2f}/{1000 * periods.jitter_p99:.2f} ms'
    )


def summary_lines(figures: Figures, segments: Sequence[Measured]) -> list[str]:
    """Sum a demo up.

    Args:
        figures: The last ones before it lay down.
        segments: What was measured.
    """
    head = f'{"[m/s, rad/s]":<14}  {"commanded":^19}  {"in physics":^19}  {"by /odom":^19}'
    names = f'{"":<14}' + 3 * f'  {"ahead":>6} {"left":>6} {"turn":>5}'
    rows = [
        f'{each.segment.name:<7}{each.segment.duration:5.1f} s  '
        f'{_columns(each.segment.velocity)}  {_columns(each.measured)}  {_columns(each.odometry)}'
        for each in segments
    ]
    body = f'tilt at most {math.degrees(figures.tilt_max):.1f}°, {period_text(figures)}'
    return [head, names, *rows, body]


def problems(figures: Figures, segments: Sequence[Measured]) -> list[str]:
    """Return what went wrong.

    Args:
        figures: The last ones before it lay down.
        segments: What was measured.

    Returns:
        One sentence each; empty when all went well.
    """
    return [
        *(text for each in segments for text in _wrong_speed(each)),
        *_wrong_body(figures),
    ]


def _wrong_speed(each: Measured) -> Iterator[str]:
    name = each.segment.name
    speed, wanted = each.best, each.segment.velocity
    if speed is None:
        yield f'{name}: no motion was measured, neither by ground truth nor by /odom'
        return
    linear = math.hypot(speed.forward - wanted.forward, speed.left - wanted.left)
    linear_tolerance = _tolerance(LINEAR_TOLERANCE, math.hypot(wanted.forward, wanted.left))
    turn_tolerance = _tolerance(TURN_TOLERANCE, abs(wanted.turn))
    if not linear <= linear_tolerance or not abs(speed.turn - wanted.turn) <= turn_tolerance:
        yield f'{name}: commanded {velocity_text(wanted)}, but moved {velocity_text(speed)}'


def _tolerance(most: float, wanted: float) -> float:
    return min(most, RELATIVE_TOLERANCE * wanted) if wanted else most


def _wrong_body(figures: Figures) -> Iterator[str]:
    if figures.fault:
        yield f'the controller is in a fault: {figures.fault}'
    if not figures.tilt_max <= TILT_LIMIT:
        yield (
            f'the body leaned by {math.degrees(figures.tilt_max):.1f}°, more than '
            f'{math.degrees(TILT_LIMIT):.0f}°'
        )
    if not figures.periods.rate >= MIN_RATE:
        yield (
            f'{figures.periods.rate:.1f} joint commands a second, less than {MIN_RATE:g}: '
            'is this machine too busy?'
        )
