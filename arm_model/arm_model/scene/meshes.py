# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Convex hulls of meshes: located by their name in a URDF, computed once, cached by content.

Reads STL, DAE, OBJ and the other formats of assimp. A mesh is only read to compute its hulls: one
for each separate body, or several for a body that fills little of its hull. Their points are
cached in ``$XDG_CACHE_HOME/arm_model/hulls`` (``~/.cache/arm_model/hulls``), one small file for
each content of a mesh file. The folder may be deleted at any time, and errors in it never end a
program.
"""

from __future__ import annotations

from collections.abc import Sequence
import contextlib
from dataclasses import dataclass
from functools import lru_cache
import hashlib
from pathlib import Path

import coal
import numpy as np
from urdf_reader import mesh_unit

from ..arrays import Array, frozen, Native, Places
from .pieces import cache_file, cut, write_whole

MIN_THICKNESS = 1e-3  # thickness that a flat mesh is given in [m]: a hull needs a volume

MAX_CORNERS = 250
"""Corners of a replacement hull if coal refuses one: a corner may have at most 255 neighbours."""

GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))
"""Turns by this angle in [rad] spread directions evenly."""

MAX_BODIES = 16
"""Greatest number of bodies of a mesh with one hull each; a mesh with more gets a single hull."""

MAX_PARTS = 500  # parts of a mesh without a common corner of which bodies are made

APART = 1e-3
"""Least distance between the bounds of two bodies, as a share of the size of the mesh."""

MIN_FULLNESS = 0.5
"""Least share of its hull that a body fills; a body that fills less is cut into pieces."""

FAR_OUT, MAX_HALVINGS = 0.005, 8
"""Triangles that protrude from a piece by this share of the body are halved, up to so often."""


class MeshError(ValueError):
    """A mesh cannot be used; the message names the reason and the remedy."""


@dataclass(frozen=True, slots=True, eq=False)
class Hull:
    """The convex hull of a body, or of a piece of one."""

    points: Array  # its corners (m, 3), in the unit of the mesh
    # volume of the body as a share of its hull's, or of its pieces'; 1 where it has no inside
    fullness: float
    # False where other bodies took the time to cut this one: the next start does
    final: bool = True


def load_hulls(path: Path) -> Sequence[Hull]:
    """Return the convex hulls of the bodies of a mesh file, from the cache if possible."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise MeshError(f'{path}: {error.strerror}') from error
    return _hulls(hashlib.sha256(path.suffix.lower().encode() + content).hexdigest(), path)


@lru_cache(maxsize=256)
def _hulls(digest: str, path: Path) -> Sequence[Hull]:
    cached = cache_file('hulls', digest)
    if cached is None:
        return hulls_of_file(path)
    hulls = _stored(cached)
    if not hulls:
        hulls = hulls_of_file(path)
        if all(hull.final for hull in hulls):
            with contextlib.suppress(OSError):  # such as a full disk: made the next time, too
                write_whole(
                    cached,
                    points=np.concatenate([each.points for each in hulls]),
                    counts=[len(each.points) for each in hulls],
                    fullness=[each.fullness for each in hulls],
                )
    return hulls


def _stored(path: Path) -> Sequence[Hull]:
    """Read a file of the cache; return nothing if it is missing or damaged."""
    # numpy, zipfile and zlib raise what they like for files that are damaged
    with contextlib.suppress(Exception), np.load(path) as stored:
        points, counts, fullness = (stored[name] for name in ('points', 'counts', 'fullness'))
        parts = np.split(points, np.cumsum(counts)[:-1])
        if (
            points.ndim == 2
            and points.shape[1] == 3
            and np.isfinite(points).all()
            and all(len(part) for part in parts)
        ):
            return tuple(
                Hull(frozen(part), share)
                for part, share in zip(parts, fullness.tolist(), strict=True)
            )
    return ()


def hulls_of_file(path: Path) -> Sequence[Hull]:
    """Read a mesh file and make the convex hulls of its bodies."""
    try:
        mesh = coal.MeshLoader().load(str(path), np.full(3, mesh_unit(path)))
    except ValueError as error:  # the last line is assimp's
        reason = str(error).strip().splitlines()[-1]
        raise MeshError(f'{path}: {reason}; export it as STL, DAE or OBJ') from error
    corners = np.array(mesh.vertices())
    if not len(corners) or not np.isfinite(corners).all():
        raise MeshError('a mesh needs corners, and finite ones')
    faces = map(mesh.tri_indices, range(mesh.num_tris))
    triangles = np.array([[face[0], face[1], face[2]] for face in faces], dtype=int)
    triangles = _of_parts(triangles, len(corners))
    if not len(triangles):
        return (Hull(frozen(convex(corners).points()), 1.0),)
    points, same = np.unique(corners, axis=0, return_inverse=True)
    triangles = same.reshape(-1)[triangles]
    bodies = _bodies(points, triangles)
    return tuple(hull for body in bodies for hull in _hulls_of_body(points, triangles[body]))


def _of_parts(triangles: Places, corners: int) -> Places:
    """Return triangles with corners numbered through the whole mesh; none if that is ambiguous.

    coal numbers the corners of each material of a mesh from 0 on. The first triangle of a material
    has the corners 0, 1 and 2, and others only such as were named before, or the next one.
    """
    if len(np.unique(triangles)) == corners:
        return triangles
    (firsts,) = (triangles == np.arange(3)).all(axis=1).nonzero()
    parts = np.split(triangles, firsts[firsts > 0])
    counts = [int(part.max()) + 1 for part in parts]
    if sum(counts) != corners:
        return triangles[:0]
    begins = np.cumsum([0, *counts[:-1]])
    return np.concatenate([part + begin for part, begin in zip(parts, begins, strict=True)])


def _hulls_of_body(points: Array, triangles: Places) -> Sequence[Hull]:
    """Return the hull of a body, or of its pieces if it fills little of its hull."""
    corners = points[triangles]
    a, b, c = corners.transpose(1, 0, 2)
    solid = abs(float((a * np.cross(b, c)).sum()) / 6.0)
    hull = convex(corners.reshape(-1, 3))
    whole, final = hull.computeVolume(), True
    if 0.0 < solid < MIN_FULLNESS * whole:
        used, places = np.unique(triangles, return_inverse=True)
        try:
            pieces = _around_triangles(corners, cut(points[used], places.reshape(-1, 3)))
        except TimeoutError:
            pieces, final = (), False
        volume = sum(piece.computeVolume() for piece in pieces)
        if pieces and volume < whole:
            return [Hull(frozen(each.points()), min(solid / volume, 1.0)) for each in pieces]
    return (Hull(frozen(hull.points()), min(solid / whole, 1.0) if solid else 1.0, final),)


def _around_triangles(triangles: Array, pieces: Sequence[Array]) -> Sequence[Native]:
    """Return one hull per piece of a body, which together enclose the body's whole surface.

    CoACD's pieces leave corners of the body outside, by micrometres to millimetres, so contact
    checks cannot rely on them. Therefore each triangle (n, 3, 3) is assigned as a whole to the
    piece from which it protrudes least, and the hulls are rebuilt from triangles. A triangle
    that protrudes far, such as a long one across several pieces, is halved first.
    """
    walls = [(np.array(each.normals()), np.array(each.offsets())) for each in map(convex, pieces)]
    far = FAR_OUT * np.ptp(triangles.reshape(-1, 3), axis=0).max()
    parts: list[list[Array]] = [[] for _ in walls]
    for halvings in range(MAX_HALVINGS + 1 if walls else 0):
        corners, same = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
        depths = np.array([(corners @ n.T + d).max(axis=1) for n, d in walls])
        beyond = depths[:, same.reshape(-1, 3)].max(axis=2)
        nearest = beyond.argmin(axis=0)
        if halvings == MAX_HALVINGS:
            far = np.inf
        for place, part in enumerate(parts):
            mine = (nearest == place) & (beyond[place] <= far)
            part.append(triangles[mine].reshape(-1, 3))
        triangles = _halved(triangles[beyond.min(axis=0) > far])
    points = [np.concatenate(part) for part in parts]
    return [convex(each) for each in points if len(each)]


def _halved(triangles: Array) -> Array:
    """Cut triangles (n, 3, 3) in two at the middle of their longest edges."""
    lengths = np.linalg.norm(np.roll(triangles, -1, axis=1) - triangles, axis=2)
    row, longest = np.arange(len(triangles)), lengths.argmax(axis=1)
    start, end, tip = (triangles[row, (longest + step) % 3] for step in range(3))
    middle = 0.5 * (start + end)
    halves = np.stack((start, middle, tip), axis=1), np.stack((middle, end, tip), axis=1)
    return np.concatenate(halves)


def _bodies(points: Array, triangles: Places) -> Sequence[Places]:
    """Return the triangles of each separate body, or of the whole mesh if there are too many."""
    labels, before = np.arange(len(points)), np.arange(0)
    while not np.array_equal(labels, before):
        before = labels.copy()
        np.minimum.at(labels, triangles, labels[triangles].min(axis=1, keepdims=True))
        labels = labels[labels]
    of_body = labels[triangles[:, 0]]
    bodies = [np.flatnonzero(of_body == each) for each in np.unique(of_body)[: MAX_PARTS + 1]]
    slack = APART * np.ptp(points, axis=0).max()
    found: list[tuple[Places, Array, Array]] = []
    for part in bodies if len(bodies) <= MAX_PARTS else ():
        body = part
        inside = points[triangles[body]].reshape(-1, 3)
        lower, upper = inside.min(axis=0) - slack, inside.max(axis=0) + slack
        while near := [
            each for each in found if (each[1] <= upper).all() and (lower <= each[2]).all()
        ]:
            found = [each for each in found if not any(each is other for other in near)]
            body = np.concatenate([body, *(each[0] for each in near)])
            lower = np.min([lower, *(each[1] for each in near)], axis=0)
            upper = np.max([upper, *(each[2] for each in near)], axis=0)
        found.append((body, lower, upper))
    if not 1 <= len(found) <= MAX_BODIES:
        return (np.arange(len(triangles)),)
    return tuple(body for body, _, _ in found)


def convex(points: Array, most: int | None = None) -> Native:
    """Return the convex hull of points in [m] (m, 3) for coal; a flat hull is thickened.

    A hull with too many corners is enclosed in one with the allowed number.
    """
    if not len(points) or not np.isfinite(points).all():
        raise MeshError('a mesh needs corners, and finite ones')
    solid = _with_volume(np.asarray(points, dtype=np.float64))
    try:
        hull = _convex(solid)
    except RuntimeError:  # a corner has more neighbours than coal can count
        return _convex(_around(solid, MAX_CORNERS))
    if most is not None and hull.num_points > most:
        return _convex(_around(hull.points(), most))
    return hull


def _convex(points: Array) -> Native:
    corners = coal.StdVec_Vec3s()
    for point in points:
        corners.append(point)
    return coal.Convex.convexHull(corners, True, 'Qt')


def _around(points: Array, most: int) -> Array:
    """Return few points whose hull encloses many points, and is hardly larger.

    They are the outermost points in evenly spread directions, moved outwards from their middle
    until all others are inside.
    """
    steps = np.arange(most)
    height = 1.0 - 2.0 * (steps + 0.5) / most
    width, turns = np.sqrt(1.0 - height**2), GOLDEN_ANGLE * steps
    directions = np.stack((width * np.cos(turns), width * np.sin(turns), height))
    scale = np.ptp(points, axis=0)  # of a long thing the sides count as well as the ends
    outermost = points[np.unique((points / scale @ directions).argmax(axis=0))]
    inner = _convex(outermost)
    normals, offsets = np.array(inner.normals()), np.array(inner.offsets())
    middle = outermost.mean(axis=0)
    depths = -(normals @ middle + offsets)
    beyond = (points @ normals.T + offsets).max(axis=0)
    grown: Array = middle + (1.0 + max((beyond / depths).max(), 0.0)) * (outermost - middle)
    return grown


def _with_volume(points: Array) -> Array:
    """Thicken points that are coplanar, collinear or coincident, on which qhull would crash."""
    centered = points - points.mean(axis=0)
    _, axes = np.linalg.eigh(centered.T @ centered)
    for axis in axes.T:
        if np.ptp(points @ axis) < MIN_THICKNESS:
            half = 0.5 * MIN_THICKNESS * axis
            points = np.concatenate((points - half, points + half))
    return points
