# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Units in which a person speaks of a joint: degrees and millimetres, against rad and m."""

from __future__ import annotations

from enum import Enum
import math


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
