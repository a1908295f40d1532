# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
r"""Inverse kinematics of any arm: damped Newton steps within the ranges of the joints.

A step solves :math:`\Delta q = J^T (J J^T + \lambda I)^{-1} e` with the pose error :math:`e` and a
damping :math:`\lambda` that vanishes with it (Sugihara, "Solvability-unconcerned inverse
kinematics by the Levenberg-Marquardt method", 2011). A joint that a step would take
beyond its range stays at the end of it, and the others make up for it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from arm_model import Array, JointLimits, Pose

from .link_kinematics import LinkKinematics, pose_error

CONVERGED = 1e-10  # greatest part of the pose error that counts as none in [m] and [rad]
MAX_ITERATIONS = 60  # steps from one start at most
MAX_STEP = 0.5  # greatest motion of a joint in a step in [rad] or [m]
DAMPING = 1e-2  # damping over the square of the pose error
MIN_DAMPING = 1e-13  # least damping, so that a singular arm has a step as well

MIN_PROGRESS = 0.999
"""A start is given up when so many parts of the error are left after :data:`STALL` steps."""

STALL = 8  # steps without progress after which a start is given up


@dataclass(frozen=True, slots=True, eq=False)
class Descent:
    """Where steps led."""

    positions: Array  # joint positions in [rad] (n)
    error: Array  # way in [m] and rotation vector in [rad] that are left (6)

    @property
    def converged(self) -> bool:
        """Whether the pose is met."""
        return bool(np.abs(self.error).max() < CONVERGED)


def descend(link: LinkKinematics, pose: Pose, start: Array, lower: Array, upper: Array) -> Descent:
    """Approach a pose from a start.

    Args:
        pose: Where it is wanted, in the root link.
    """
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


def random_start(limits: JointLimits, seed: Array, draw: np.random.Generator) -> Array:
    """Return a start anywhere in the ranges; a joint without end is half a turn off at most.

    Args:
        seed: Where joints without end are turned from in [rad].
    """
    lower = np.where(np.isfinite(limits.lower), limits.lower, seed - np.pi)
    upper = np.where(np.isfinite(limits.upper), limits.upper, seed + np.pi)
    start: Array = draw.uniform(lower, upper)
    return start
