# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A robot description (URDF): its tree of joints, their ranges, and the shapes of its links."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import math
from xml.etree import ElementTree as ET

import coal
import numpy as np
import pinocchio as pin

from .arrays import Native
from .exceptions import ModelError
from .limits import JointRange
from .srdf import Group, SemanticDescription

MOVABLE = frozenset({'revolute', 'continuous', 'prismatic'})
"""Joint types with one degree of freedom."""

ENDLESS = 1e9
"""Range that a continuous joint is given in [rad], so that its position is one plain angle."""

TOUCH = 1e-6
"""How exactly spheres must sit on a cylinder's ends in [m] to make a capsule of it."""


@dataclass(frozen=True, slots=True)
class Joint:
    """A joint of the tree.

    Attributes:
        name: Its name.
        kind: Its URDF type.
        parent: Link that it hangs on.
        child: Link that it moves.
        mimics: Whether it follows another joint.
    """

    name: str
    kind: str
    parent: str
    child: str
    mimics: bool

    @property
    def movable(self) -> bool:
        """Whether it has a freedom of its own."""
        return self.kind in MOVABLE and not self.mimics


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
    """A parsed URDF.

    Attributes:
        name: Name of the robot.
        joints: Its joints by name.
        ranges: Range and speed of each movable joint.
        shapes: Collision shapes, capsules put together.
        xml: The URDF with continuous joints as endless revolute ones.
        notes: What was passed over, in words.
    """

    def __init__(self, urdf: str) -> None:
        """Parse.

        Args:
            urdf: The URDF as XML text.

        Raises:
            ModelError: It is no URDF, or a movable joint lacks its limits.
        """
        root = _parse(urdf)
        self.name = root.get('name', '')
        self.joints: Mapping[str, Joint] = {j.name: j for j in map(_joint, root.findall('joint'))}
        self.ranges: Mapping[str, JointRange] = {
            element.get('name', ''): _range(element)
            for element in root.findall('joint')
            if self.joints[element.get('name', '')].movable
        }
        self.links = frozenset(link.get('name', '') for link in root.findall('link'))
        notes: list[str] = []
        self.shapes = tuple(
            shape for link in root.findall('link') for shape in _link_shapes(link, notes)
        )
        self.notes = tuple(notes)
        self.xml = _endless(root)
        self._above = {joint.child: joint for joint in self.joints.values()}

    def chain(self, base: str, tip: str) -> list[Joint]:
        """Return the joints from one link out to another.

        Args:
            base: Link where the chain begins.
            tip: Link where it ends.

        Raises:
            ModelError: A link is unknown, or the tip does not hang on the base.
        """
        for link in (base, tip):
            self.check_link(link)
        joints: list[Joint] = []
        link = tip
        while link != base:
            joint = self._above.get(link)
            if joint is None:
                raise ModelError(f'link {tip!r} does not hang on link {base!r} in the description')
            joints.append(joint)
            link = joint.parent
        return joints[::-1]

    def check_link(self, link: str) -> None:
        """Make sure that there is a link.

        Raises:
            ModelError: There is none of this name.
        """
        if link not in self.links:
            known = ', '.join(sorted(self.links))
            raise ModelError(f'there is no link {link!r} in the description; links: {known}')

    def group_joints(self, group: Group, semantic: SemanticDescription) -> list[str]:
        """Return the movable joints of a group, from the base out.

        Args:
            group: The group.
            semantic: Where its subgroups are.

        Raises:
            ModelError: It names a joint, a link or a group that does not exist, or has no joint.
        """
        names = [
            name
            for sub in group.subgroups
            for name in self.group_joints(semantic.group(sub), semantic)
        ]
        for base, tip in group.chains:
            names += [joint.name for joint in self.chain(base, tip) if joint.movable]
        for name in group.joints:
            if name not in self.joints:
                raise ModelError(f'group {group.name}: joint {name!r} is not in the description')
            names += [name] if self.joints[name].movable else []
        if not names:
            raise ModelError(f'group {group.name}: it has no joint that moves')
        return sorted(dict.fromkeys(names), key=self._depth)

    def _depth(self, joint: str) -> int:
        """Return how many joints a joint hangs on."""
        depth, above = 0, self._above.get(self.joints[joint].parent)
        while above is not None:
            depth, above = depth + 1, self._above.get(above.parent)
        return depth


def _parse(urdf: str) -> ET.Element:
    try:
        root = ET.fromstring(urdf)  # noqa: S314  a robot's own description, not from the network
    except ET.ParseError as error:
        raise ModelError(f'the robot description is no XML: {error}') from error
    if root.tag != 'robot':
        raise ModelError(f'the robot description begins with <{root.tag}>, not with <robot>')
    return root


def _joint(element: ET.Element) -> Joint:
    parent, child = element.find('parent'), element.find('child')
    name = element.get('name', '')
    if parent is None or child is None:
        raise ModelError(f'joint {name}: it needs <parent link=.../> and <child link=.../>')
    return Joint(
        name,
        element.get('type', ''),
        parent.get('link', ''),
        child.get('link', ''),
        element.find('mimic') is not None,
    )


def _range(element: ET.Element) -> JointRange:
    name, kind = element.get('name', ''), element.get('type')
    limit = element.find('limit')
    if limit is None:
        raise ModelError(f'joint {name}: a {kind} joint needs <limit .../>')
    try:
        velocity = float(limit.attrib['velocity'])
        if kind == 'continuous':
            return JointRange(-math.inf, math.inf, velocity)
        lower, upper = (float(limit.get(key, 0)) for key in ('lower', 'upper'))
    except (KeyError, ValueError) as error:
        raise ModelError(f'joint {name}: <limit> is not usable: {error}') from error
    if not (lower < upper and velocity > 0):
        raise ModelError(f'joint {name}: <limit> {lower:g}..{upper:g} at {velocity:g} is empty')
    return JointRange(lower, upper, velocity)


def _endless(root: ET.Element) -> str:
    for joint in root.findall('joint'):
        limit = joint.find('limit')
        if joint.get('type') == 'continuous' and limit is not None:
            joint.set('type', 'revolute')
            limit.set('lower', str(-ENDLESS))
            limit.set('upper', str(ENDLESS))
    return ET.tostring(root, encoding='unicode')


def _link_shapes(link: ET.Element, notes: list[str]) -> Sequence[Shape]:
    name = link.get('name', '')
    shapes: list[Shape] = []
    for collision in link.findall('collision'):
        shape = _shape(name, collision)
        if shape is None:
            notes.append(f'link {name}: a collision shape is no box, cylinder or sphere; left out')
        else:
            shapes.append(shape)
    return _with_capsules(shapes)


def _shape(link: str, collision: ET.Element) -> Shape | None:
    geometry = collision.find('geometry')
    element = next(iter(geometry), None) if geometry is not None else None
    if element is None or element.tag not in {'box', 'cylinder', 'sphere'}:
        return None
    try:
        if element.tag == 'box':
            solid = coal.Box(*_numbers(element, 'size', ''))
        elif element.tag == 'cylinder':
            solid = coal.Cylinder(float(element.attrib['radius']), float(element.attrib['length']))
        else:
            solid = coal.Sphere(float(element.attrib['radius']))
        return Shape(link, solid, _origin(collision.find('origin')))
    except (KeyError, ValueError, TypeError) as error:
        raise ModelError(f'link {link}: <{element.tag}> is not usable: {error}') from error


def _numbers(element: ET.Element | None, key: str, default: str) -> list[float]:
    return [
        float(word) for word in (default if element is None else element.get(key, default)).split()
    ]


def _origin(element: ET.Element | None) -> Native:
    xyz, rpy = (np.array(_numbers(element, key, '0 0 0')) for key in ('xyz', 'rpy'))
    return pin.SE3(pin.rpy.rpyToMatrix(rpy), xyz)


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
            and abs(shape.geometry.radius - radius) < TOUCH
            and np.linalg.norm(shape.placement.translation - end) < TOUCH
        ):
            return shape
    return None
