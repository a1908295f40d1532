# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Poses of the legs that turn a robot from its back, side, nose or tail onto its belly.

They are data, for the XGO of quad_description, found by the cross-entropy method in physics, less
what lets legs touch each other or the trunk; those of the sides were found by looking at the
outline: which points touch the ground, and on what side of them the centre of mass is. The swings
off the back lift it by 7 cm, over the tail.
``bench/bench_get_up.py`` measures what they are worth. Another robot needs its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
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


_SPEED = 3.0  # [rad/s]
_SWING_SPEED = 10.0  # [rad/s], all that the URDF lets a joint have


@dataclass(frozen=True, slots=True)
class Stage:
    """One pose of a recovery."""

    # hip, thigh and calf of each leg in [rad], in the order of :data:`quad_description.LEGS`
    legs: Sequence[Vector]
    speed: float  # of the fastest joint in [rad/s]
    # of a swing in [s], in which each joint goes as fast as that, and which the next stage follows
    # at once, wherever the body is; None for going softly and coming to rest
    duration: float | None = None

    @property
    def mirrored(self) -> Stage:
        """The same for a robot that is this one's mirror image, left for right."""
        front_left, front_right, back_left, back_right = self.legs
        legs = front_right, front_left, back_right, back_left
        return Stage(legs, self.speed, self.duration)


def _on_left(lower: Vector, upper: Vector) -> Stage:
    """Return a stage of a robot that lies on its left side."""
    return Stage((lower, upper, lower, upper), _SPEED)


def _ends(front: Vector, back: Vector, speed: float = _SPEED) -> Stage:
    """Return a stage in which left and right do the same."""
    return Stage((front, front, back, back), speed)


def _swing(duration: float, front: Vector, back: Vector) -> Stage:
    """Return a swing in which left and right do the same."""
    return Stage((front, front, back, back), _SWING_SPEED, duration)


Recovery = tuple[Stage, ...]
"""Stages in a row; the body comes to rest after each."""

_ROLL: Recovery = (
    # feet of the lower legs, past the back, push the body onto their thighs, 60 deg from upright
    _on_left(lower=(0.52, -1.2, -1.1), upper=(0.52, 0.0, 0.8)),
    # thighs that point backward leave nothing below the belly: it tips over
    _on_left(lower=(0.52, 1.57, -1.1), upper=(-0.5, 0.0, 0.8)),
)
_STRAIGHT = (0.0, 0.0, 0.8)
"""Straight legs bring the centre of mass to the belly's side."""

_OFF_THE_NOSE: tuple[Recovery, ...] = (
    (_ends(front=_STRAIGHT, back=_STRAIGHT),),
    (_ends(front=(0.0, 1.57, 0.5), back=(0.0, 1.0, 0.5)),),
)
_OFF_THE_TAIL: tuple[Recovery, ...] = (
    (_ends(front=(0.1, 1.25, -0.7), back=(-0.2, -1.2, -0.5)),),
    (
        _ends(front=_STRAIGHT, back=_STRAIGHT),
        _ends(front=_STRAIGHT, back=(-0.2, -1.2, -0.5)),
    ),
)
_OFF_THE_BACK: tuple[Recovery, ...] = (
    (
        # drawn in, with the feet on the ground
        _ends(front=(-0.44, -0.97, 0.11), back=(0.43, -0.93, 0.79)),
        # a kick rears it up, onto tail and hind feet
        _swing(0.06, front=(-0.48, -0.17, 0.04), back=(0.49, -0.57, 0.31)),
        _swing(0.26, front=(0.35, 0.94, 0.82), back=(-0.38, -1.22, -1.13)),
        # front legs thrown to the belly pull it over the tail
        _swing(0.3, front=(0.11, 0.03, 0.25), back=(0.12, -0.4, -0.76)),
        # and it comes down on its legs
        _ends(front=(0.2, -0.29, -0.06), back=(0.03, -0.33, -0.6), speed=_SWING_SPEED),
    ),
    (  # for those that the first one leaves on the back
        _ends(front=(-0.45, -0.99, 0.14), back=(0.46, -0.93, 0.81)),
        _swing(0.06, front=(-0.5, -0.34, -0.07), back=(0.49, -0.53, 0.35)),
        _swing(0.3, front=(0.37, 0.94, 0.82), back=(-0.39, -1.22, -1.13)),
        _swing(0.3, front=(0.12, 0.09, 0.26), back=(0.09, -0.41, -0.69)),
        _ends(front=(0.21, -0.34, -0.11), back=(0.05, -0.43, -0.55), speed=_SWING_SPEED),
    ),
)

RECOVERIES: Mapping[Lying, tuple[Recovery, ...]] = {
    Lying.LEFT: (_ROLL,),
    Lying.RIGHT: (tuple(stage.mirrored for stage in _ROLL),),
    Lying.NOSE: _OFF_THE_NOSE,
    Lying.TAIL: _OFF_THE_TAIL,
    Lying.BACK: _OFF_THE_BACK,
}
"""For each side, in the order in which they are tried."""
