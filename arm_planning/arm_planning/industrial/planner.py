# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Plans PTP, LIN, CIRC and sequences of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
import time

import numpy as np

from arm_model import Array, checked, frozen, JointLimits, Pose, RobotModel
from arm_trajectory import farthest_beyond, Path

from ..constraints import ConstraintCheck
from ..curves import arc_around, arc_through, Curve, Line
from ..exceptions import PlanningCode, PlanningError
from ..ik.link_kinematics import LinkKinematics
from ..ik.solver import check_pose, IkSolver
from ..link_speed import speed_limited
from ..requests import (
    CircPoint,
    CircPointKind,
    Goal,
    JointGoal,
    MotionPlan,
    MotionRequest,
    PoseGoal,
)
from ..validity import ValidityCheck
from .following import curve_path
from .limits import CartesianLimits, check_scaling
from .ptp import ptp_path
from .sequence import check_overlap, check_radii, joined, SequenceItem
from .timing import FullSpeedPath, timed

PTP, LIN, CIRC = 'PTP', 'LIN', 'CIRC'

PLANNER_IDS = (PTP, LIN, CIRC)  # names of the planners, as Pilz' planner has them
RANGE_TOLERANCE = 1e-6  # how far a start or a goal may be beyond a limit for rounding in [rad]

GOAL_TOLERANCE = 1e-3
"""How far from the goal's joint positions a line may end in [rad], as in Pilz' planner."""

POSE = 6  # joints that a pose needs: with more of them it does not say where each is


class IndustrialPlanner:
    """Plans industrial motions of one arm; for one thread."""

    def __init__(
        self,
        model: RobotModel,
        limits: CartesianLimits | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Prepare.

        Args:
            limits: Limits of a link's motion; None has the defaults.
            clock: Steady time in [s], for time-outs of inverse kinematics.
        """
        self._model, self._clock = model, clock
        self._limits = CartesianLimits() if limits is None else limits
        self._solvers: dict[str, IkSolver] = {}

    def plan(self, request: MotionRequest, check: ValidityCheck | None = None) -> MotionPlan:
        """Return the motion of a request.

        Args:
            check: Finds contact in a scene; None does not look.

        Raises:
            PlanningError: There is none; the message says why and where.
        """
        start = self._start(request, check)
        problems: list[PlanningError] = []
        for goal in request.goals:
            plan = self._tried(request, start, goal, check)
            if isinstance(plan, MotionPlan):
                return plan
            problems.append(plan)
        if not problems:
            raise PlanningError(
                PlanningCode.INVALID_GOAL_CONSTRAINTS, f'{request.planner_id}: no goal; give one'
            )
        if len(problems) == 1:
            raise problems[0]
        reasons = '; '.join(f'goal {n}: {error}' for n, error in enumerate(problems))
        raise PlanningError(problems[0].code, reasons) from problems[0]

    def _tried(
        self, request: MotionRequest, start: Array, goal: Goal, check: ValidityCheck | None
    ) -> MotionPlan | PlanningError:
        """Return the motion to a goal, or why there is none."""
        try:
            full, link = self._full(request, start, goal, check)
            return self._finished(full, (request,), link, check)
        except PlanningError as error:
            return error

    def plan_sequence(
        self, items: Sequence[SequenceItem], check: ValidityCheck | None = None, first: int = 0
    ) -> MotionPlan:
        """Return one motion through a sequence, with stops where a blend radius is 0.

        In a blended group the least factors of velocity and acceleration limit all joints, and
        the path constraints of each motion hold in all of them.

        Args:
            items: The motions; each has one goal, and begins where the one before ends.
            check: Finds contact in a scene; None does not look.
            first: Number of the first item, for messages.

        Raises:
            PlanningError: A motion is refused, or a blend; the message names the item.
        """
        check_radii([item.blend_radius for item in items])
        start: Array | None = None
        plans: list[MotionPlan] = []
        group: list[tuple[MotionRequest, FullSpeedPath, LinkKinematics, float]] = []
        for number, item in enumerate(items, first):
            request = item.at(start)
            if start is None:
                start = self._start(request, check)
            full, link = self._item(number, request, start, check)
            group.append((request, full, link, item.blend_radius))
            start = full.path.end.position
            if item.blend_radius == 0.0:
                plans.append(self._group(group, number + 1 - len(group), check))
                group = []
        path = plans[0].path
        for plan in plans[1:]:
            path = path.followed_by(plan.path.segments)
        notes = tuple(note for plan in plans for note in plan.notes)
        return MotionPlan(path, request.planner_id, notes)

    def _item(
        self, number: int, request: MotionRequest, start: Array, check: ValidityCheck | None
    ) -> tuple[FullSpeedPath, LinkKinematics]:
        """Return the path of an item at full speed, and the link that it moves."""
        if len(request.goals) != 1:
            raise PlanningError(
                PlanningCode.INVALID_GOAL_CONSTRAINTS,
                f'sequence: item {number} has {len(request.goals)} goals; give one',
            )
        try:
            return self._full(request, start, request.goals[0], check)
        except PlanningError as error:
            raise PlanningError(error.code, f'sequence: item {number}: {error}') from error

    def _group(
        self,
        group: Sequence[tuple[MotionRequest, FullSpeedPath, LinkKinematics, float]],
        first: int,
        check: ValidityCheck | None,
    ) -> MotionPlan:
        """Return the motion of items without a stop between them."""
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
        self, request: MotionRequest, start: Array, goal: Goal, check: ValidityCheck | None
    ) -> tuple[FullSpeedPath, LinkKinematics]:
        """Return the path at full speed to a goal, and the link that it moves.

        Raises:
            PlanningError: The goal is out of reach, or the way there cannot be followed.
        """
        factors = request.velocity_scaling, request.acceleration_scaling
        check_scaling(*factors)
        limits = self._model.limits
        joints = limits.scaled(*factors)
        if isinstance(goal, JointGoal):
            there = limits.in_nearest_turn(self._checked(goal.positions, 'goal'), start)
            goal = JointGoal(frozen(there), goal.tolerance)
        solver = self._solver(goal.link if isinstance(goal, PoseGoal) else '')
        if request.planner_id == PTP:
            end = self._joints(goal, start, solver, check)
            return ptp_path(start, end, joints), solver.link
        if request.planner_id not in PLANNER_IDS:
            raise PlanningError(
                PlanningCode.PLANNING_FAILED,
                f'no planner {request.planner_id!r}; choose one of {", ".join(PLANNER_IDS)}',
            )
        curve = self._curve(request, start, goal, solver.link)
        try:
            full = curve_path(
                solver.link,
                curve,
                start,
                joints,
                self._limits,
                factors=factors,
                name=request.planner_id,
            )
        except PlanningError:
            if isinstance(goal, PoseGoal):  # on the way out of reach an arm looks singular
                solver.solve(goal.pose, start)
            raise
        if isinstance(goal, JointGoal):
            full = self._ends_at(full, goal, request.planner_id)
        return full, solver.link

    def _curve(
        self, request: MotionRequest, start: Array, goal: Goal, link: LinkKinematics
    ) -> Curve:
        begin = link.pose(start)
        if isinstance(goal, JointGoal):
            end = link.pose(goal.positions)
        else:
            check_pose(goal.pose)
            end = goal.pose
        if request.planner_id == LIN:
            return Line(begin, end)
        return _arc(begin, request.via, end)

    def _joints(
        self, goal: Goal, start: Array, solver: IkSolver, check: ValidityCheck | None
    ) -> Array:
        if isinstance(goal, JointGoal):
            return goal.positions
        return solver.solve(goal.pose, start, None if check is None else check.scene)[0]

    def _ends_at(self, full: FullSpeedPath, goal: JointGoal, name: str) -> FullSpeedPath:
        """Compare the end of a line with the joints of its goal: only the pose leads there."""
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
        return FullSpeedPath(full.path, full.acceleration, full.jerk, notes=(*full.notes, words))

    def _finished(
        self,
        full: FullSpeedPath,
        requests: Sequence[MotionRequest],
        link: LinkKinematics,
        check: ValidityCheck | None,
    ) -> MotionPlan:
        """Return the motion with its times, checked."""
        limits = self._model.limits.scaled(
            min(each.velocity_scaling for each in requests),
            min(each.acceleration_scaling for each in requests),
        )
        path, notes = timed(full, limits)
        for request in requests:
            limited = self._solver(request.cartesian_speed_link).link
            path, slowed = speed_limited(path, limited, request.max_cartesian_speed)
            notes = (*notes, *slowed)
        self._check_range(path, limits, requests[-1].planner_id)
        if check is not None:
            _check_contact(path, check, link, requests[-1].planner_id)
        self._check_constraints(path, requests)
        return MotionPlan(path, requests[-1].planner_id, notes)

    def _check_range(self, path: Path, limits: JointLimits, name: str) -> None:
        begin = path.at(0.0).position
        beyond = farthest_beyond(
            path, np.minimum(limits.lower, begin), np.maximum(limits.upper, begin)
        )
        if beyond is not None:
            joint = beyond.joint
            raise PlanningError(
                PlanningCode.PLANNING_FAILED,
                f'{name}: {limits.names[joint]} would be at {beyond.position:.4f} at'
                f' {beyond.time:.2f} s, beyond its limits {limits.lower[joint]:.4f}..'
                f'{limits.upper[joint]:.4f}',
            )

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

    def _start(self, request: MotionRequest, check: ValidityCheck | None) -> Array:
        start = checked(request.start, len(self._model), 'start')
        self._refuse_beyond(start, 'start', PlanningCode.START_STATE_INVALID)
        if check is not None:
            check.refuse_start(start)
        return start

    def _checked(self, positions: Array, what: str) -> Array:
        found = checked(positions, len(self._model), what)
        self._refuse_beyond(found, what, PlanningCode.INVALID_GOAL_CONSTRAINTS)
        return found

    def _refuse_beyond(self, positions: Array, what: str, code: PlanningCode) -> None:
        limits = self._model.limits
        beyond = np.maximum(limits.lower - positions, positions - limits.upper)
        joint = int(beyond.argmax())
        if beyond[joint] > RANGE_TOLERANCE:
            raise PlanningError(
                code,
                f'{what}: {limits.names[joint]} at {positions[joint]:.4f} is beyond its limits'
                f' {limits.lower[joint]:.4f}..{limits.upper[joint]:.4f}',
            )

    def _solver(self, link: str) -> IkSolver:
        name = link or self._model.tip
        if name not in self._solvers:
            self._solvers[name] = IkSolver(self._model, name, self._clock)
        return self._solvers[name]


def _check_contact(path: Path, check: ValidityCheck, link: LinkKinematics, name: str) -> None:
    near = check.contact(path)
    if near is not None:
        x, y, z = link.pose(near.positions).position
        raise PlanningError(
            PlanningCode.INVALID_MOTION_PLAN,
            f'{name}: {near.reason}, {near.time / path.duration:.0%} of the time into it, with'
            f' {link.link} at ({x:.3f}, {y:.3f}, {z:.3f})',
        )


def _arc(begin: Pose, via: CircPoint | None, end: Pose) -> Curve:
    if via is None:
        raise PlanningError(
            PlanningCode.INVALID_MOTION_PLAN,
            'CIRC: no interim or center point; give one as path constraint',
        )
    point = checked(via.position, 3, 'CIRC: point of the circle')
    if via.kind is CircPointKind.INTERIM:
        return arc_through(begin, point, end)
    return arc_around(begin, point, end)
