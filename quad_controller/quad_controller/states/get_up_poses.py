# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Poses of the legs that turn a robot from its side, nose or tail onto its belly.

They are data, for the XGO of quad_description. ``bench/search_get_up.py`` searches such poses in
physics, and leaves out those in which legs touch each other or the trunk; those of the sides were
found by looking at the outline: which points touch the ground, and on what side of them the centre
of mass is. ``bench/bench_get_up.py`` measures what they are worth. Another robot needs its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from quad_description.rotations import Vector

from .lying import Lying

_SPEED = 3.0  # [rad/s]


@dataclass(frozen=True, slots=True)
class Stage:
    """One pose of a recovery.

    Attributes:
        legs: Hip, thigh and calf of each leg in [rad], in the order of
            :data:`quad_description.LEGS`.
        speed: Of the fastest joint in [rad/s].
    """

    legs: Sequence[Vector]
    speed: float

    @property
    def mirrored(self) -> Stage:
        """The same for a robot that is this one's mirror image, left for right."""
        front_left, front_right, back_left, back_right = self.legs
        return Stage((front_right, front_left, back_right, back_left), self.speed)


def _on_left(lower: Vector, upper: Vector) -> Stage:
    """Return a stage of a robot that lies on its left side."""
    return Stage((lower, upper, lower, upper), _SPEED)


def _ends(front: Vector, back: Vector) -> Stage:
    """Return a stage in which left and right do the same."""
    return Stage((front, front, back, back), _SPEED)


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

RECOVERIES: Mapping[Lying, tuple[Recovery, ...]] = {
    Lying.LEFT: (_ROLL,),
    Lying.RIGHT: (tuple(stage.mirrored for stage in _ROLL),),
    Lying.NOSE: _OFF_THE_NOSE,
    Lying.TAIL: _OFF_THE_TAIL,
}
"""For each side, in the order in which they are tried.

None leads up from the back: see the README, "Measured in simulation".
"""
