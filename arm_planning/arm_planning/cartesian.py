# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Lines and arcs of a link, and joint paths along lines as in MoveIt's compute_cartesian_path.

IK is solved at points at most ``max_step`` apart, each time next to the previous solution. The
path ends before the first point without a solution, in contact, or after a joint jump; the
fraction says how much of it was reached.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
import math

import numpy as np
import pinocchio as pin

from arm_model import (
    Array,
    checked,
    Clearances,
    frozen,
    JointLimits,
    Mask,
    PlanningScene,
    Pose,
    RobotModel,
)

from .exceptions import PlanningCode, PlanningError
from .ik import check_pose, descend
from .link_kinematics import LinkKinematics

MAX_RADIUS_DIFFERENCE = 1e-2
"""Greatest difference of the radii at start and goal of an arc in [m], as in Pilz' planner."""

COLLINEAR_TOLERANCE = 1e-5
"""Length of the cross product below which points are collinear, as in Pilz' planner."""


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
        self._turning = _Turning(start.rotation, end.rotation)
        self._start, self._way = start.position, end.position - start.position
        self._twist = np.concatenate((self._way, self._turning.vector))
        self.length = float(np.linalg.norm(self._way))
        self.angle = self._turning.angle

    def at(self, share: float) -> Pose:
        """Return the pose at a share of the way."""
        return Pose(self._turning.at(share), self._start + share * self._way)

    def twist(self, share: float) -> Array:
        """Return the derivative with respect to the share; it is constant."""
        del share
        return self._twist

    def nearest(self, position: Array) -> float:
        """Return the share of the way that is nearest to a position."""
        return float((position - self._start) @ self._way) / max(self.length**2, 1e-18)


class Arc:
    """A part of a circle between two poses."""

    def __init__(self, start: Pose, end: Pose, center: Array, axis: Array) -> None:
        """Build an arc about an axis of any length; :func:`arc_through` finds the circle."""
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
        """Return the derivative with respect to the share."""
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
    """Return the arc through a point in [m]; refuse a point collinear with the ends."""
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
    """Return the arc of less than half a turn about a center in [m]; the radii must be equal."""
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
            'start, center and goal are on a line (half a circle, or no arc), so the plane is not'
            ' defined; give an interim point'
        )
    # through start and goal exactly: the center on the plane between them that is nearest
    chord = end.position - start.position
    middle = 0.5 * (start.position + end.position)
    chord /= np.linalg.norm(chord)
    center = center - ((center - middle) @ chord) * chord
    return Arc(start, end, center, across)


def _no_circle(reason: str) -> PlanningError:
    return PlanningError(PlanningCode.INVALID_MOTION_PLAN, f'CIRC: {reason}')


MIN_STEPS_FOR_JUMPS = 10
"""Least number of steps for a joint-jump check against the mean step, as in MoveIt."""

MAX_STEPS = 100_000  # places on a path at most
ROTATION_STEP = 0.05  # greatest rotation between two places in [rad], where the way says less


@dataclass(frozen=True, slots=True)
class JumpThresholds:
    """Limits above which a step between two points is a joint jump; 0 for no limit."""

    relative: float = 0.0  # times the mean step of the path, in joint space
    revolute: float = 0.0  # greatest step of a joint that turns in [rad]
    prismatic: float = 0.0  # greatest step of a joint that slides in [m]

    def __post_init__(self) -> None:
        """Refuse invalid thresholds."""
        for name in ('relative', 'revolute', 'prismatic'):
            value = getattr(self, name)
            if not value >= 0.0:
                raise PlanningError(
                    PlanningCode.INVALID_GOAL_CONSTRAINTS,
                    f'{name} jump threshold is {value}; give 0, or more',
                )


@dataclass(frozen=True, slots=True, eq=False)
class CartesianPath:
    """Joint positions along waypoints."""

    positions: Array  # joint positions in [rad] (k, n), the start among them
    fraction: float  # share of the way that they lead, from 0 to 1
    reason: str  # why they end there, in words; empty where they lead to the end


def cartesian_path(
    model: RobotModel,
    start: Sequence[float] | Array,
    waypoints: Sequence[Pose],
    max_step: float,
    *,
    link: str = '',
    jumps: JumpThresholds | None = None,
    scene: PlanningScene | None = None,
    is_valid: Callable[[Array], bool] | None = None,
) -> CartesianPath:
    """Return joint positions along straight lines through waypoints.

    Args:
        waypoints: Poses of the link in the root link.
        max_step: Greatest travel of the link between two points in [m].
        is_valid: Further check of each point, such as path constraints.

    Raises:
        PlanningError: There is no waypoint, no step, or no such link.
        CommandError: A number is not finite, or the number of values is wrong.
    """
    here = checked(start, len(model), 'start')
    moved = LinkKinematics(model, link)
    clearances = None if scene is None else Clearances(scene)
    lines = _lines(moved, here, waypoints)
    counts = _counts(lines, max_step)
    poses = (
        line.at(number / count)
        for line, count in zip(lines, counts, strict=True)
        for number in range(1, count + 1)
    )
    rows, reason = [here], ''
    for pose in poses:
        row, reason = _step(moved, model.limits, pose, rows[-1])
        if not reason and clearances is not None:
            reason = _contact(clearances, row)
        if not reason and is_valid is not None and not is_valid(row):
            reason = 'a constraint is violated next to it'
        if reason:
            break
        rows.append(row)
    positions = np.array(rows)
    if jumps is not None:
        turning = model.kinematics.projected(moved.axes(here))[3:]
        slides = np.abs(turning).max(axis=0) == 0.0
        kept = _first_jump(positions, jumps, slides)
        if kept < len(positions):
            step = np.abs(positions[kept] - positions[kept - 1])
            joint = int(step.argmax())
            reason = f'{model.limits.names[joint]} would jump by {step[joint]:.3f}'
            positions = positions[:kept]
    total = sum(counts)
    fraction = 1.0 if total == 0 else (len(positions) - 1) / total
    if reason:
        reason = f'the path ends at {fraction:.1%}: {reason}'
    return CartesianPath(frozen(positions), fraction, reason)


def _step(
    link: LinkKinematics, limits: JointLimits, pose: Pose, before: Array
) -> tuple[Array, str]:
    """Return joint positions for a pose near given ones, or why there are none."""
    end = descend(link, pose, before, limits.lower, limits.upper)
    if end.converged:
        return end.positions, ''
    way, turn = np.linalg.norm(end.error[:3]), np.linalg.norm(end.error[3:])
    return before, (
        f'no joint positions within the limits next to it; {1e3 * way:.1f} mm and'
        f' {turn:.3f} rad are left'
    )


def _contact(clearances: Clearances, positions: Array) -> str:
    contacts = clearances.contacts(positions)
    if not contacts:
        return ''
    first, second = contacts[0].bodies
    return f'{first} and {second} overlap by {1e3 * contacts[0].depth:.1f} mm next to it'


def _lines(link: LinkKinematics, start: Array, waypoints: Sequence[Pose]) -> list[Line]:
    if not waypoints:
        raise PlanningError(
            PlanningCode.INVALID_GOAL_CONSTRAINTS, 'no way-points; give one at least'
        )
    lines, begin = [], link.pose(start)
    for pose in waypoints:
        check_pose(pose)
        lines.append(Line(begin, pose))
        begin = pose
    return lines


def _counts(lines: Sequence[Line], max_step: float) -> list[int]:
    """Return the number of steps of each line."""
    if not max_step > 0.0:
        raise PlanningError(
            PlanningCode.INVALID_GOAL_CONSTRAINTS,
            f'max_step is {max_step} m; give a positive one, such as 0.01',
        )
    counts = [math.ceil(max(line.length / max_step, line.angle / ROTATION_STEP)) for line in lines]
    if sum(counts) > MAX_STEPS:
        raise PlanningError(
            PlanningCode.INVALID_GOAL_CONSTRAINTS,
            f'{sum(counts)} steps of {max_step} m; {MAX_STEPS} are allowed: give a greater step',
        )
    return counts


def _first_jump(positions: Array, jumps: JumpThresholds, slides: Mask) -> int:
    """Return how many rows come before the first jump."""
    steps = np.abs(np.diff(positions, axis=0))
    most = np.where(slides, jumps.prismatic or np.inf, jumps.revolute or np.inf)
    jumped = (steps > most).any(axis=1)
    if jumps.relative and len(steps) >= MIN_STEPS_FOR_JUMPS:
        lengths = np.linalg.norm(steps, axis=1)
        jumped |= lengths > jumps.relative * lengths.mean()
    return int(jumped.argmax()) + 1 if jumped.any() else len(positions)
