# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What may collide: shapes on the links, the pairs that are checked, how joints part them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pinocchio as pin

from .arrays import Array, Native
from .description import Shape


class PlanningScene:
    """Shapes on the links of a reduced pinocchio model, and the pairs of them that are checked.

    It is not changed once it is made, so any thread may read it.

    Attributes:
        model: The pinocchio model.
        geometry: Its shapes and their pairs.
        pairs: Links of each pair of shapes (k).
        relative_motion_sign: Sense in which each joint moves the second shape of a pair against
            the first (k, n): 1, -1, or 0 for a joint that is not between them.
        distance_rate_bounds: How fast each joint changes a pair's distance at most (k, n) in
            [m/rad], wherever the arm is.
    """

    def __init__(
        self, model: Native, shapes: Sequence[Shape], checks: Callable[[str, str], bool]
    ) -> None:
        """Attach the shapes and pair them.

        Args:
            model: A pinocchio model of one chain; links are frames of it.
            shapes: Shapes of the links.
            checks: Tells whether two links are checked.
        """
        self.model = model
        self.geometry = pin.GeometryModel()
        for number, shape in enumerate(shapes):
            self._attach(number, shape)
        joints = [obj.parentJoint for obj in self.geometry.geometryObjects]
        pairs: list[tuple[str, str]] = []
        ends: list[tuple[int, int]] = []
        for first in range(len(joints)):
            for second in range(first + 1, len(joints)):
                names = (shapes[first].link, shapes[second].link)
                if joints[first] == joints[second] or not checks(*names):
                    continue
                self.geometry.addCollisionPair(pin.CollisionPair(first, second))
                pairs.append(names)
                ends.append((first, second))
        self.pairs: Sequence[tuple[str, str]] = tuple(pairs)
        self.relative_motion_sign: Array = np.array(
            [_between(joints[first], joints[second], model.nv) for first, second in ends]
        ).reshape(len(pairs), model.nv)
        self.distance_rate_bounds: Array = np.array(
            [np.minimum(self._rate_bounds(a, b), self._rate_bounds(b, a)) for a, b in ends]
        ).reshape(len(pairs), model.nv)

    def _attach(self, number: int, shape: Shape) -> None:
        frame_id = self.model.getFrameId(shape.link)
        frame = self.model.frames[frame_id]
        self.geometry.addGeometryObject(
            pin.GeometryObject(
                f'{shape.link}_{number}',
                frame.parentJoint,
                frame_id,
                frame.placement * shape.placement,
                shape.geometry,
            )
        )

    def _rate_bounds(self, shape: int, other: int) -> Array:
        """Return how far each joint between two shapes moves a point of the first at most.

        Seen from the joint, nothing of the shape is farther away than the lengths that lead there.
        """
        objects, model = self.geometry.geometryObjects, self.model
        near, far = objects[shape].parentJoint, objects[other].parentJoint
        rates = np.zeros(model.nv)
        reach = _extent(objects[shape])
        outward = near < far
        # from the shape joint by joint towards the other one
        for joint in range(near + 1, far + 1) if outward else range(near, far, -1):
            if outward:
                reach += _length(model, joint)
            sliding = model.joints[joint].shortname().startswith('JointModelP')
            if sliding:
                place = joint - 1
                reach += max(
                    abs(model.lowerPositionLimit[place]), abs(model.upperPositionLimit[place])
                )
            rates[joint - 1] = 1.0 if sliding else reach
            if not outward:
                reach += _length(model, joint)
        return rates


def _between(first: int, second: int, count: int) -> Array:
    """Return the sense in which each joint of a chain moves one body against another."""
    senses = np.zeros(count)
    senses[first:second] = 1.0
    senses[second:first] = -1.0
    return senses


def _extent(shape: Native) -> float:
    """Return the distance of the farthest point of a shape from its joint in [m]."""
    shape.geometry.computeLocalAABB()
    center = shape.placement.act(shape.geometry.aabb_center)
    return float(np.linalg.norm(center)) + float(shape.geometry.aabb_radius)


def _length(model: Native, joint: int) -> float:
    return float(np.linalg.norm(model.jointPlacements[joint].translation))
