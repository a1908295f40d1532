# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Shapes that may collide; all but the cells of octrees convex: their distances are exact."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass
from functools import lru_cache
import math

import coal
import numpy as np

from ..arrays import Array, frozen, Native
from ..exceptions import SceneError
from ..pose import ORIGIN, Pose
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
    """A cylinder along z with half a sphere on either end; its length in [m] is without them."""

    radius: float
    length: float


@dataclass(frozen=True, slots=True)
class Cone:
    """A cone along z, its tip up, its origin half-way up; radius and length in [m]."""

    radius: float
    length: float


@dataclass(frozen=True, slots=True)
class Plane:
    """A half-space: what lies below the plane is solid, as below a table or behind a wall."""

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
            points: Points in [m] (m, 3); what lies within their hull does not count.
            most: Corners of the hull at most; None for any number.

        Raises:
            SceneError: They are no points, or not finite.
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
    """Cubes of an octree that have one size.

    Attributes:
        middles: Their middles (m, 3) in [m], on the grid of their edge about the origin.
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
"""What a link or an object may be made of."""


@dataclass(frozen=True, slots=True)
class PlacedShape:
    """A shape, and where it is in the frame of its link or object."""

    shape: Shape
    pose: Pose = ORIGIN


def native(shape: Shape) -> Native:
    """Return a shape of coal.

    Raises:
        SceneError: A length is not positive and finite, or a normal has no direction.
    """
    if isinstance(shape, Mesh):
        return shape.hull
    if isinstance(shape, Cells):
        return shape.tree
    solid = _half_space(shape) if isinstance(shape, Plane) else _primitive(shape)
    solid.computeLocalAABB()
    return solid


def _half_space(plane: Plane) -> Native:
    length = float(np.linalg.norm(plane.normal))
    if not (np.isfinite(length) and length > 0.0 and np.isfinite(plane.offset)):
        raise SceneError(f'{plane}: the normal has no direction, or the offset is not finite')
    return coal.Halfspace(np.array(plane.normal) / length, plane.offset)


def _primitive(shape: Box | Sphere | Cylinder | Capsule | Cone) -> Native:
    lengths = [float(getattr(shape, name)) for name in shape.__match_args__]
    if not all(0.0 < length < math.inf for length in lengths):
        raise SceneError(f'{shape}: every length must be positive and finite')
    return getattr(coal, type(shape).__name__)(*lengths)


@lru_cache(maxsize=1024)
def padded(shape: Shape, padding: float, scale: float = 1.0) -> Native:
    """Return a shape of coal that is scaled about its middle, then padded in every direction.

    Args:
        padding: How far it reaches beyond its surface in [m].
        scale: Factor of its lengths; a plane has none.

    Raises:
        SceneError: The shape is not usable.
    """
    solid = native(_scaled(shape, scale))
    solid.setSweptSphereRadius(padding)
    solid.computeLocalAABB()
    return solid


def check_padding(link: str, padding: float, scale: float) -> None:
    """Refuse a padding that is negative, a scale that is not positive, and what is not finite."""
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
