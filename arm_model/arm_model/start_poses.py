# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Finds a start pose if the SRDF names none: not singular, free of contact, within limits.

The quality of a pose is the product of three numbers from 0 to 1, so that none can compensate
for another:

- dexterity: ratio of the least to the greatest singular value of the tip's Jacobian, with lengths
  divided by the reach; 0 in a singularity;
- room: of the joint that is nearest to the end of its range, 1 in the middle, 0 at the end;
- clearance: the least distance between links divided by :data:`GOOD_CLEARANCE`, at most 1.

A pose with the tip or a joint below the mounting plane of the base (its xy plane), where the
table is, has its quality multiplied by :data:`BELOW`.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .arrays import Array, frozen
from .exceptions import ModelError
from .model import RobotModel

PREFERRED = 'ready'  # pose of the SRDF that is taken without a question
SAMPLES = 1500  # poses that are tried
SEED = 0  # of the poses: the same robot has the same pose each time
GOOD_CLEARANCE = 0.05  # distance of links that is enough in [m]

MIN_QUALITY = 0.02
"""Least quality of an SRDF pose that is used without a search."""

BELOW = 0.01  # share of its quality that a pose below the mounting plane has
DECIMALS = 2  # decimals of the numbers that are found: they are copied into an SRDF


def start_pose(model: RobotModel) -> Array:
    """Return a start pose: ``ready``, another good pose of the SRDF, or a pose found by search.

    Raises:
        ModelError: No pose was found that is free and not singular.
    """
    if PREFERRED in model.poses:
        return model.poses[PREFERRED]
    named = list(model.poses.values())
    qualities = [pose_quality(model, pose) for pose in named]
    if named and max(qualities) >= MIN_QUALITY:
        return named[int(np.argmax(qualities))]
    best, quality = None, 0.0
    for pose in _samples(model):
        found = pose_quality(model, pose, quality)
        best, quality = (pose, found) if found > quality else (best, quality)
    if best is None:
        raise ModelError(
            f'group {model.group}: none of {SAMPLES} poses is free and not singular; give the SRDF'
            f' a group_state {PREFERRED!r}, and check collision shapes and limits'
        )
    return frozen(best)


def pose_quality(model: RobotModel, positions: Array, least: float = 0.0) -> float:
    """Return the quality of a start pose: 0 if it is singular, in contact or at a limit.

    Distances are not measured if the quality cannot exceed the least of interest.
    """
    quality = _room(model, positions) * _dexterity(model, positions)
    quality *= BELOW if model.lowest(positions) < 0.0 else 1.0
    if quality <= least:
        return 0.0
    clearance = max(model.clearance(positions, GOOD_CLEARANCE), 0.0)
    return quality * min(clearance / GOOD_CLEARANCE, 1.0)


def _dexterity(model: RobotModel, positions: Array) -> float:
    jacobian = model.jacobian(positions)
    jacobian = jacobian[:, jacobian.any(axis=0)]
    if not jacobian.size:
        return 0.0
    jacobian[:3] /= model.reach or 1.0
    values = np.linalg.svd(jacobian, compute_uv=False)
    return float(values[-1] / values[0])


def _room(model: RobotModel, positions: Array) -> float:
    lower, upper = model.limits.lower, model.limits.upper
    half = 0.5 * (upper - lower)
    room = np.minimum(positions - lower, upper - positions)
    shares = np.where(model.limits.continuous, 1.0, room / np.where(np.isfinite(half), half, 1.0))
    return float(max(shares.min(), 0.0))


def _samples(model: RobotModel) -> Iterator[Array]:
    """Yield poses within the ranges, with no joint more than half a turn from zero."""
    draw = np.random.default_rng(SEED)
    revolute = np.maximum(model.limits.lower, -np.pi), np.minimum(model.limits.upper, np.pi)
    empty = revolute[0] >= revolute[1]  # a range beyond half a turn
    lower = np.where(empty, model.limits.lower, revolute[0])
    upper = np.where(empty, model.limits.upper, revolute[1])
    yield np.round(0.5 * (lower + upper), DECIMALS)
    for _ in range(SAMPLES - 1):
        yield np.round(draw.uniform(lower, upper), DECIMALS)
