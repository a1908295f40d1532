# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
r"""Inverse kinematics: all solutions in closed form, or numeric solutions from several starts.

A numeric step solves :math:`\Delta q = J^T (J J^T + \lambda I)^{-1} e` with the pose error
:math:`e` and a damping :math:`\lambda` that vanishes with it (Sugihara, "Solvability-unconcerned
inverse kinematics by the Levenberg-Marquardt method", 2011). A joint that a step would take beyond
its range stays at the end of it, and the others make up for it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
import math
import time

import numpy as np

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

from .exceptions import coded, PlanningCode, PlanningError
from .link_kinematics import ClosedForm, LinkKinematics, pose_error, WristMiss

DEFAULT_TIMEOUT = 0.1
"""Time for numeric inverse kinematics in [s]; several starts of a seven-joint arm."""

MAX_STARTS = 200  # starts of numeric inverse kinematics at most, however much time there is

SAME_TOLERANCE = 1e-3  # solutions of which no joint differs by more count as one in [rad]

RANGE_TOLERANCE = 1e-9
"""Rounding tolerance of position limits in [rad]; such solutions are clamped to the limit."""

POLISH_TOLERANCE = 1e-10
"""Pose error of a closed form in [m] and [rad] beyond which Newton steps follow.

Descriptions whose axes are not quite parallel need them, and solutions that are almost singular.
"""

ORTHOGONAL_TOLERANCE = 1e-6  # how far a rotation matrix may be from one

AT_PLACE = 1e-3
"""Position error in [m] up to which a pose counts as reachable but for its orientation."""

TURN = 2.0 * math.pi  # a whole turn in [rad]


class IkSolver:
    """Inverse kinematics of one link. Not thread-safe."""

    def __init__(
        self,
        model: RobotModel,
        link: str = '',
        clock: Callable[[], float] = time.monotonic,
        draw: np.random.Generator | None = None,
    ) -> None:
        self.link = LinkKinematics(model, link)
        self.closed_form = ClosedForm.of(self.link)
        self._limits: JointLimits = model.limits
        self._clock = clock
        self._draw = np.random.default_rng(0) if draw is None else draw
        self._clearances: Clearances | None = None
        self._turns = _turning(self.link)

    def solve(
        self,
        pose: Pose,
        seed: Sequence[float] | Array,
        scene: PlanningScene | None = None,
        timeout: float = DEFAULT_TIMEOUT,
        count: int = 1,
    ) -> list[Array]:
        """Return joint positions for a pose in the root link, the nearest to the seed first.

        An arm with a spherical wrist gets all solutions, each in the turn nearest to the seed.
        Other arms get the solutions that random starts find before the time-out.

        Args:
            scene: Solutions must be free of contact in this scene; None skips the check.
            timeout: Time in [s] after which no further start is made.
            count: Number of solutions after which a numeric search ends.

        Raises:
            PlanningError: There is no solution: the pose is out of reach, joints would be beyond
                their limits, or the arm would be in contact; or a number is not finite.
        """
        with coded(PlanningCode.INVALID_GOAL_CONSTRAINTS):
            seed = checked(seed, len(self._limits), 'seed')
        check_pose(pose)
        clearances = None if scene is None else self._clearances_of(scene)
        if self.closed_form is None:
            return self._searched(pose, seed, clearances, timeout, count)
        found = self._exact(self.closed_form, pose, seed)
        if clearances is None:
            return found
        free = [each for each in found if not _touches(clearances, each)]
        if not free:
            raise self._refused(_in_contact(clearances, found[0]))
        return free

    def _exact(self, form: ClosedForm, pose: Pose, seed: Array) -> list[Array]:
        answers = form.solutions(pose, seed)
        if isinstance(answers, WristMiss):
            raise self._refused(
                f'the wrist would be {answers.distance:.3f} m too near to the shoulder'
                if answers.too_near
                else f'{self.link.link} is out of reach by {answers.distance:.3f} m'
            )
        limits = self._limits
        turned = self._in_nearest_turn(np.array(answers), seed)
        beyond = np.maximum(limits.lower - turned, turned - limits.upper)
        within = (beyond <= RANGE_TOLERANCE).all(axis=1)
        if not within.any():
            nearest = int(beyond.max(axis=1).argmin())
            raise self._refused(self._at_limits(turned[nearest]))
        solutions = np.clip(turned[within], limits.lower, limits.upper)
        return _nearest_first([self._polished(pose, each) for each in solutions], seed)

    def _polished(self, pose: Pose, positions: Array) -> Array:
        """Refine a solution until it meets the pose exactly."""
        error = np.abs(pose_error(pose, self.link.pose(positions))).max()
        if error < POLISH_TOLERANCE:
            return positions
        refined = descend(self.link, pose, positions, self._limits.lower, self._limits.upper)
        return refined.positions if np.abs(refined.error).max() < error else positions

    def _searched(
        self, pose: Pose, seed: Array, clearances: Clearances | None, timeout: float, count: int
    ) -> list[Array]:
        """Return the numeric solutions found from the seed and from random starts."""
        limits = self._limits
        deadline = self._clock() + timeout
        best = end = descend(self.link, pose, seed, limits.lower, limits.upper)
        starts = 1
        free: list[Array] = []
        touching: list[Array] = []
        while True:
            if end.converged:
                solution = self._in_nearest_turn(end.positions, seed)
                touches = clearances is not None and _touches(clearances, solution)
                among = touching if touches else free
                if all(np.abs(solution - each).max() >= SAME_TOLERANCE for each in among):
                    among.append(solution)
            if len(free) >= count or starts >= MAX_STARTS or self._clock() >= deadline:
                break
            end = self._descent(pose, seed)
            best = min(best, end, key=lambda each: float(each.error @ each.error))
            starts += 1
        if free:
            return _nearest_first(free, seed)
        if clearances is not None and touching:
            nearest = _nearest_first(touching, seed)[0]
            raise self._refused(_in_contact(clearances, nearest))
        raise self._refused(self._why_none(pose, best, starts))

    def another(self, pose: Pose, seed: Array) -> Array | None:
        """Try one more random start near a seed; return its solution, or None."""
        end = self._descent(pose, seed)
        return frozen(self._in_nearest_turn(end.positions, seed)) if end.converged else None

    def _descent(self, pose: Pose, seed: Array) -> Descent:
        start = self._draw.uniform(*self._limits.span(seed))
        return descend(self.link, pose, start, self._limits.lower, self._limits.upper)

    def _in_nearest_turn(self, positions: Array, seed: Array) -> Array:
        """Return the positions with each joint in the turn within limits nearest to a seed."""
        limits, turn = self._limits, TURN * self._turns
        turned = positions + turn * np.round((seed - positions) / TURN)
        turned -= turn * (turned > limits.upper + RANGE_TOLERANCE)
        turned += turn * (turned < limits.lower - RANGE_TOLERANCE)
        return turned

    def _clearances_of(self, scene: PlanningScene) -> Clearances:
        if self._clearances is None or self._clearances.scene is not scene:
            self._clearances = Clearances(scene)
        return self._clearances

    def _at_limits(self, positions: Array) -> str:
        words = self._limits.beyond(positions, -math.inf)
        return f'every solution is beyond the limits; of the nearest {words}'

    def _why_none(self, pose: Pose, best: Descent, starts: int) -> str:
        """Return why no start reached the pose; this retries without limits."""
        none = np.full(len(self._limits), np.inf)
        unlimited = descend(self.link, pose, best.positions, -none, none)
        if unlimited.converged:
            turns = TURN * np.round((unlimited.positions - best.positions) / TURN)
            return f'{self._at_limits(unlimited.positions - turns)} ({starts} starts)'
        way = min(float(np.linalg.norm(each.error[:3])) for each in (best, unlimited))
        turn = float(np.linalg.norm(best.error[3:]))
        reason = (
            f'the pose is out of reach by {way:.3f} m; move it towards the base'
            if way > AT_PLACE
            else 'no joints turn it so; turn the pose, or move it away from a singular place'
        )
        return (
            f'it comes as near as {1e3 * way:.1f} mm and {turn:.3f} rad in'
            f' {starts} starts: {reason}'
        )

    def _refused(self, reason: str) -> PlanningError:
        return PlanningError(
            PlanningCode.NO_IK_SOLUTION, f'no joint positions for link {self.link.link}: {reason}'
        )


def check_pose(pose: Pose) -> None:
    """Refuse an invalid pose."""
    with coded(PlanningCode.INVALID_GOAL_CONSTRAINTS):
        checked(pose.position, 3, 'position of the pose')
        checked(np.ravel(pose.rotation), 9, 'rotation of the pose')
    rotation = np.asarray(pose.rotation)
    off = np.abs(rotation @ rotation.T - np.eye(3)).max()
    if off > ORTHOGONAL_TOLERANCE or np.linalg.det(rotation) < 0.0:
        raise PlanningError(
            PlanningCode.INVALID_GOAL_CONSTRAINTS,
            f'rotation of the pose: its axes are off by {off:.2g}; give an orthogonal matrix that'
            ' does not mirror',
        )


def _turning(link: LinkKinematics) -> Mask:
    """Return a mask of the joints that a whole turn brings back to the same link pose.

    Excluded are prismatic joints, and joints with mimic joints, which may not make whole turns.
    """
    kinematics = link.kinematics
    columns = kinematics.projected(link.axes(np.zeros(len(kinematics.joints))))
    followed = {each.source for each in kinematics.mimics.values()}
    turning: Mask = np.abs(columns[3:]).max(axis=0) > 0.0
    turning &= np.array([name not in followed for name in kinematics.joints])
    return turning


def _touches(clearances: Clearances, positions: Array) -> bool:
    return bool((clearances.least(positions, 0.0) < 0.0).any())


def _in_contact(clearances: Clearances, positions: Array) -> str:
    contact = clearances.contacts(positions)[0]
    first, second = contact.bodies
    return (
        f'every solution is in contact; in the one next to the seed {first} and {second}'
        f' overlap by {1e3 * contact.depth:.1f} mm'
    )


def _nearest_first(solutions: Sequence[Array], seed: Array) -> list[Array]:
    ordered = sorted(solutions, key=lambda each: float(np.linalg.norm(each - seed)))
    return [frozen(each) for each in ordered]


CONVERGED = 1e-10  # greatest part of the pose error that counts as none in [m] and [rad]

MAX_ITERATIONS = 60  # steps from one start at most

MAX_STEP = 0.5  # greatest motion of a joint in a step in [rad] or [m]

DAMPING = 1e-2  # damping over the square of the pose error

MIN_DAMPING = 1e-13  # least damping, so that a singular arm has a step as well

MIN_PROGRESS = 0.999
"""A start is given up if more than this share of the error is left after :data:`STALL` steps."""

STALL = 8  # steps without progress after which a start is given up


@dataclass(frozen=True, slots=True, eq=False)
class Descent:
    """Result of a descent."""

    positions: Array  # joint positions in [rad] (n)
    error: Array  # way in [m] and rotation vector in [rad] that are left (6)

    @property
    def converged(self) -> bool:
        """Whether the pose is met."""
        return bool(np.abs(self.error).max() < CONVERGED)


def descend(link: LinkKinematics, pose: Pose, start: Array, lower: Array, upper: Array) -> Descent:
    """Approach a pose in the root link from a start."""
    positions = np.clip(start, lower, upper)
    best, stalled = np.inf, 0
    for _ in range(MAX_ITERATIONS):
        actual, jacobian = link.pose_and_jacobian(positions)
        error = pose_error(pose, actual)
        size = float(error @ error)
        if np.abs(error).max() < CONVERGED:
            return Descent(positions, error)
        stalled = 0 if size < MIN_PROGRESS * best else stalled + 1
        if stalled > STALL:
            break
        best = min(best, size)
        step = _step(jacobian, error, positions, lower, upper)
        largest = float(np.abs(step).max())
        if largest > MAX_STEP:
            step *= MAX_STEP / largest
        positions = np.clip(positions + step, lower, upper)
    return Descent(positions, pose_error(pose, link.pose(positions)))


def _step(jacobian: Array, error: Array, positions: Array, lower: Array, upper: Array) -> Array:
    """Return a damped step, in which joints at the end of their range stay there."""
    damping = DAMPING * float(error @ error) + MIN_DAMPING
    free = np.ones(len(positions), dtype=bool)
    step = np.zeros(len(positions))
    for _ in range(len(positions)):
        part = jacobian[:, free]
        step[:] = 0.0
        step[free] = part.T @ np.linalg.solve(part @ part.T + damping * np.eye(6), error)
        held = ((positions <= lower) & (step < 0.0)) | ((positions >= upper) & (step > 0.0))
        if not held.any():
            break
        free &= ~held
    return step
