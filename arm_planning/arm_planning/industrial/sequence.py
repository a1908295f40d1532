# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Sequences: motions one after the other, with or without a stop between them.

A blend leaves one motion where the link enters a sphere about the point between them, and joins
the next where it leaves the sphere. Between the two a polynomial of fifth degree leads the joints,
on which position, velocity and acceleration do not jump; that the link stays in the sphere is
measured.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from arm_model import Array
from arm_trajectory import Path

from ..exceptions import PlanningCode, PlanningError
from ..ik.link_kinematics import LinkKinematics
from ..requests import MotionRequest
from ..retime import FullSpeedPath

SAMPLES = 65  # places at which a motion, or a blend, is looked at
MAX_BISECTIONS = 40  # steps to the place at which a motion crosses a sphere
SHRINK = 0.8  # factor of the sphere when a blend has left it
MAX_SHRINKS = 10  # how often it is tried smaller

BLEND_MARGIN = 0.95
"""Share of acceleration and jerk of the profile in a blended group: joints bend besides."""


@dataclass(frozen=True, slots=True, eq=False)
class SequenceItem:
    """A motion of a sequence."""

    # the motion, whose start counts for the first one alone; or what makes it of the joint
    # positions in [rad] (n) at which it begins, for the first one of None
    request: MotionRequest | Callable[[Array | None], MotionRequest]
    # radius about its goal in which the next motion may begin, in [m]; 0 stops
    blend_radius: float = 0.0

    def at(self, start: Array | None) -> MotionRequest:
        """Return the motion.

        Args:
            start: Where it begins in [rad] (n); None for the first one.
        """
        if isinstance(self.request, MotionRequest):
            return self.request
        return self.request(start)


def check_radii(radii: Sequence[float]) -> None:
    """Refuse what are no blend radii of a sequence, by the rules of Pilz' planner.

    Raises:
        PlanningError: There is none, one is negative or not finite, or the last is not 0.
    """
    if not radii:
        raise _refused('no items')
    for number, radius in enumerate(radii):
        if not radius >= 0.0 or not np.isfinite(radius):
            raise _refused(f'item {number}: blend radius {radius}; give 0 m or more')
    if radii[-1] > 0.0:
        raise _refused(
            f'the last item has a blend radius of {radii[-1]:g} m, and nothing follows it; give 0'
        )


def check_overlap(radii: Sequence[float], corners: Sequence[Array], first: int) -> None:
    """Refuse blends that overlap.

    Raises:
        PlanningError: The spheres of two neighbours overlap.
    """
    pairs = zip(pairwise(radii), pairwise(corners), strict=True)
    for number, ((radius, following), (corner, other)) in enumerate(pairs, first):
        distance = float(np.linalg.norm(other - corner))
        if following > 0.0 and radius + following > distance:
            raise _refused(
                f'blend radii of items {number} and {number + 1} overlap: {radius:g} m and'
                f' {following:g} m, and the goals are {distance:.4f} m apart'
            )


def joined(
    parts: Sequence[FullSpeedPath], radii: Sequence[float], link: LinkKinematics, first: int
) -> FullSpeedPath:
    """Return one path at full speed of motions that follow without a stop.

    Args:
        parts: The motions, two or more; each begins where the one before ends.

    Raises:
        PlanningError: A motion is shorter than the radius, or a blend does not stay in its sphere.
    """
    blends = [
        _Blend.between(before.path, after.path, radius, link, first + number)
        for number, ((before, after), radius) in enumerate(
            zip(pairwise(parts), radii, strict=False)
        )
    ]
    pieces: list[Path] = []
    begin = 0.0
    for number, part in enumerate(parts):
        end = blends[number].leave if number < len(blends) else part.path.duration
        if end <= begin:
            raise _refused(
                f'blends at both ends of item {first + number} overlap; give smaller ones'
            )
        pieces.append(part.path.part(begin, end))
        if number < len(blends):
            pieces.append(blends[number].path)
            begin = blends[number].join
    notes = tuple(note for part in parts for note in part.notes)
    return FullSpeedPath(
        Path.joined(pieces),
        BLEND_MARGIN * min(part.acceleration for part in parts),
        BLEND_MARGIN * min(part.jerk for part in parts),
        notes=notes,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Blend:
    """How a motion leads into the next."""

    leave: float  # when the first is left, in its time in [s]
    join: float  # when the second is joined, in its time in [s]
    path: Path  # what leads from one to the other

    @classmethod
    def between(
        cls, before: Path, after: Path, radius: float, link: LinkKinematics, number: int
    ) -> _Blend:
        """Return the blend in a sphere about the end of the first."""
        corner = link.pose(before.end.position).position
        smaller = radius
        for _ in range(MAX_SHRINKS):
            leave = _last_crossing(before, corner, smaller, link, backward=True)
            join = _last_crossing(after, corner, smaller, link, backward=False)
            for item, found in ((number, leave), (number + 1, join)):
                if found is None:
                    raise _refused(
                        f'the blend radius of item {number}, {radius:g} m, holds all of item'
                        f' {item}; give a smaller one'
                    )
            assert leave is not None  # noqa: S101  both were looked at
            assert join is not None  # noqa: S101
            lasts = before.duration - leave + join
            bridge = Path.between(lasts, before.at(leave), after.at(join))
            blend = cls(leave, join, bridge)
            if blend.farthest(corner, link) <= radius:
                return blend
            smaller *= SHRINK
        raise _refused(
            f'no blend of items {number} and {number + 1} stays within {radius:g} m: the joints'
            ' move too differently; give 0, and the arm stops between them'
        )

    def farthest(self, corner: Array, link: LinkKinematics) -> float:
        """Return the greatest distance of the link from the corner on it in [m]."""
        rows = self.path.positions(np.linspace(0.0, self.path.duration, SAMPLES))
        return max(float(np.linalg.norm(link.pose(row).position - corner)) for row in rows)


def _last_crossing(
    path: Path, corner: Array, radius: float, link: LinkKinematics, *, backward: bool
) -> float | None:
    """Return when a path crosses a sphere next to its end, or its begin; None for never."""

    def outside(time: float) -> bool:
        positions = path.positions(np.array([time]))[0]
        return bool(np.linalg.norm(link.pose(positions).position - corner) >= radius)

    times = np.linspace(0.0, path.duration, SAMPLES).tolist()
    ordered = times[::-1] if backward else times
    for inner, outer in pairwise(ordered):
        if outside(outer):
            low, high = float(inner), float(outer)
            for _ in range(MAX_BISECTIONS):
                middle = 0.5 * (low + high)
                low, high = (low, middle) if outside(middle) else (middle, high)
            return low
    return None


def _refused(reason: str) -> PlanningError:
    return PlanningError(PlanningCode.INVALID_MOTION_PLAN, f'sequence: {reason}')
