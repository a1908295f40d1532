# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Plans PTP, LIN, CIRC and sequences of them, with or without a stop between two motions.

A blend leaves one motion where the link enters a sphere about their common point, and joins the
next where the link leaves the sphere. In between, the joints follow a quintic polynomial with
continuous position, velocity and acceleration; a check confirms that the link stays in the
sphere.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from arm_model import Array, checked, frozen, Pose, RobotModel
from arm_trajectory import Path

from .cartesian import arc_around, arc_through, Curve, Line
from .constraints import ConstraintCheck
from .exceptions import coded, PlanningCode, PlanningError
from .ik import check_pose, IkSolver
from .link_kinematics import LinkKinematics
from .pilz_motions import CartesianLimits, curve_path, MIN_SCALING, ptp_path
from .requests import (
    check_scaling,
    CircPoint,
    CircPointKind,
    Goal,
    JointGoal,
    MotionPlan,
    MotionRequest,
    PoseGoal,
)
from .retime import FullSpeedPath, speed_limited, timed
from .validity import ValidityCheck

PTP, LIN, CIRC = 'PTP', 'LIN', 'CIRC'

PLANNER_IDS = (PTP, LIN, CIRC)  # names of the planners, as Pilz' planner has them

GOAL_TOLERANCE = 1e-3
"""Greatest difference between the end of a line and a joint goal in [rad], as in Pilz' planner."""

POSE = 6  # joints that a pose needs: with more of them it does not say where each is


class PilzPlanner:
    """Plans PTP, LIN and CIRC of one arm. Not thread-safe."""

    def __init__(
        self,
        model: RobotModel,
        limits: CartesianLimits | None,
        solver: Callable[[str], IkSolver],
    ) -> None:
        self._model, self._solver = model, solver
        self._limits = CartesianLimits() if limits is None else limits

    def plan(self, request: MotionRequest, check: ValidityCheck) -> MotionPlan:
        """Plan a motion to the first reachable goal of a request."""
        start = check.start(request.start)
        problems: list[PlanningError] = []
        for goal in request.goals:
            try:
                full, link = self._full(request, start, goal, check)
                return self._finished(full, (request,), link, check)
            except PlanningError as error:  # noqa: PERF203  # another goal may be reached
                problems.append(error)
        if len(problems) == 1:
            raise problems[0]
        reasons = '; '.join(f'goal {n}: {error}' for n, error in enumerate(problems))
        raise PlanningError(problems[0].code, reasons) from problems[0]

    def plan_sequence(
        self, items: Sequence[SequenceItem], check: ValidityCheck, first: int = 0
    ) -> MotionPlan:
        """Plan one motion through a sequence, with stops where a blend radius is 0.

        In a blended group the lowest scaling factors apply to all motions, and the path
        constraints of each motion apply to all of them. Each item has one goal; ``first`` is the
        number of the first item, for messages.
        """
        check_radii([item.blend_radius for item in items])
        start: Array | None = None
        plans: list[MotionPlan] = []
        group: list[tuple[MotionRequest, FullSpeedPath, LinkKinematics, float]] = []
        for number, item in enumerate(items, first):
            request = item.at(start)
            if start is None:
                start = check.start(request.start)
            with coded(place=f'sequence: item {number}'):
                if len(request.goals) != 1:
                    raise PlanningError(
                        PlanningCode.INVALID_GOAL_CONSTRAINTS,
                        f'has {len(request.goals)} goals; give one',
                    )
                full, link = self._full(request, start, request.goals[0], check)
            group.append((request, full, link, item.blend_radius))
            start = full.path.end.position
            if item.blend_radius == 0.0:
                plans.append(self._group(group, number + 1 - len(group), check))
                group = []
        path = Path.joined([plan.path for plan in plans])
        notes = tuple(note for plan in plans for note in plan.notes)
        return MotionPlan(path, request.planner_id, notes)

    def _group(
        self,
        group: Sequence[tuple[MotionRequest, FullSpeedPath, LinkKinematics, float]],
        first: int,
        check: ValidityCheck,
    ) -> MotionPlan:
        """Plan the motion of items without a stop between them."""
        requests, parts, links, radii = zip(*group, strict=True)
        link = links[0]
        if any(each.link != link.link for each in links):
            raise PlanningError(
                PlanningCode.INVALID_MOTION_PLAN,
                f'sequence: items {first} to {first + len(group) - 1} move several links'
                f' ({", ".join(each.link for each in links)}); blend motions of one link',
            )
        if len(parts) == 1:
            return self._finished(parts[0], requests, link, check)
        corners = [link.pose(part.path.end.position).position for part in parts]
        check_overlap(radii, corners, first)
        return self._finished(joined(parts, radii, link, first), requests, link, check)

    def _full(
        self, request: MotionRequest, start: Array, goal: Goal, check: ValidityCheck
    ) -> tuple[FullSpeedPath, LinkKinematics]:
        """Return the full-speed path to a goal, and the link that it moves."""
        name = request.planner_id
        if name not in PLANNER_IDS:
            raise PlanningError(
                PlanningCode.PLANNING_FAILED,
                f'no planner {name!r}; choose one of {", ".join(PLANNER_IDS)}',
            )
        check_scaling(request, MIN_SCALING)
        factors = request.velocity_scaling, request.acceleration_scaling
        joints = self._model.limits.scaled(*factors)
        if isinstance(goal, JointGoal):
            goal = JointGoal(self._checked(goal.positions, start, check), goal.tolerance)
        else:
            check_pose(goal.pose)
        solver = self._solver(goal.link if isinstance(goal, PoseGoal) else '')
        link = solver.link
        if name == PTP:
            if isinstance(goal, JointGoal):
                end = goal.positions
            else:
                end = solver.solve(goal.pose, start, check.scene)[0]
            return ptp_path(start, end, joints), link
        begin = link.pose(start)
        pose = link.pose(goal.positions) if isinstance(goal, JointGoal) else goal.pose
        curve = Line(begin, pose) if name == LIN else _arc(begin, request.via, pose)
        try:
            full = curve_path(link, curve, start, joints, self._limits, factors=factors, name=name)
        except PlanningError:
            if isinstance(goal, PoseGoal):  # on the way out of reach an arm looks singular
                solver.solve(goal.pose, start)
            raise
        if isinstance(goal, JointGoal):
            full = self._ends_at(full, goal, name)
        return full, link

    def _checked(self, positions: Array, start: Array, check: ValidityCheck) -> Array:
        """Return the positions of a goal, with each joint in the turn nearest to the start."""
        with coded(PlanningCode.INVALID_GOAL_CONSTRAINTS):
            found = checked(positions, len(self._model), 'goal')
        if (beyond := check.beyond(found)) is not None:
            raise PlanningError(PlanningCode.INVALID_GOAL_CONSTRAINTS, f'goal: {beyond.reason}')
        return frozen(self._model.limits.in_nearest_turn(found, start))

    def _ends_at(self, full: FullSpeedPath, goal: JointGoal, name: str) -> FullSpeedPath:
        """Compare the end of a line with its joint goal: a line is planned to the pose only."""
        names = self._model.limits.names
        off = np.abs(self._model.limits.error(full.path.end.position, goal.positions))
        worst = int(off.argmax())
        if off[worst] < GOAL_TOLERANCE:
            return full
        words = (
            f'{name}: ends at the pose of the goal with {names[worst]} at'
            f' {full.path.end.position[worst]:.3f} instead of {goal.positions[worst]:.3f}'
        )
        if len(names) <= POSE:
            raise PlanningError(
                PlanningCode.GOAL_CONSTRAINTS_VIOLATED,
                f'{words}: the goal is another configuration; use PTP',
            )
        return replace(full, notes=(*full.notes, words))

    def _finished(
        self,
        full: FullSpeedPath,
        requests: Sequence[MotionRequest],
        link: LinkKinematics,
        check: ValidityCheck,
    ) -> MotionPlan:
        """Time the motion, check it and return it."""
        limits = self._model.limits.scaled(
            min(each.velocity_scaling for each in requests),
            min(each.acceleration_scaling for each in requests),
        )
        path, notes = timed(full, limits)
        for each in requests:
            speed, moved = each.max_cartesian_speed, each.cartesian_speed_link
            path, slowed = speed_limited(path, speed, moved, self._solver)
            notes = (*notes, *slowed)
        name = requests[-1].planner_id
        if (violation := check.path(path)) is not None:
            x, y, z = link.pose(violation.positions).position
            raise PlanningError(
                PlanningCode.INVALID_MOTION_PLAN,
                f'{name}: {violation.reason}, {violation.time / path.duration:.0%} of the time'
                f' into it, with {link.link} at ({x:.3f}, {y:.3f}, {z:.3f})',
            )
        self._check_constraints(path, requests)
        return MotionPlan(path, name, notes)

    def _check_constraints(self, path: Path, requests: Sequence[MotionRequest]) -> None:
        remedy = 'plan it as a free motion, or widen the constraint'
        if len(requests) > 1:
            remedy = (
                'it holds in all motions that are blended: widen it, or give a blend radius of 0'
            )
        for request in requests:
            if request.constraints is None:
                continue
            check = ConstraintCheck(self._model, request.constraints)
            broken = check.path(path, at_looks=True)
            if broken is not None:
                raise PlanningError(
                    PlanningCode.INVALID_MOTION_PLAN,
                    f'{request.planner_id} breaks a path constraint {broken.time:.2f} s on its'
                    f' way: {broken.reason}; {remedy}',
                )


def _arc(begin: Pose, via: CircPoint | None, end: Pose) -> Curve:
    if via is None:
        raise PlanningError(
            PlanningCode.INVALID_MOTION_PLAN,
            'CIRC: no interim or center point; give one as path constraint',
        )
    with coded(PlanningCode.INVALID_GOAL_CONSTRAINTS):
        point = checked(via.position, 3, 'CIRC: point of the circle')
    if via.kind is CircPointKind.INTERIM:
        return arc_through(begin, point, end)
    return arc_around(begin, point, end)


SAMPLES = 65  # places at which a motion, or a blend, is looked at

MAX_BISECTIONS = 40  # steps to the place at which a motion crosses a sphere

SHRINK = 0.8  # factor of the sphere when a blend has left it

MAX_SHRINKS = 10  # how often it is tried smaller

BLEND_MARGIN = 0.95
"""Share of acceleration and jerk for the profile of a blended group; curved motion adds some."""


@dataclass(frozen=True, slots=True, eq=False)
class SequenceItem:
    """A motion of a sequence."""

    # the motion, whose start counts for the first one alone; or what makes it of the joint
    # positions in [rad] (n) at which it begins, for the first one of None
    request: MotionRequest | Callable[[Array | None], MotionRequest]
    # radius about its goal in which the next motion may begin, in [m]; 0 stops
    blend_radius: float = 0.0

    def at(self, start: Array | None) -> MotionRequest:
        """Return the request that begins at ``start`` in [rad] (n); the first item gets None."""
        if isinstance(self.request, MotionRequest):
            return self.request
        return self.request(start)


def check_radii(radii: Sequence[float]) -> None:
    """Refuse invalid blend radii of a sequence, by the rules of Pilz' planner."""
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
    """Refuse neighbouring blends whose spheres overlap."""
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
    """Join two or more motions into one full-speed path without stops."""
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
    """Transition from one motion to the next."""

    leave: float  # when the first is left, in its time in [s]
    join: float  # when the second is joined, in its time in [s]
    path: Path  # what leads from one to the other

    @classmethod
    def between(
        cls, before: Path, after: Path, radius: float, link: LinkKinematics, number: int
    ) -> _Blend:
        """Return the blend in a sphere about the end of the first motion."""
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
        """Return the greatest distance of the link from the corner on the blend in [m]."""
        rows = self.path.positions(np.linspace(0.0, self.path.duration, SAMPLES))
        return max(float(np.linalg.norm(link.pose(row).position - corner)) for row in rows)


def _last_crossing(
    path: Path, corner: Array, radius: float, link: LinkKinematics, *, backward: bool
) -> float | None:
    """Return the time of the crossing of a sphere nearest a path's end, or begin; None if none."""

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
