# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A robot description as an arm needs it: ranges of joints, groups, shapes that can be checked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import coal
import numpy as np
import pinocchio as pin
from urdf_reader import (
    Collision,
    DescriptionError,
    Group,
    Joint,
    KinematicTree,
    read_urdf,
    SemanticDescription,
)

from .arrays import Native

CONTINUOUS_BOUND = 1e9
"""Range that a continuous joint is given in [rad], so that its position is one plain angle."""

CAPSULE_TOLERANCE = 1e-6
"""How exactly spheres must sit on a cylinder's ends in [m] to make a capsule of it."""


@dataclass(frozen=True, slots=True)
class Shape:
    """A shape of a link.

    Attributes:
        link: Name of the link.
        geometry: A shape of coal, lengths in [m].
        placement: Where it is, in the link's frame (a pinocchio SE3).
    """

    link: str
    geometry: Native
    placement: Native


class Description:
    """What a URDF says of an arm.

    Attributes:
        name: Name of the robot.
        tree: Its links and joints.
        joints: Its joints by name.
        ranges: Range and speed of each joint that moves by itself.
        shapes: Collision shapes, capsules put together.
        xml: The URDF with continuous joints as endless revolute ones.
        notes: What was passed over, in words.
    """

    def __init__(self, urdf: str) -> None:
        """Read.

        Args:
            urdf: The URDF as XML text.

        Raises:
            DescriptionError: It is no URDF, or a joint that moves lacks its limits.
        """
        self.tree = read_urdf(urdf)
        self.name = self.tree.name
        self.joints: Mapping[str, Joint] = {joint.name: joint for joint in self.tree.joints}
        self.ranges = self.tree.ranges()
        for each in self.ranges.values():
            if not (each.lower < each.upper and each.velocity >= 0.0):  # 0: nobody gives it
                raise DescriptionError(
                    f'joint {each.name}: <limit> {each.lower:g}..{each.upper:g} at'
                    f' {each.velocity:g} is empty'
                )
        notes: list[str] = []
        shapes = _shapes(self.tree, notes)
        self.shapes = tuple(shape for link in shapes for shape in _with_capsules(shapes[link]))
        self.notes = tuple(notes)
        self.xml = self.tree.without_continuous_joints(CONTINUOUS_BOUND)

    def group_joints(self, group: Group, semantic: SemanticDescription) -> list[str]:
        """Return the joints of a group that move by themselves, from the base out.

        Args:
            group: The group.
            semantic: Where its subgroups are.

        Raises:
            DescriptionError: It names a joint, a link or a group that does not exist, or has no
                joint.
        """
        names = [
            name
            for sub in group.subgroups
            for name in self.group_joints(semantic.group(sub), semantic)
        ]
        for base, tip in group.chains:
            names += [joint.name for joint in self.tree.chain(base, tip) if joint.independent]
        for name in group.joints:
            if name not in self.joints:
                raise DescriptionError(
                    f'group {group.name}: joint {name!r} is not in the description'
                )
            names += [name] if self.joints[name].independent else []
        moved = {joint.child: joint for joint in self.tree.joints}
        for link in group.links:
            names += [moved[link].name] if link in moved and moved[link].independent else []
        names = [name for name in names if name not in semantic.passive]
        if not names:
            raise DescriptionError(f'group {group.name}: it has no joint that moves')
        return sorted(dict.fromkeys(names), key=self._depth)

    def _depth(self, joint: str) -> int:
        """Return how many joints a joint hangs on."""
        return len(self.tree.chain(self.tree.root, self.joints[joint].parent))


def _shapes(tree: KinematicTree, notes: list[str]) -> Mapping[str, Sequence[Shape]]:
    """Return the shapes that can be checked, by link; the others are noted."""
    found: dict[str, list[Shape]] = {}
    for collision in tree.collisions():
        shape = _shape(collision)
        if shape is None:
            notes.append(
                f'link {collision.link}: a collision shape is no box, cylinder or sphere; left out'
            )
        else:
            found.setdefault(collision.link, []).append(shape)
    return found


def _shape(collision: Collision) -> Shape | None:
    try:
        if collision.shape == 'box':
            solid = coal.Box(*collision.lengths('size'))
        elif collision.shape == 'cylinder':
            solid = coal.Cylinder(*collision.lengths('radius', 'length'))
        elif collision.shape == 'sphere':
            solid = coal.Sphere(*collision.lengths('radius'))
        else:
            return None
    except TypeError as error:  # another count of numbers
        raise DescriptionError(
            f'link {collision.link}: <{collision.shape}> is not usable: {error}'
        ) from error
    rotation = pin.Quaternion(np.array(collision.origin.rotation)).toRotationMatrix()
    placement = pin.SE3(rotation, np.array(collision.origin.translation))
    return Shape(collision.link, solid, placement)


def _with_capsules(shapes: Sequence[Shape]) -> Sequence[Shape]:
    """Make one capsule of each cylinder with a sphere of its radius on either end."""
    left = list(shapes)
    for cylinder in shapes:
        if not isinstance(cylinder.geometry, coal.Cylinder):
            continue
        ends = [
            cylinder.placement.act(np.array([0.0, 0.0, side * cylinder.geometry.halfLength]))
            for side in (-1, 1)
        ]
        caps = [_cap(left, cylinder.geometry.radius, end) for end in ends]
        if caps[0] is None or caps[1] is None:
            continue
        for each in (cylinder, caps[0], caps[1]):
            left = [shape for shape in left if shape is not each]
        capsule = coal.Capsule(cylinder.geometry.radius, 2 * cylinder.geometry.halfLength)
        left.append(Shape(cylinder.link, capsule, cylinder.placement))
    return left


def _cap(shapes: Sequence[Shape], radius: float, end: Native) -> Shape | None:
    for shape in shapes:
        if (
            isinstance(shape.geometry, coal.Sphere)
            and abs(shape.geometry.radius - radius) < CAPSULE_TOLERANCE
            and np.linalg.norm(shape.placement.translation - end) < CAPSULE_TOLERANCE
        ):
            return shape
    return None
