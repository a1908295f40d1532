# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""On what side a robot lies, by the direction of gravity in its body."""

from __future__ import annotations

from enum import Enum

from quad_description.rotations import Vector


class Lying(Enum):
    """What is below; the value is for people, behind "it lies"."""

    BELLY = 'on its belly or legs'
    LEFT = 'on its left side'
    RIGHT = 'on its right side'
    NOSE = 'on its nose'
    TAIL = 'on its tail'
    BACK = 'on its back'

    @property
    def mirrored(self) -> Lying:
        """What is below a robot that is this one's mirror image, left for right."""
        return _MIRRORED.get(self, self)


_MIRRORED = {Lying.LEFT: Lying.RIGHT, Lying.RIGHT: Lying.LEFT}


def lying_on(down: Vector) -> Lying:
    """Return which side of the body is nearest to the ground.

    Args:
        down: Direction of gravity in the body's frame; of any length but zero.
    """
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
