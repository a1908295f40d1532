# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The compiled core of motion checks: motions.c, built by the C compiler of the machine.

The first use builds it in half a second into ``~/.cache/arm_model/compiled``
(:mod:`robot_primitives.c_library`). If there is no compiler, or it fails, a warning is logged and
the same checks run in Python, several times slower. ``ARM_MODEL_COMPILED=0`` selects Python.
"""

from __future__ import annotations

from collections.abc import Sequence
import ctypes
from functools import lru_cache
from pathlib import Path
import threading
import weakref

import coal
import numpy as np
from numpy.typing import NDArray
import pinocchio as pin

from robot_primitives import load_c_library

from ..arrays import Array, Native
from .planning_scene import PlanningScene

SOURCE = Path(__file__).with_name('motions.c')
FLAGS = ('-fno-math-errno', '-ffinite-math-only', '-fno-signed-zeros', '-fno-trapping-math')
MUCH = 1e30  # what stands for infinity in [m]
LOADING = threading.Lock()  # several threads may need it first

KINDS = {
    coal.Box: 0,
    coal.Sphere: 1,
    coal.Capsule: 2,
    coal.Cylinder: 3,
    coal.Cone: 4,
    coal.Convex: 5,
    coal.Halfspace: 6,
    coal.OcTree: 7,
}
"""Numbers of the shapes in motions.c."""

NO_POINTS = np.zeros((0, 3))
Integers = NDArray[np.int32]


class CompiledScene:
    """Lower bounds of distances in a scene, one per pair. Not thread-safe."""

    def __init__(self, library: Native, scene: PlanningScene) -> None:
        """Copy the scene to the compiled core; use :func:`compiled_scene` instead."""
        self.library = library
        self._count = len(scene.kinematics.joints)
        self._distances: Array = np.zeros(len(scene.pairs))
        self._where = ctypes.c_double()
        arguments = [*_joints(scene), *_shapes(scene)]
        rates = np.ascontiguousarray(scene.distance_rate_bounds)
        finite = np.minimum(rates, MUCH)  # infinity times no motion is no number
        sizes = (*finite.shape[::-1], len(arguments[1]), len(arguments[6]), len(arguments[-2]))
        joints, pairs, columns, shapes, points = sizes
        self.handle: Native = library.world_new(
            joints,
            columns,
            shapes,
            scene.geometry.ngeoms,
            pairs,
            points,
            *(_pointer(each) for each in arguments),
            _pointer(finite),
        )
        if not self.handle:
            raise MemoryError
        weakref.finalize(self, library.world_free, self.handle)

    def least(self, positions: Array, within: float) -> Array:
        """Return distances of all pairs in [m]: exact below ``within``, else lower bounds."""
        at, within = _row(positions), min(within, MUCH)
        self.library.world_least(self.handle, _pointer(at), within, _pointer(self._distances))
        return self._distances

    def clear(self, positions: Array, required: float) -> bool:
        """Whether all pairs are at least a distance in [m] apart."""
        at = _row(positions)
        return bool(self.library.world_state(self.handle, _pointer(at), required) < 0)

    def edge(self, begin: Array, end: Array, required: Array) -> float | None:
        """Return the share of a straight motion at which a pair is too near, or None.

        ``required`` is the distance in [m] that each pair must keep (k).
        """
        begin, end = _row(begin), _row(end)
        return self._answer(
            self.library.world_edge(
                self.handle,
                _pointer(begin),
                _pointer(end),
                _pointer(required),
                ctypes.byref(self._where),
            )
        )

    def path(
        self,
        polynomials: tuple[Array, Array],
        cells: tuple[Array, Array, Array],
        first_part: float,
        required: Array,
    ) -> float | None:
        """Return a time of a path at which a pair is too near, or None.

        Args:
            polynomials: Start times in [s] (m), and coefficients of the powers 0 to 5 of the time
                since then (m, 6, n).
            cells: Times in [s] that cut the path (c), and up to each time the greatest motion of
                any shape in [m] (c) and the joint travel in [rad] (c, n).
            first_part: Motion of a shape within the parts that are checked first in [m].
            required: Distance in [m] that each pair must keep (k).
        """
        starts, coefficients = map(_row, polynomials)
        times, along, turned = map(_row, cells)
        return self._answer(
            self.library.world_path(
                self.handle,
                len(starts),
                _pointer(starts),
                _pointer(coefficients),
                len(times),
                _pointer(times),
                _pointer(along),
                _pointer(turned),
                first_part,
                _pointer(required),
                ctypes.byref(self._where),
            )
        )

    def _answer(self, code: int) -> float | None:
        if code < 0:
            raise MemoryError
        return None if code else self._where.value


class CompiledSearch:
    """Two trees of RRT-Connect, from the start and from goals. Not thread-safe."""

    def __init__(
        self, scene: CompiledScene, start: Array, required: Array, max_extension: float
    ) -> None:
        """Create the trees.

        Args:
            required: Distance in [m] that each pair must keep (k).
            max_extension: Greatest length of an edge in [rad].
        """
        self._scene = scene  # which must not go before
        self._library, self._count = scene.library, len(start)
        start = _row(start)
        self._handle = self._library.search_new(
            scene.handle, _pointer(start), _pointer(required), max_extension
        )
        if not self._handle:
            raise MemoryError
        weakref.finalize(self, self._library.search_free, self._handle)

    def add_goal(self, goal: Array) -> None:
        """Add a root of the goal tree."""
        goal = _row(goal)
        self._library.search_add_goal(self._handle, _pointer(goal))

    def grow(self, targets: Array) -> Array | None:
        """Grow towards samples (m, n); return the waypoints (k, n) if the trees meet, or None."""
        rows = _row(targets)
        count = self._library.search_grow(self._handle, _pointer(rows), len(rows))
        if count < 0:
            raise MemoryError
        if not count:
            return None
        places = np.empty((count, self._count))
        self._library.search_path(self._handle, _pointer(places))
        return places


def compiled_scene(scene: PlanningScene) -> CompiledScene | None:
    """Return a scene for the compiled core, or None if the core cannot check it.

    None without a core, without pairs, or if an octree moves with a joint.
    """
    with LOADING:
        loaded = library()
    if loaded is None or not scene.pairs:
        return None
    things = scene.geometry.geometryObjects
    if any(things[number].parentJoint for number in scene.octrees):
        return None
    return CompiledScene(loaded, scene)


@lru_cache(maxsize=1)
def library() -> Native | None:
    """Return the compiled core, building it if necessary; None if that is not possible."""
    consequence = 'motions are checked in Python, several times slower'
    loaded: Native | None = load_c_library('arm_model', SOURCE, consequence, FLAGS)
    if loaded is None:
        return None
    for name in ('world_new', 'search_new'):
        getattr(loaded, name).restype = ctypes.c_void_p
    pointer, number, real = ctypes.c_void_p, ctypes.c_int, ctypes.c_double
    for name, arguments in {
        'world_new': [number] * 6 + [pointer] * 16,
        'world_free': [pointer],
        'world_least': [pointer, pointer, real, pointer],
        'world_state': [pointer, pointer, real],
        'world_edge': [pointer] * 5,
        'world_path': [pointer, number, pointer, pointer, number, *[pointer] * 3, real]
        + [pointer] * 2,
        'search_new': [pointer, pointer, pointer, real],
        'search_free': [pointer],
        'search_add_goal': [pointer, pointer],
        'search_grow': [pointer, pointer, number],
        'search_path': [pointer, pointer],
    }.items():
        getattr(loaded, name).argtypes = arguments
    return loaded


def _joints(scene: PlanningScene) -> Sequence[Array | Integers]:
    """Return factors and offsets of columns, parents, prismatic flags, placements, and axes."""
    kinematics, model = scene.kinematics, scene.kinematics.native
    count = len(kinematics.joints)
    offsets = kinematics.expanded(np.zeros(count))
    factors = np.array([kinematics.expanded(row) - offsets for row in np.eye(count)]).T
    screws = np.array([_screw(model, joint) for joint in range(1, model.njoints)])
    slides = np.array([not row[3:].any() for row in screws], np.int32)
    placements = [_numbers(each) for each in list(model.jointPlacements)[1:]]
    return [
        np.ascontiguousarray(factors),
        np.array(offsets, float),
        np.array(list(model.parents)[1:], np.int32) - 1,
        slides,
        np.array(placements),
        np.ascontiguousarray(np.where(slides[:, None], screws[:, :3], screws[:, 3:])),
    ]


def _screw(model: Native, joint: int) -> Array:
    """Return the twist of a unit velocity of a joint: linear, angular."""
    data = model.joints[joint].createData()
    model.joints[joint].calc(data, np.zeros(model.nq))
    screw: Array = np.array(data.S).ravel()
    return screw


def _shapes(scene: PlanningScene) -> Sequence[Array | Integers]:
    """Return kinds, movers, placements, sizes, swept, owners, starts of corners, corners, pairs.

    The cells of octrees are boxes after all other shapes, owned by their octrees.
    """
    things = list(scene.geometry.geometryObjects)
    kinds, sizes, swept, corners = [], [], [], []
    for thing in things:
        solid = thing.geometry
        kinds.append(KINDS[type(solid)])
        radius, half = getattr(solid, 'radius', 0.0), getattr(solid, 'halfLength', 0.0)
        size = [radius, half, 0.0, 0.0]
        if isinstance(solid, coal.Box):
            size = [*solid.halfSide.tolist(), 0.0]
        elif isinstance(solid, coal.Halfspace):
            size = [*solid.n.tolist(), solid.d]
        rounded = radius if isinstance(solid, coal.Sphere | coal.Capsule) else 0.0
        sizes.append(size)
        padding = 0.0 if isinstance(solid, coal.OcTree) else solid.getSweptSphereRadius()
        swept.append(rounded + padding)
        corners.append(solid.points() if isinstance(solid, coal.Convex) else NO_POINTS)
    placements = np.array([_numbers(thing.placement) for thing in things])
    owners, middles, cells = _cells(scene)
    counts = [*map(len, corners), *[0] * len(owners)]
    return [
        np.array(kinds + [KINDS[coal.Box]] * len(owners), np.int32),
        np.array([*(each.parentJoint - 1 for each in things), *[-1] * len(owners)], np.int32),
        np.concatenate((placements, middles)),
        np.concatenate((sizes, cells)),
        np.concatenate((swept, np.zeros(len(owners)))),
        np.concatenate((np.arange(len(things)), owners)).astype(np.int32),
        np.concatenate(((0,), np.cumsum(counts))).astype(np.int32),
        np.ascontiguousarray(np.concatenate(corners)),
        scene.pair_shapes.astype(np.int32),
    ]


def _cells(scene: PlanningScene) -> tuple[Array, Array, Array]:
    """Return numbers of the octrees of cells (c), placements (c, 12) and sizes (c, 4)."""
    owners, placements, sizes = [np.zeros(0)], [np.zeros((0, 12))], [np.zeros((0, 4))]
    for number, cells in scene.octrees.items():
        place, count = scene.geometry.geometryObjects[number].placement, len(cells.middles)
        middles = cells.middles @ place.rotation.T + place.translation
        turned = np.tile(place.rotation.ravel(), (count, 1))
        owners.append(np.full(count, number))
        placements.append(np.concatenate((turned, middles), axis=1))
        sizes.append(np.tile((*[0.5 * cells.edge] * 3, 0.0), (count, 1)))
    return np.concatenate(owners), np.concatenate(placements), np.concatenate(sizes)


def _numbers(placement: pin.SE3) -> Array:
    """Return the rotation row by row, then the origin."""
    numbers: Array = np.concatenate((placement.rotation.ravel(), placement.translation))
    return numbers


def _row(values: Array) -> Array:
    """Return numbers as a C array; keep a reference until C has read them."""
    return np.ascontiguousarray(values, dtype=np.float64)


def _pointer(array: Array | Integers) -> int:
    return array.ctypes.data
