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
            model: A pinocchio model of joints with one degree of freedom each; links are frames
                of it.
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
            [_signs(model, joints[first], joints[second]) for first, second in ends]
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
        inward, outward = _between(model, objects[shape].parentJoint, objects[other].parentJoint)
        rates = np.zeros(model.nv)
        reach = _extent(objects[shape])
        # from the shape joint by joint towards the other one
        for joint in inward:
            reach += _travel(model, joint)
            rates[joint - 1] = 1.0 if _slides(model, joint) else reach
            reach += _length(model, joint)
        for joint in outward:
            reach += _length(model, joint)
            reach += _travel(model, joint)
            rates[joint - 1] = 1.0 if _slides(model, joint) else reach
        return rates


def _between(model: Native, first: int, second: int) -> tuple[list[int], list[int]]:
    """Return the joints from a body in to the common trunk, and from there out to another."""
    above, below = list(model.supports[first]), list(model.supports[second])
    inward = [joint for joint in above if joint not in below]
    return inward[::-1], [joint for joint in below if joint not in above]


def _signs(model: Native, first: int, second: int) -> Array:
    """Return the sense in which each joint moves one body against another."""
    signs = np.zeros(model.nv)
    inward, outward = _between(model, first, second)
    signs[[joint - 1 for joint in outward]] = 1.0
    signs[[joint - 1 for joint in inward]] = -1.0
    return signs


def _slides(model: Native, joint: int) -> bool:
    return str(model.joints[joint].shortname()).startswith('JointModelP')


def _travel(model: Native, joint: int) -> float:
    """Return how far a sliding joint moves from its zero at most in [m]."""
    if not _slides(model, joint):
        return 0.0
    lower, upper = model.lowerPositionLimit[joint - 1], model.upperPositionLimit[joint - 1]
    return float(max(abs(lower), abs(upper)))


def _extent(shape: Native) -> float:
    """Return the distance of the farthest point of a shape from its joint in [m]."""
    shape.geometry.computeLocalAABB()
    center = shape.placement.act(shape.geometry.aabb_center)
    return float(np.linalg.norm(center)) + float(shape.geometry.aabb_radius)


def _length(model: Native, joint: int) -> float:
    return float(np.linalg.norm(model.jointPlacements[joint].translation))
