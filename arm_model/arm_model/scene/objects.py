# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Shapes, collision objects made of them, and the allowed collision matrix.

All shapes except the cells of octrees are convex, with exact distances.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import astuple, dataclass, field, replace
from functools import lru_cache
import math
from types import MappingProxyType

import coal
import numpy as np
from urdf_reader import Pair, SemanticDescription

from ..arrays import Array, frozen, Native, ORIGIN, Pose
from ..exceptions import ObjectNameError, SceneError
from .meshes import convex, MeshError


@dataclass(frozen=True, slots=True)
class Box:
    """A box about its origin; edges along x, y and z in [m]."""

    x: float
    y: float
    z: float


@dataclass(frozen=True, slots=True)
class Sphere:
    """A sphere about its origin; radius in [m]."""

    radius: float


@dataclass(frozen=True, slots=True)
class Cylinder:
    """A cylinder about its origin, along z; radius and length in [m]."""

    radius: float
    length: float


@dataclass(frozen=True, slots=True)
class Capsule:
    """A cylinder along z with a hemisphere on either end; the length in [m] excludes both."""

    radius: float
    length: float


@dataclass(frozen=True, slots=True)
class Cone:
    """A cone along z, its tip up, its origin half-way up; radius and length in [m]."""

    radius: float
    length: float


@dataclass(frozen=True, slots=True)
class Plane:
    """A half-space: everything below the plane is solid, as below a table or behind a wall."""

    # direction that leads out of the solid; of any length
    normal: tuple[float, float, float] = (0.0, 0.0, 1.0)
    offset: float = 0.0  # distance of the plane from the origin along the normal in [m]


class Mesh:
    """The convex hull of points.

    Attributes:
        points: Its corners (m, 3) in [m].
    """

    __slots__ = ('hull', 'points')

    def __init__(self, points: Sequence[Sequence[float]] | Array, most: int | None = None) -> None:
        """Make the hull.

        Args:
            points: Points in [m] (m, 3); points inside their hull are ignored.
            most: Greatest number of corners of the hull; None for no limit.

        Raises:
            SceneError: The points have the wrong shape, or are not finite.
        """
        array = np.asarray(points, dtype=np.float64)
        if array.ndim != 2 or array.shape[1] != 3:
            raise SceneError(f'a mesh needs points of three numbers, not an array {array.shape}')
        try:
            self.hull = convex(array, most)
        except MeshError as error:
            raise SceneError(str(error)) from error
        self.hull.computeLocalAABB()
        self.points = frozen(self.hull.points())

    def __eq__(self, other: object) -> bool:
        """Whether it is the same hull."""
        return isinstance(other, Mesh) and np.array_equal(self.points, other.points)

    def __hash__(self) -> int:
        """Return the hash of the corners."""
        return hash(self.points.tobytes())


class Cells:
    """Cubes of an octree with the same size.

    Attributes:
        middles: Their centers (m, 3) in [m], on a grid of the edge length about the origin.
    """

    __slots__ = ('edge', 'middles', 'tree')

    def __init__(self, middles: Array, edge: float) -> None:
        self.middles, self.edge = frozen(middles), edge
        self.tree = coal.makeOctree(np.asarray(middles, dtype=np.float64), edge)
        self.tree.computeLocalAABB()

    def __eq__(self, other: object) -> bool:
        """Whether it has the same cubes."""
        return (
            isinstance(other, Cells)
            and self.edge == other.edge
            and np.array_equal(self.middles, other.middles)
        )

    def __hash__(self) -> int:
        """Return the hash of the middles."""
        return hash(self.middles.tobytes())


Shape = Box | Sphere | Cylinder | Capsule | Cone | Plane | Mesh | Cells
"""Any shape of a link or an object."""


@dataclass(frozen=True, slots=True)
class PlacedShape:
    """A shape, and its pose in the frame of its link or object."""

    shape: Shape
    pose: Pose = ORIGIN


def native(shape: Shape) -> Native:
    """Convert a shape to coal."""
    if isinstance(shape, Mesh):
        return shape.hull
    if isinstance(shape, Cells):
        return shape.tree
    if isinstance(shape, Plane):
        length = float(np.linalg.norm(shape.normal))
        if not (np.isfinite(length) and length > 0.0 and np.isfinite(shape.offset)):
            raise SceneError(f'{shape}: the normal has no direction, or the offset is not finite')
        solid = coal.Halfspace(np.array(shape.normal) / length, shape.offset)
    else:
        lengths = [float(getattr(shape, name)) for name in shape.__match_args__]
        if not all(0.0 < length < math.inf for length in lengths):
            raise SceneError(f'{shape}: every length must be positive and finite')
        solid = getattr(coal, type(shape).__name__)(*lengths)
    solid.computeLocalAABB()
    return solid


@lru_cache(maxsize=1024)
def padded(shape: Shape, padding: float, scale: float = 1.0) -> Native:
    """Convert a shape to coal, scaled about its middle, then padded by a length in [m]."""
    solid = native(_scaled(shape, scale))
    solid.setSweptSphereRadius(padding)
    solid.computeLocalAABB()
    return solid


def check_padding(link: str, padding: float, scale: float) -> None:
    """Reject a negative padding, a scale of 0 or less, and values that are not finite."""
    if not (0.0 <= padding < float('inf') and 0.0 < scale < float('inf')):
        raise SceneError(
            f'{link}: padding {padding:g} m and scale {scale:g}: the padding must be 0 or more,'
            ' the scale positive, both finite'
        )


def _scaled(shape: Shape, scale: float) -> Shape:
    if isinstance(shape, Mesh):  # a hull of its own, also where the scale is 1
        middle = shape.points.mean(axis=0)
        return Mesh(middle + scale * (shape.points - middle))
    if isinstance(shape, Plane | Cells):  # which links do not have
        return shape
    return type(shape)(*(scale * length for length in astuple(shape)))


@dataclass(frozen=True, slots=True, init=False)
class CollisionObject:
    """An object that the robot must not touch."""

    name: str  # its name, which no link has
    shapes: tuple[PlacedShape, ...]  # its shapes, in its own frame
    # where it is: in the root link, or in the link that it is attached to
    pose: Pose = field(default=ORIGIN, compare=False)

    def __init__(self, name: str, *shapes: Shape | PlacedShape, pose: Pose = ORIGIN) -> None:
        """Create an object.

        Args:
            shapes: Its shapes; a shape without a pose is at the origin of the object.

        Raises:
            SceneError: The name is empty, there is no shape, or a shape is not usable.
        """
        if not name:
            raise ObjectNameError('an object needs a name; give it one')
        if not shapes:
            raise SceneError(f'object {name!r}: no shapes; it needs one at least')
        placed = tuple(
            shape if isinstance(shape, PlacedShape) else PlacedShape(shape) for shape in shapes
        )
        for each in placed:
            native(each.shape)  # or says why not
        object.__setattr__(self, 'name', name)
        object.__setattr__(self, 'shapes', placed)
        object.__setattr__(self, 'pose', pose)

    def at(self, pose: Pose) -> CollisionObject:
        """Return the object with another pose."""
        return CollisionObject(self.name, *self.shapes, pose=pose)

    def is_same(self, other: CollisionObject) -> bool:
        """Whether another object has the same name, and the same shapes at the same poses."""
        return (
            (self.name, len(self.shapes)) == (other.name, len(other.shapes))
            and self.pose.is_close(other.pose)
            and all(
                mine.shape == its.shape and mine.pose.is_close(its.pose)
                for mine, its in zip(self.shapes, other.shapes, strict=True)
            )
        )


@dataclass(frozen=True, slots=True)
class AttachedBody:
    """An object that moves with a link."""

    object: CollisionObject  # the object; its pose is in the link
    link: str  # the link
    touch_links: frozenset[str] = frozenset()  # links that it may touch; the link itself always

    def is_same(self, other: AttachedBody) -> bool:
        """Whether another body is the same object on the same link with the same touch links."""
        mine, its = (self.link, self.touch_links), (other.link, other.touch_links)
        return mine == its and self.object.is_same(other.object)


@dataclass(frozen=True, slots=True)
class AllowedCollisionMatrix:
    """Pairs of links and objects that are allowed to touch, or always checked, as in MoveIt.

    An entry of a pair decides. Without one, the defaults of its two names do: a single default
    applies; of two, both must allow. Without defaults, the pair is checked.
    """

    # true where a pair may touch, by pair
    entries: Mapping[Pair, bool] = field(default_factory=dict)
    # true where a name may touch anything, by name
    defaults: Mapping[str, bool] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Copy both, so that they cannot change."""
        object.__setattr__(self, 'entries', MappingProxyType(dict(self.entries)))
        object.__setattr__(self, 'defaults', MappingProxyType(dict(self.defaults)))

    @classmethod
    def of_srdf(cls, semantic: SemanticDescription) -> AllowedCollisionMatrix:
        """Return the matrix of an SRDF; ``disable_collisions`` has precedence, as in MoveIt."""
        entries = dict.fromkeys(semantic.enabled, False) | dict.fromkeys(semantic.disabled, True)
        return cls(entries, dict.fromkeys(semantic.unchecked, True))

    def allows(self, first: str, second: str) -> bool:
        """Whether two links or objects may touch, and are not checked."""
        entry = self.entries.get(frozenset((first, second)))
        if entry is not None:
            return entry
        found = [self.defaults[name] for name in (first, second) if name in self.defaults]
        return bool(found) and all(found)

    def with_entries(self, pairs: Iterable[Pair], allowed: bool) -> AllowedCollisionMatrix:
        """Return the matrix with the same entry for some pairs."""
        return replace(self, entries={**self.entries, **dict.fromkeys(pairs, allowed)})

    def without(self, name: str) -> AllowedCollisionMatrix:
        """Return the matrix without the entries and the default of a name."""
        return AllowedCollisionMatrix(
            {pair: allowed for pair, allowed in self.entries.items() if name not in pair},
            {each: allowed for each, allowed in self.defaults.items() if each != name},
        )
