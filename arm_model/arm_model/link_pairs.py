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

from .exceptions import description_refused
from .kinematics import Kinematics
from .scene.allowed_collisions import AllowedCollisionMatrix
from .scene.default_collisions import adjacent_links, MIN_SHARE, sampled_contacts
from .scene.link_shapes import link_shapes
from .scene.planning_scene import PlanningScene


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

    Args:
        samples: Number of poses to be drawn.

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
    found = sampled_contacts(scene, lower, upper, samples)
    adjacent = adjacent_links(tree, scene)
    every = {frozenset(pair) for pair in combinations(scene.link_shapes, 2)}
    moving = found.least.keys() - adjacent
    return LinkPairs(
        adjacent,
        frozenset(every - adjacent - moving),
        {pair: found.shares[pair] for pair in moving},
        {pair: found.least[pair] for pair in moving},
        samples,
        found.searched,
        tuple(shapes.notes),
    )
