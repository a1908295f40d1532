# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Distances and contacts in a scene, and how fast the joints change them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from ..arrays import Array, Native
from .planning_scene import PlanningScene

AT_ONCE = 100
"""Greatest number of pairs measured in one step, during which other threads have to wait."""

TOUCH = 2e-4
"""Least depth of a contact with an octree in [m]: a touched cell may hide an overlapping one.
It is more than path checks tolerate."""


@dataclass(frozen=True, slots=True, eq=False)
class Proximity:
    """Two shapes that are near to each other."""

    pair: int  # number of the pair, a place in :attr:`PlanningScene.pairs`
    links: tuple[str, str]  # names of their links or objects
    distance: float  # between their surfaces in [m]; negative when they overlap
    gradient: Array  # change of the distance with each joint in [m/rad]


@dataclass(frozen=True, slots=True)
class LeastClearance:
    """The two links that are nearest to each other."""

    # between their surfaces in [m], or a lower bound where it is more than asked for
    distance: float
    links: tuple[str, ...] = ()  # their names, or those of objects; empty where nothing is as near


@dataclass(frozen=True, slots=True, eq=False)
class Contact:
    """Two shapes that overlap."""

    bodies: tuple[str, str]  # names of their links or objects
    position: Array  # a point between their surfaces, in the root link in [m]
    normal: Array  # unit vector from the first body to the second, in the root link
    depth: float  # how far they overlap in [m]


class Clearances:
    """Measures distances of pairs, reusing earlier measurements as bounds.

    A pair comes nearer at most by the joint motion times its distance rate bounds, so distant
    pairs are measured only once in many cycles. Not thread-safe: create one instance for each
    thread.
    """

    def __init__(self, scene: PlanningScene) -> None:
        self.scene = scene  # what is measured
        self._kinematics = scene.kinematics
        self._data = scene.kinematics.native.createData()
        self._results = scene.geometry.createData()
        self._found = list(self._results.distanceResults)  # they refer to it
        self._of_cells = scene.of_cells.tolist()
        shapes = [each.geometry for each in scene.geometry.geometryObjects]
        self._radii: Array = np.array([each.aabb_radius for each in shapes])
        self._centers = [  # a plane has none
            each.aabb_center if np.isfinite(each.aabb_radius) else np.zeros(3) for each in shapes
        ]
        self._distances: Array = np.full(len(scene.pairs), -np.inf)
        self._places: Array = np.zeros_like(scene.distance_rate_bounds)

    @property
    def pairs(self) -> Sequence[tuple[str, str]]:
        """Links or objects of each pair of shapes."""
        return self.scene.pairs

    def least(self, positions: Array, within: float) -> Array:
        """Return the distance of each pair in [m]: exact below ``within``, else a lower bound."""
        turned = np.abs(positions - self._places)
        rates = self.scene.distance_rate_bounds
        bounds: Array = self._distances - np.einsum('kn,kn->k', turned, rates)
        (doubtful,) = (bounds < within).nonzero()
        if not doubtful.size:
            return bounds
        if doubtful.size > AT_ONCE:
            apart = self._between_spheres(positions)
            far = apart[doubtful] >= within
            known, doubtful = doubtful[far], doubtful[~far]
            bounds[known] = self._distances[known] = apart[known]
            self._places[known] = positions
        pairs = doubtful.tolist()
        found = self.measure(positions, pairs)
        of_cells = self._of_cells
        bounds[doubtful] = [
            # of an octree coal measures the first cell that is not apart, not the deepest
            min(distance, -TOUCH) if of_cells[pair] and distance <= 0.0 else distance
            for pair, distance in ((pair, found[pair].min_distance) for pair in pairs)
        ]
        self._distances[doubtful] = bounds[doubtful]
        self._places[doubtful] = positions
        return bounds

    def _between_spheres(self, positions: Array) -> Array:
        """Return the distance between the spheres around the shapes of each pair in [m]."""
        self._place(positions)
        placed = zip(self._results.oMg, self._centers, strict=True)
        centers = np.array([placement.act(center) for placement, center in placed])
        first, second = self.scene.pair_shapes.T
        between = np.linalg.norm(centers[first] - centers[second], axis=1)
        apart: Array = between - self._radii[first] - self._radii[second]
        return apart

    def _place(self, positions: Array) -> None:
        native, geometry = self._kinematics.native, self.scene.geometry
        expanded = self._kinematics.expanded(positions)
        pin.updateGeometryPlacements(native, self._data, geometry, self._results, expanded)

    def measure(self, positions: Array, pairs: Sequence[int]) -> Sequence[Native]:
        """Measure the pairs with these numbers, regardless of earlier measurements.

        Returns coal's results of all pairs. Only those of the requested pairs are current; the
        next measurement overwrites them.
        """
        geometry, results, found = self.scene.geometry, self._results, self._found
        self._place(positions)
        # all at once, which is quicker than one by one; other threads wait meanwhile
        if len(pairs) == len(found) <= AT_ONCE:
            pin.computeDistances(geometry, results)
        else:
            for pair in pairs:
                pin.computeDistance(geometry, results, pair)
        return found

    def provably_clear(self, positions: Array, within: float) -> int:
        """Count the leading rows that are proven clear without measuring."""
        turned = np.abs(positions[:, None, :] - self._places)
        rates = self.scene.distance_rate_bounds
        bounds = self._distances - np.einsum('mkn,kn->mk', turned, rates)
        doubtful = (bounds < within).any(axis=1)
        return int(doubtful.argmax()) if doubtful.any() else len(positions)

    def apart(self, lower: Array, upper: Array, within: float) -> bool:
        """Whether all positions between two bounds are proven clear without measuring."""
        turned = np.maximum(upper - self._places, self._places - lower)
        bounds = self._distances - np.einsum('kn,kn->k', turned, self.scene.distance_rate_bounds)
        return not (bounds < within).any()

    def nearest(self, positions: Array, within: float, count: int) -> list[Proximity]:
        """Return the nearest pairs, the nearest first, with the gradients of their distances."""
        distances = self.least(positions, within)
        (places,) = (distances < within).nonzero()
        near = sorted(zip(distances[places].tolist(), places.tolist(), strict=True))[:count]
        if not near:
            return []
        gradients = self._gradients(positions, [pair for _, pair in near])
        return [
            Proximity(pair, self.scene.pairs[pair], distance, gradient)
            for (distance, pair), gradient in zip(near, gradients, strict=True)
        ]

    def contacts(self, positions: Array) -> list[Contact]:
        """Return all pairs of shapes that overlap, the deepest first."""
        distances = self.least(positions, 0.0)
        touching = (distances < 0.0).nonzero()[0].tolist()
        found = []
        for pair in sorted(touching, key=distances.__getitem__):
            result = self._found[pair]
            middle = 0.5 * (result.getNearestPoint1() + result.getNearestPoint2())
            names, depth = self.scene.pairs[pair], -float(distances[pair])
            found.append(Contact(names, middle, result.normal.copy(), depth))
        return found

    def _gradients(self, positions: Array, pairs: Sequence[int]) -> Array:
        """Return the derivatives of the distances of measured pairs by joint position (m, n).

        A joint with the twist v, w about the base's origin moves a point p at v + w x p; along
        the normal n, which points from the first shape to the second, that is n v + (p x n) w.
        """
        kinematics = self._kinematics
        pin.computeJointJacobians(kinematics.native, self._data, kinematics.expanded(positions))
        wrenches = []
        for pair in pairs:
            result = self._found[pair]
            a, b, c = result.getNearestPoint2().tolist()
            x, y, z = result.normal.tolist()
            # crossed by hand: numpy's own takes ten times as long
            wrenches.append((x, y, z, b * z - c * y, c * x - a * z, a * y - b * x))
        signs = self.scene.relative_motion_sign[pairs]
        return kinematics.projected((np.array(wrenches) @ self._data.J) * signs)
