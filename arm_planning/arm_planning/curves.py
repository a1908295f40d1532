# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Curves that a link follows: lines and arcs, turning about one axis on the way."""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin

from arm_model import Array, Pose

from .exceptions import PlanningCode, PlanningError

MAX_RADIUS_DIFFERENCE = 1e-2
"""Greatest difference of the radii at start and goal of an arc in [m], as in Pilz' planner."""

COLLINEAR_TOLERANCE = 1e-5
"""Length of the cross product below which points are on a line, as in Pilz' planner."""


class _Turning:
    """A rotation about one axis that is fixed in the root link."""

    def __init__(self, start: Array, end: Array) -> None:
        self._start = start
        self.vector: Array = pin.log3(end @ start.T)
        self.angle = float(np.linalg.norm(self.vector))

    def at(self, share: float) -> Array:
        turned: Array = pin.exp3(share * self.vector) @ self._start
        return turned


class Line:
    """A straight line between two poses."""

    def __init__(self, start: Pose, end: Pose) -> None:
        """Draw.

        Args:
            start: Where it begins, in the root link.
        """
        self._turning = _Turning(start.rotation, end.rotation)
        self._start, self._way = start.position, end.position - start.position
        self._twist = np.concatenate((self._way, self._turning.vector))
        self.length = float(np.linalg.norm(self._way))
        self.angle = self._turning.angle

    def at(self, share: float) -> Pose:
        """Return the pose at a share of the way."""
        return Pose(self._turning.at(share), self._start + share * self._way)

    def twist(self, share: float) -> Array:
        """Return the derivative by the share, which is the same everywhere."""
        del share
        return self._twist

    def nearest(self, position: Array) -> float:
        """Return the share of the way that is nearest to a position."""
        return float((position - self._start) @ self._way) / max(self.length**2, 1e-18)


class Arc:
    """A part of a circle between two poses."""

    def __init__(self, start: Pose, end: Pose, center: Array, axis: Array) -> None:
        """Draw; :func:`arc_through` and :func:`arc_around` find the circle.

        Args:
            start: Where it begins, in the root link.
            axis: Vector about which it turns, of any length.
        """
        self._turning = _Turning(start.rotation, end.rotation)
        normal = axis / np.linalg.norm(axis)
        self._center = center
        self._first, last = start.position - center, end.position - center
        self._second = np.cross(normal, self._first)
        turn = math.atan2(float(np.cross(self._first, last) @ normal), float(self._first @ last))
        self._sweep = turn % (2.0 * math.pi)
        self.length = float(np.linalg.norm(self._first)) * self._sweep
        self.angle = self._turning.angle

    def at(self, share: float) -> Pose:
        """Return the pose at a share of the way."""
        turn = share * self._sweep
        around = math.cos(turn) * self._first + math.sin(turn) * self._second
        return Pose(self._turning.at(share), self._center + around)

    def twist(self, share: float) -> Array:
        """Return the derivative by the share."""
        turn = share * self._sweep
        along = math.cos(turn) * self._second - math.sin(turn) * self._first
        return np.concatenate((self._sweep * along, self._turning.vector))

    def nearest(self, position: Array) -> float:
        """Return the share of the way that is nearest to a position."""
        off = position - self._center
        turn = math.atan2(float(off @ self._second), float(off @ self._first))
        middle = 0.5 * self._sweep  # the turn that is nearest to the middle of the arc
        return (turn + 2.0 * math.pi * round((middle - turn) / (2.0 * math.pi))) / self._sweep


Curve = Line | Arc  # a way of a link in the root link, by a parameter from 0 to 1


def arc_through(start: Pose, interim: Array, end: Pose) -> Arc:
    """Return the arc through a point.

    Args:
        start: Where it begins, in the root link.
        interim: A point on it in [m].

    Raises:
        PlanningError: The three are on a line, or two of them are one.
    """
    first, second = interim - start.position, end.position - start.position
    across = np.cross(first, second)
    size = float(np.linalg.norm(across))
    if size < COLLINEAR_TOLERANCE:
        raise _no_circle(
            'start, interim point and goal are on a line; move the interim point off it, or use'
            ' LIN'
        )
    # of the circle about a triangle
    center = start.position + np.cross(
        (first @ first) * second - (second @ second) * first, across
    ) / (2.0 * size**2)
    return Arc(start, end, center, across)


def arc_around(start: Pose, center: Array, end: Pose) -> Arc:
    """Return the shorter arc about a center.

    Args:
        start: Where it begins, in the root link.

    Raises:
        PlanningError: The radii differ, or the three are on a line, as with half a circle.
    """
    first, last = start.position - center, end.position - center
    radii = float(np.linalg.norm(first)), float(np.linalg.norm(last))
    if abs(radii[0] - radii[1]) > MAX_RADIUS_DIFFERENCE:
        raise _no_circle(
            f'the start is {radii[0]:.4f} m from the center, the goal {radii[1]:.4f} m; they may'
            f' differ by {MAX_RADIUS_DIFFERENCE:g} m'
        )
    across = np.cross(first, last)
    if np.linalg.norm(across) < COLLINEAR_TOLERANCE:
        raise _no_circle(
            'start, center and goal are on a line, which makes no plane (half a circle, or none);'
            ' give an interim point'
        )
    # through start and goal exactly: the center on the plane between them that is nearest
    chord = end.position - start.position
    middle = 0.5 * (start.position + end.position)
    chord /= np.linalg.norm(chord)
    center = center - ((center - middle) @ chord) * chord
    return Arc(start, end, center, across)


def _no_circle(reason: str) -> PlanningError:
    return PlanningError(PlanningCode.INVALID_MOTION_PLAN, f'CIRC: {reason}')
