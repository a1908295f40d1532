# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Distances between the links of an arm, and how fast its joints change them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from .arrays import Array, Native
from .description import Shape
from .srdf import Pair


@dataclass(frozen=True, slots=True, eq=False)
class Proximity:
    """Two shapes that are near to each other.

    Attributes:
        pair: Number of the pair, a place in :attr:`CollisionModel.pairs`.
        links: Names of their links.
        distance: Between their surfaces in [m]; negative when they overlap.
        gradient: Change of the distance with each joint in [m/rad].
    """

    pair: int
    links: tuple[str, str]
    distance: float
    gradient: Array


class CollisionModel:
    """Shapes on the links of a reduced pinocchio model, and the pairs of them that are checked.

    It reads the kinematics that its owner computed last: joint placements for distances, joint
    Jacobians for gradients.

    Attributes:
        seen: Least distance of the last :meth:`nearest` in [m].
    """

    def __init__(
        self, model: Native, data: Native, shapes: Sequence[Shape], disabled: frozenset[Pair]
    ) -> None:
        """Attach the shapes and pair them.

        Args:
            model: A pinocchio model; links are frames of it.
            data: Its data.
            shapes: Shapes of the links.
            disabled: Pairs of links that are not checked.
        """
        self._model, self._data = model, data
        self._geometry = pin.GeometryModel()
        links: list[str] = []
        for number, shape in enumerate(shapes):
            frame_id = model.getFrameId(shape.link)
            frame = model.frames[frame_id]
            placement = frame.placement * shape.placement
            self._geometry.addGeometryObject(
                pin.GeometryObject(
                    f'{shape.link}_{number}',
                    frame.parentJoint,
                    frame_id,
                    placement,
                    shape.geometry,
                )
            )
            links.append(shape.link)
        parents = [obj.parentJoint for obj in self._geometry.geometryObjects]
        self._pairs: list[tuple[str, str]] = []
        self._parents: list[tuple[int, int]] = []
        for first in range(len(links)):
            for second in range(first + 1, len(links)):
                names = (links[first], links[second])
                if parents[first] == parents[second] or frozenset(names) in disabled:
                    continue
                self._geometry.addCollisionPair(pin.CollisionPair(first, second))
                self._pairs.append(names)
                self._parents.append((parents[first], parents[second]))
        self._results = self._geometry.createData()
        self.seen = float('inf')

    @property
    def pairs(self) -> Sequence[tuple[str, str]]:
        """Links of each pair of shapes that is checked."""
        return self._pairs

    def measure(self) -> list[float]:
        """Measure all pairs at the placements of the joints.

        Returns:
            Distance of each pair in [m].
        """
        pin.updateGeometryPlacements(self._model, self._data, self._geometry, self._results)
        pin.computeDistances(self._geometry, self._results)
        return [result.min_distance for result in self._results.distanceResults]

    def least(self) -> float:
        """Measure all pairs, and return the least distance in [m]."""
        pin.updateGeometryPlacements(self._model, self._data, self._geometry, self._results)
        nearest = pin.computeDistances(self._geometry, self._results)
        return float(self._results.distanceResults[nearest].min_distance)

    def nearest(self, within: float, count: int) -> list[Proximity]:
        """Measure, and return the nearest pairs with their gradients.

        Args:
            within: Greatest distance of interest in [m].
            count: How many pairs at most.

        Returns:
            The nearest pairs, the nearest first.
        """
        if not self._pairs:
            return []
        distances = self.measure()
        self.seen = min(distances)
        # few enough that sorting plain numbers is quicker than numpy
        near = sorted(
            (distance, pair) for pair, distance in enumerate(distances) if distance < within
        )
        return [self._proximity(pair, distance) for distance, pair in near[:count]]

    def _proximity(self, pair: int, distance: float) -> Proximity:
        result = self._results.distanceResults[pair]
        first, second = self._parents[pair]
        normal = result.normal  # from the first shape to the second
        gradient = self._toward(second, result.getNearestPoint2(), normal) - self._toward(
            first, result.getNearestPoint1(), normal
        )
        return Proximity(pair, self._pairs[pair], distance, gradient)

    def _toward(self, joint: int, point: Array, direction: Array) -> Array:
        """Return the speed of a point on a joint's body along a direction, per joint speed."""
        if joint == 0:
            return np.zeros(self._model.nv)
        jacobian = pin.getJointJacobian(
            self._model, self._data, joint, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        )
        a, b, c = (point - self._data.oMi[joint].translation).tolist()
        x, y, z = direction.tolist()
        # the lever crossed with the direction, by hand: numpy's own takes ten times as long
        wrench = np.array([x, y, z, b * z - c * y, c * x - a * z, a * y - b * x])
        speeds: Array = wrench @ jacobian
        return speeds
