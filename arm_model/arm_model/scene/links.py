# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Links of a URDF: their collision shapes, and which pairs of links need no check.

MoveIt's setup assistant writes ``disable_collisions`` for links that are adjacent, or nearly
always in contact. :func:`with_default_collisions` adds them if an SRDF lacks them. Pairs that the
assistant finds never in contact are still checked: sampling is no proof, and checks of distant
pairs cost nothing. For an SRDF that other programs read, :func:`sample_link_pairs` searches for
contacts much longer.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np
import pinocchio as pin
from urdf_reader import (
    DescriptionError,
    find_mesh,
    KinematicTree,
    MeshFileError,
    Pair,
    read_urdf,
    UrdfShape,
)

from ..arrays import Array, Pose
from ..exceptions import description_refused, SceneError
from ..kinematics import Kinematics
from .clearances import Clearances
from .meshes import load_hulls, MeshError, MIN_FULLNESS
from .objects import (
    AllowedCollisionMatrix,
    Box,
    Capsule,
    Cylinder,
    Mesh,
    native,
    PlacedShape,
    Shape,
    Sphere,
)
from .planning_scene import PlanningScene

CAPSULE_TOLERANCE = 1e-6
"""Tolerance in [m] of spheres on a cylinder's ends to form a capsule."""

PRIMITIVES = {
    'box': (Box, ('size',)),
    'cylinder': (Cylinder, ('radius', 'length')),
    'sphere': (Sphere, ('radius',)),
}
"""Shape elements of a URDF, and their attributes."""


@dataclass(frozen=True, slots=True)
class LinkShapes:
    """Collision shapes of the links."""

    # shapes of each link that has any, in the link's frame
    by_link: Mapping[str, Sequence[PlacedShape]]
    notes: Sequence[str]  # what cannot be checked, or not well, in words


def link_shapes(tree: KinematicTree, folder: Path | None = None) -> LinkShapes:
    """Return the collision shapes of a description; mesh files are relative to its folder."""
    found: dict[str, list[PlacedShape]] = {}
    unusable: dict[str, list[str]] = {}  # links by reason
    loose: dict[str, float] = {}  # fullness by link
    for collision in tree.collisions():
        try:
            solids = _solids(collision, folder)
        except (MeshError, MeshFileError) as error:
            links = unusable.setdefault(str(error), [])
            links += [collision.link] if collision.link not in links else []
            continue
        for shape, fullness in solids:
            if fullness < MIN_FULLNESS:
                loose[collision.link] = min(fullness, loose.get(collision.link, 1.0))
            origin = collision.origin
            rotation = pin.Quaternion(np.array(origin.rotation)).toRotationMatrix()
            placed = PlacedShape(shape, Pose(rotation, np.array(origin.translation)))
            found.setdefault(collision.link, []).append(placed)
    shapes = {link: _with_capsules(each) for link, each in found.items()}
    return LinkShapes(shapes, [*_left_out(unusable, bool(found)), *_loose(loose)])


def _left_out(unusable: Mapping[str, Sequence[str]], found: bool) -> Sequence[str]:
    """Return a note on the links whose collisions are not checked, and why."""
    if not unusable:
        return () if found else ('no link has a <collision>, so self-collision is not checked',)
    reasons = '; '.join(f'{", ".join(links)}: {reason}' for reason, links in unusable.items())
    return (f'self-collision is not checked for these collision shapes: {reasons}',)


def _loose(fullness: Mapping[str, float]) -> Sequence[str]:
    """Return a note on the links whose hull is much larger than the link."""
    if not fullness:
        return ()
    links = ', '.join(f'{link} ({100 * share:.0f} %)' for link, share in fullness.items())
    note = (
        f'meshes are checked as convex hulls, which these links fill in part only: {links}, and'
        ' which could not be cut into pieces (not closed, hollow, too intricate, or not in the'
        ' time of one start: the next one goes on);'
        ' where that refuses too much, give them several <collision> of convex parts'
    )
    return (note,)


def _solids(collision: UrdfShape, folder: Path | None) -> Sequence[tuple[Shape, float]]:
    """Return the shapes of a collision element, and how full each is; a mesh has one per body."""
    if collision.shape == 'mesh':
        name = collision.attributes.get('filename', '')
        hulls = load_hulls(find_mesh(name, folder))
        scale = collision.lengths('scale') if 'scale' in collision.attributes else (1.0,) * 3
        if len(scale) != 3 or not all(scale):
            raise DescriptionError(f'link {collision.link}: <mesh scale> is not usable: {scale}')
        return [(Mesh(each.points * np.array(scale)), each.fullness) for each in hulls]
    if collision.shape not in PRIMITIVES:
        what = f'<{collision.shape}>' if collision.shape else 'an empty <geometry>'
        raise MeshError(f'{what} is no box, cylinder, sphere or mesh')
    kind, names = PRIMITIVES[collision.shape]
    try:
        shape = kind(*collision.lengths(*names))
        native(shape)
    except (TypeError, SceneError) as error:  # another count of numbers, or one below zero
        raise DescriptionError(
            f'link {collision.link}: <{collision.shape}> is not usable: {error}'
        ) from error
    return [(shape, 1.0)]


def _with_capsules(shapes: Sequence[PlacedShape]) -> Sequence[PlacedShape]:
    """Replace each cylinder that has a sphere of its radius on either end by a capsule."""
    left = list(shapes)
    for cylinder in shapes:
        shape, pose = cylinder.shape, cylinder.pose
        if not isinstance(shape, Cylinder):
            continue
        half = 0.5 * shape.length * pose.rotation[:, 2]
        caps = [_cap(left, shape.radius, pose.position + side * half) for side in (-1, 1)]
        if caps[0] is None or caps[1] is None:
            continue
        for each in (cylinder, caps[0], caps[1]):
            left = [other for other in left if other is not each]
        left.append(PlacedShape(Capsule(shape.radius, shape.length), pose))
    return tuple(left)


def _cap(shapes: Sequence[PlacedShape], radius: float, end: Array) -> PlacedShape | None:
    for placed in shapes:
        if (
            isinstance(placed.shape, Sphere)
            and abs(placed.shape.radius - radius) < CAPSULE_TOLERANCE
            and np.linalg.norm(placed.pose.position - end) < CAPSULE_TOLERANCE
        ):
            return placed
    return None


SAMPLES = 200  # poses that are tried

MIN_SHARE = 0.95
"""Share of poses in contact above which links count as always in contact, as in MoveIt."""

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
    """Return a scene that allows contacts between links that are always in contact.

    Adjacent links are allowed only if the SRDF names no pair and no link; otherwise its author
    left them checked on purpose. Pairs in ``enable_collisions`` are always checked.

    Args:
        notes: Receives a note on pairs that were not in the SRDF.
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
    """Return pairs of links that a joint connects, directly or via links without a shape."""
    above = {joint.child: joint.parent for joint in tree.joints}

    def solid(link: str) -> str:
        while link in above and link not in scene.link_shapes:
            link = above[link]
        return link

    pairs = {frozenset((solid(parent), link)) for link, parent in above.items()}
    return frozenset(pair for pair in pairs if pair <= set(scene.link_shapes))


def always_in_contact(scene: PlanningScene, lower: Array, upper: Array) -> frozenset[Pair]:
    """Return pairs of links in contact in nearly all poses."""
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
    """Return position ranges, limited to one turn for continuous joints."""
    return (
        np.where(np.isfinite(lower), lower, -HALF_TURN),
        np.where(np.isfinite(upper), upper, HALF_TURN),
    )


def drawn_poses(lower: Array, upper: Array, samples: int) -> Iterator[Array]:
    """Draw random poses from a fixed seed."""
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
        """Return the pairs that never came nearer than a margin in [m]."""
        return frozenset(pair for pair, distance in self.least.items() if distance >= margin)


@description_refused()
def sample_link_pairs(urdf: str, samples: int, folder: Path | None = None) -> LinkPairs:
    """Sample which links of a robot are always, sometimes and never in contact.

    Raises:
        ModelError: The URDF does not define a robot.
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
    """Search for contact of a pair by random steps; return its least distance found in [m]."""
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
