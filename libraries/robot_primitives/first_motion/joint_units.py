# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Units in which a person speaks of a joint: degrees and millimetres, against rad and m."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
import math
import re

QUANTITY = re.compile(r'(?P<number>[+-]?(?:\d+(?:\.\d*)?|\.\d+))\s*(?P<unit>deg|rad|mm|m)?')


class JointKind(Enum):
    """What a joint does; the value is the unit that a person reads."""

    TURNS = 'deg'
    SLIDES = 'mm'

    @property
    def size(self) -> float:
        """That unit in the one of bus.yml, in [rad] or [m]."""
        return math.pi / 180.0 if self is JointKind.TURNS else 0.001

    def shown(self, value: float) -> str:
        """Return a value in [rad] or [m] as a person reads it."""
        return f'{value / self.size:.4g} {self.value}'


FASTEST = {JointKind.TURNS: math.radians(5.0), JointKind.SLIDES: 0.01}
"""Speeds above which this is no first motion, in [rad/s] and [m/s]."""
FURTHEST = {JointKind.TURNS: math.radians(20.0), JointKind.SLIDES: 0.05}
"""Distances likewise, in [rad] and [m]."""
INCREMENTS_MIN = 4  # of the drive that a motion has to have to be seen
UNITS: dict[str, tuple[JointKind, float]] = {
    'deg': (JointKind.TURNS, math.pi / 180.0),
    'rad': (JointKind.TURNS, 1.0),
    'mm': (JointKind.SLIDES, 0.001),
    'm': (JointKind.SLIDES, 1.0),
}
"""Kind of joint and size in [rad] or [m] of the units that can be written."""


@dataclass(frozen=True, slots=True)
class Quantity:
    """A distance or speed that a person has written."""

    kind: JointKind  # what the joint does
    value: float  # in [rad] or [m], or those per second


def read_quantity(text: str, kind: JointKind = JointKind.TURNS) -> Quantity:
    """Read ``1deg``, ``0.02rad``, ``2mm``, or a number in the unit of a kind of joint.

    Raises:
        ValueError: It is none.
    """
    match = QUANTITY.fullmatch(text.strip())
    if match is None:
        raise ValueError(f'{text!r} is no distance; write 1deg, 0.02rad or 2mm')
    found, size = UNITS[match['unit'] or kind.value]
    return Quantity(found, float(match['number']) * size)


def too_far(kind: JointKind, distance: float) -> str:
    """Return why a distance, in [rad] or [m], is not that of a first motion; empty when it is."""
    if 0.0 < abs(distance) <= FURTHEST[kind]:
        return ''
    return (
        f'{kind.shown(distance)}: a first motion is short, up to {kind.shown(FURTHEST[kind])} and '
        'not 0'
    )


def too_fast(kind: JointKind, speed: float) -> str:
    """Return why a speed, in [rad/s] or [m/s], is not that of a first motion; empty when it is."""
    if 0.0 < speed <= FASTEST[kind]:
        return ''
    return (
        f'{kind.shown(speed)}/s: a first motion is slow; give a speed above 0 and up to '
        f'{kind.shown(FASTEST[kind])} per second'
    )


def too_few_increments(kind: JointKind, distance: float, scale: float) -> str:
    """Return why a distance in [rad] or [m] cannot be seen; empty when it can.

    The scale is in increments per [rad] or [m].
    """
    increments = abs(distance * scale)
    if increments >= INCREMENTS_MIN:
        return ''
    return (
        f'{kind.shown(distance)} are {increments:.2g} increments, too few to be seen; correct '
        'scale_pos_to_dev, or take a larger distance'
    )
