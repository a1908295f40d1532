# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Pairs of links that cannot help touching, as MoveIt's setup assistant finds them.

It writes ``disable_collisions`` for links that are adjacent, or in contact nearly always. Here
that is made up for where an SRDF does not say it. Links that it finds never in contact are checked
all the same: a sample is no proof, and distances that are great cost nothing. For an SRDF that
other programs read, :func:`arm_model.sample_link_pairs` looks for contacts much longer.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator

import numpy as np
from urdf_reader import KinematicTree, Pair

from ..arrays import Array
from .clearances import Clearances
from .planning_scene import PlanningScene

SAMPLES = 200  # poses that are tried

MIN_SHARE = 0.95
"""Share of the poses in which links touch that touch always; the setup assistant's."""

SEED = 0  # of the poses: the same robot has the same pairs each time

HALF_TURN = np.pi

MAX_NAMED = 12  # pairs that one note names


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
