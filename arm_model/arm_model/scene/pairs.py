# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Pairs of links: which cannot help touching, and all pairs by how they can touch.

MoveIt's setup assistant writes ``disable_collisions`` for links that are adjacent, or in contact
nearly always. :func:`with_default_collisions` makes up for that where an SRDF does not say it.
Links that the assistant finds never in contact are still checked: a sample is no proof, and
distances that are great cost nothing. For an SRDF that other programs read,
:func:`sample_link_pairs` looks for contacts much longer.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np
from urdf_reader import KinematicTree, Pair, read_urdf

from ..arrays import Array
from ..exceptions import description_refused
from ..kinematics import Kinematics
from .allowed_collisions import AllowedCollisionMatrix
from .clearances import Clearances
from .link_shapes import link_shapes
from .planning_scene import PlanningScene

SAMPLES = 200  # poses that are tried

MIN_SHARE = 0.95
"""Share of the poses in which links touch that touch always; the setup assistant's."""

SEED = 0  # of the poses: the same robot has the same pairs each time

HALF_TURN = np.pi

MAX_NAMED = 12  # pairs that one note names

DESCENTS = 6  # nearest poses of a pair from which nearer ones are searched
DESCENT_STEPS = 200  # poses that are tried from each of them

FIRST_STEP, LAST_STEP = 0.2, 0.002
"""Standard deviation of the steps of a search, as a share of the range of each joint."""


def with_default_collisions(
    scene: PlanningScene, tree: KinematicTree, lower: Array, upper: Array, notes: list[str]
) -> PlanningScene:
    """Return the scene in which links may touch that cannot help it.

    Adjacent links count only where the SRDF names no pair and no link: who made a matrix, left
    them in it with a purpose. What ``enable_collisions`` names is checked in any case.

    Args:
        notes: Where pairs are named that were not in the SRDF.
    """
    allowed = scene.allowed
    checked = set(map(frozenset, scene.pairs))
    adjacent = _sorted(adjacent_links(tree, scene) & checked)
    has_matrix = bool(allowed.entries or allowed.defaults)
    if adjacent and not has_matrix:
        scene = scene.with_allowed(allowed.with_entries(map(frozenset, adjacent), True))
        notes.append(
            'the SRDF has no disable_collisions: adjacent links are not checked for collision'
            f' with each other ({_named(adjacent)})'
        )
    touching = always_in_contact(scene, lower, upper)
    enabled = {pair for pair in touching if allowed.entries.get(pair) is False}
    if always := _sorted(touching - enabled):
        notes.append(
            f'links that touch wherever the arm is are not checked with each other:'
            f' {_named(always)}; give the SRDF a disable_collisions for each, or smaller shapes'
        )
        scene = scene.with_allowed(scene.allowed.with_entries(map(frozenset, always), True))
    if enabled:
        notes.append(
            f'links that touch wherever the arm is are checked, as enable_collisions of the SRDF'
            f' says: {_named(_sorted(enabled))}; the arm hardly moves so: give them smaller shapes'
        )
    if has_matrix and (left := [pair for pair in adjacent if frozenset(pair) not in touching]):
        notes.append(
            f'adjacent links that the SRDF has no disable_collisions for are checked with each'
            f' other: {_named(left)}; add it where they touch by design'
        )
    return scene


def adjacent_links(tree: KinematicTree, scene: PlanningScene) -> frozenset[Pair]:
    """Return pairs of links that a joint connects; links without a shape do not part them."""
    above = {joint.child: joint.parent for joint in tree.joints}

    def solid(link: str) -> str:
        while link in above and link not in scene.link_shapes:
            link = above[link]
        return link

    pairs = {frozenset((solid(parent), link)) for link, parent in above.items()}
    return frozenset(pair for pair in pairs if pair <= set(scene.link_shapes))


def always_in_contact(scene: PlanningScene, lower: Array, upper: Array) -> frozenset[Pair]:
    """Return pairs of links that touch in nearly all poses.

    Args:
        lower: Least positions of its joints; minus infinity for one that turns without end.
    """
    clearances, apart = Clearances(scene), Counter[Pair]()
    candidates = set(map(frozenset, scene.pairs))
    for positions in drawn_poses(*one_turn(lower, upper), SAMPLES):
        touching = clearances.contacts(positions)
        apart.update(candidates.difference(frozenset(each.bodies) for each in touching))
        candidates = {pair for pair in candidates if apart[pair] <= (1 - MIN_SHARE) * SAMPLES}
        if not candidates:
            break
    return frozenset(candidates)


def one_turn(lower: Array, upper: Array) -> tuple[Array, Array]:
    """Return ranges in which joints without an end turn once."""
    return (
        np.where(np.isfinite(lower), lower, -HALF_TURN),
        np.where(np.isfinite(upper), upper, HALF_TURN),
    )


def drawn_poses(lower: Array, upper: Array, samples: int) -> Iterator[Array]:
    """Draw poses, the same each time."""
    draw = np.random.default_rng(SEED)
    return (draw.uniform(lower, upper) for _ in range(samples))


def _sorted(pairs: Iterable[Pair]) -> list[list[str]]:
    return sorted(sorted(pair) for pair in pairs)


def _named(pairs: list[list[str]]) -> str:
    shown = ', '.join(f'{first} and {second}' for first, second in pairs[:MAX_NAMED])
    more = len(pairs) - MAX_NAMED
    return f'{shown} and {more} pairs more' if more > 0 else shown


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
