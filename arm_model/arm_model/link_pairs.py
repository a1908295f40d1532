# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""All pairs of links of a robot, by how they can touch: what an SRDF is made of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np
from urdf_reader import Pair, read_urdf

from .arrays import Array
from .exceptions import description_refused
from .kinematics import Kinematics
from .scene.allowed_collisions import AllowedCollisionMatrix
from .scene.clearances import Clearances
from .scene.default_collisions import adjacent_links, drawn_poses, MIN_SHARE, one_turn, SEED
from .scene.link_shapes import link_shapes
from .scene.planning_scene import PlanningScene

DESCENTS = 6  # nearest poses of a pair from which nearer ones are searched
DESCENT_STEPS = 200  # poses that are tried from each of them

FIRST_STEP, LAST_STEP = 0.2, 0.002
"""Standard deviation of the steps of a search, as a share of the range of each joint."""


@dataclass(frozen=True, slots=True)
class LinkPairs:
    """Pairs of links that have collision shapes."""

    adjacent: frozenset[Pair]  # pairs that a joint connects
    fixed: frozenset[Pair]  # other pairs that no joint moves against each other
    # share of the drawn poses in which the links touch, by every other pair
    shares: Mapping[Pair, float]
    # least distance in [m] that was found, by the same pairs; negative for an overlap
    least: Mapping[Pair, float]
    samples: int  # number of poses that were drawn, evenly over the ranges of all joints
    searched: int  # poses that were tried besides for each pair that never touched
    notes: tuple[str, ...]  # what was passed over in the description, in words

    @property
    def always(self) -> frozenset[Pair]:
        """Pairs that touch in nearly all poses."""
        return frozenset(pair for pair, share in self.shares.items() if share >= MIN_SHARE)

    def never(self, margin: float) -> frozenset[Pair]:
        """Return the pairs that came nowhere as near as a margin in [m]."""
        return frozenset(pair for pair, distance in self.least.items() if distance >= margin)


@description_refused()
def sample_link_pairs(urdf: str, samples: int, folder: Path | None = None) -> LinkPairs:
    """Find out which links of a robot touch always, at times and never.

    Raises:
        ModelError: The description makes no robot.
    """
    tree = read_urdf(urdf)
    kinematics = Kinematics(tree, [each.name for each in tree.joints if each.independent])
    shapes = link_shapes(tree, folder)
    scene = PlanningScene(kinematics, shapes.by_link, AllowedCollisionMatrix())
    ranges = tree.ranges()
    lower = np.array([ranges[name].lower for name in kinematics.joints])
    upper = np.array([ranges[name].upper for name in kinematics.joints])
    lower, upper = one_turn(lower, upper)
    poses = np.array(list(drawn_poses(lower, upper, samples)))
    clearances = Clearances(scene)
    found = np.array([clearances.least(pose, np.inf).copy() for pose in poses])
    columns: dict[Pair, list[int]] = {}
    for column, pair in enumerate(scene.pairs):
        columns.setdefault(frozenset(pair), []).append(column)
    adjacent = adjacent_links(tree, scene)
    distances = {
        pair: found[:, each].min(axis=1) for pair, each in columns.items() if pair not in adjacent
    }
    shares = {pair: float((each < 0.0).mean()) for pair, each in distances.items()}
    least = {pair: float(each.min()) for pair, each in distances.items()}
    for apart in [pair for pair, share in shares.items() if share == 0.0]:
        starts = poses[np.argsort(distances[apart])[:DESCENTS]]
        least[apart] = min(least[apart], _least_nearby(scene, lower, upper, apart, starts))
    every = {frozenset(pair) for pair in combinations(scene.link_shapes, 2)}
    fixed = frozenset(every - adjacent - least.keys())
    searched = DESCENTS * DESCENT_STEPS
    return LinkPairs(adjacent, fixed, shares, least, samples, searched, tuple(shapes.notes))


def _least_nearby(
    scene: PlanningScene, lower: Array, upper: Array, pair: Pair, starts: Array
) -> float:
    """Return the least distance of a pair that random steps towards contact find in [m]."""
    others = [each for each in map(frozenset, scene.pairs) if each != pair]
    clearances = Clearances(scene.with_allowed(scene.allowed.with_entries(others, True)))
    draw = np.random.default_rng(SEED)
    shrinking = np.geomspace(FIRST_STEP, LAST_STEP, DESCENT_STEPS)
    found = np.inf
    for start in starts:
        best, nearest = start, float(clearances.least(start, np.inf).min())
        for step in shrinking:
            tried = np.clip(best + draw.normal(0.0, step * (upper - lower)), lower, upper)
            distance = float(clearances.least(tried, nearest).min())
            if distance < nearest:
                best, nearest = tried, distance
        found = min(found, nearest)
        if found < 0.0:
            break
    return found
