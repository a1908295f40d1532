# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Collision shapes of the links of a URDF: primitives, capsules put together, meshes as hulls."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin
from urdf_reader import DescriptionError, find_mesh, KinematicTree, MeshFileError, UrdfShape

from ..arrays import Array
from ..exceptions import SceneError
from ..pose import Pose
from .meshes import load_hulls, MeshError, MIN_FULLNESS
from .shapes import Box, Capsule, Cylinder, Mesh, native, PlacedShape, Shape, Sphere

CAPSULE_TOLERANCE = 1e-6
"""How exactly spheres must sit on a cylinder's ends in [m] to make a capsule of it."""

PRIMITIVES = {
    'box': (Box, ('size',)),
    'cylinder': (Cylinder, ('radius', 'length')),
    'sphere': (Sphere, ('radius',)),
}
"""Shapes of a URDF, and the attributes that have their numbers."""


@dataclass(frozen=True, slots=True)
class LinkShapes:
    """What the links are made of."""

    # shapes of each link that has any, in the link's frame
    by_link: Mapping[str, Sequence[PlacedShape]]
    notes: Sequence[str]  # what cannot be checked, or not well, in words


def link_shapes(tree: KinematicTree, folder: Path | None = None) -> LinkShapes:
    """Return the collision shapes of a description.

    Args:
        folder: Its folder, where names of mesh files are relative.

    Raises:
        DescriptionError: A shape lacks a number, or has one that is not usable.
    """
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
            placed = PlacedShape(shape, _pose(collision))
            found.setdefault(collision.link, []).append(placed)
    shapes = {link: _with_capsules(each) for link, each in found.items()}
    return LinkShapes(shapes, [*_left_out(unusable, bool(found)), *_loose(loose)])


def _left_out(unusable: Mapping[str, Sequence[str]], found: bool) -> Sequence[str]:
    """Return one line that names the links whose collisions are not checked, and why."""
    if not unusable:
        return () if found else ('no link has a <collision>, so self-collision is not checked',)
    reasons = '; '.join(f'{", ".join(links)}: {reason}' for reason, links in unusable.items())
    return (f'self-collision is not checked for these collision shapes: {reasons}',)


def _loose(fullness: Mapping[str, float]) -> Sequence[str]:
    """Return one line that names the links whose hull is much larger than they are."""
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
    """Return the shapes of a collision, and how full each is; a mesh has one for each body."""
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


def _pose(collision: UrdfShape) -> Pose:
    rotation = pin.Quaternion(np.array(collision.origin.rotation)).toRotationMatrix()
    return Pose(rotation, np.array(collision.origin.translation))


def _with_capsules(shapes: Sequence[PlacedShape]) -> Sequence[PlacedShape]:
    """Make one capsule of each cylinder with a sphere of its radius on either end."""
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
