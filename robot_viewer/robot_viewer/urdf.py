# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The kinematic tree of a URDF: links, joints, and which joints follow others.

Format: http://wiki.ros.org/urdf/XML. Shapes, inertias and limits are of no interest here.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
import math
from xml.etree import ElementTree as ET

from .exceptions import DescriptionError
from .transforms import from_rpy, Transform, Vector

DEFAULT_AXIS = '1 0 0'
"""Axis of a joint without ``<axis>`` (URDF)."""


class JointKind(Enum):
    """Joint types of URDF."""

    FIXED = 'fixed'
    REVOLUTE = 'revolute'
    CONTINUOUS = 'continuous'
    PRISMATIC = 'prismatic'
    FLOATING = 'floating'
    PLANAR = 'planar'


MOVABLE = frozenset({JointKind.REVOLUTE, JointKind.CONTINUOUS, JointKind.PRISMATIC})
"""Joints with one degree of freedom, which a JointState can tell of."""


@dataclass(frozen=True, slots=True)
class Mimic:
    """A joint follows another: position = multiplier * position of the source + offset.

    Attributes:
        source: Name of the joint that is followed; never one that follows another.
        multiplier: Factor; [m/rad] or [rad/m] between a rotary and a linear joint.
        offset: Summand in [rad] or [m].
    """

    source: str
    multiplier: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True, slots=True)
class Joint:
    """A joint.

    Attributes:
        name: Its name.
        kind: Its type.
        parent: Name of the parent link.
        child: Name of the child link.
        origin: Pose of the child in the parent at position zero.
        axis: Unit vector in the child's frame.
        mimic: What it follows, if it does.
    """

    name: str
    kind: JointKind
    parent: str
    child: str
    origin: Transform
    axis: Vector
    mimic: Mimic | None = None


@dataclass(frozen=True, slots=True)
class RobotModel:
    """A kinematic tree.

    Attributes:
        name: Name of the robot.
        root: Name of the link without a parent.
        links: Names of all links, in the order of the URDF.
        joints: All joints, in the order of the URDF.
    """

    name: str
    root: str
    links: tuple[str, ...]
    joints: tuple[Joint, ...]

    def movable(self) -> Iterator[Joint]:
        """Go through the joints that a JointState can tell of."""
        return (joint for joint in self.joints if joint.kind in MOVABLE)


def read_urdf(text: str) -> RobotModel:
    """Read a URDF.

    Args:
        text: The URDF as XML text.

    Returns:
        Its tree.

    Raises:
        DescriptionError: The text is empty or no URDF, or its joints make no tree; the message
            names the element.
    """
    robot = _parse(text)
    links = tuple(_name(element, 'link') for element in robot.findall('link'))
    joints = [_joint(element) for element in robot.findall('joint')]
    _refuse_duplicates('link', links)
    _refuse_duplicates('joint', [joint.name for joint in joints])
    root = _root(links, joints)
    sources = {joint.name: joint for joint in joints}
    resolved = (_with_first_source(joint, sources) for joint in joints)
    return RobotModel(robot.get('name', ''), root, links, tuple(resolved))


def _parse(text: str) -> ET.Element:
    if not text.strip():
        raise DescriptionError('the robot description is empty')
    try:
        robot = ET.fromstring(text)  # noqa: S314  a robot's own description, not from the network
    except ET.ParseError as error:
        raise DescriptionError(f'the robot description is no XML: {error}') from error
    if robot.tag != 'robot':
        raise DescriptionError(f'the robot description begins with <{robot.tag}>, not <robot>')
    return robot


def _name(element: ET.Element, what: str) -> str:
    name = element.get('name')
    if not name:
        raise DescriptionError(f'a <{what}> has no name')
    return name


def _joint(element: ET.Element) -> Joint:
    name = _name(element, 'joint')
    try:
        kind = JointKind(element.get('type', ''))
    except ValueError:
        kinds = ', '.join(kind.value for kind in JointKind)
        raise DescriptionError(
            f'joint {name}: type {element.get("type")!r} is none of {kinds}'
        ) from None
    parent, child = (_link_of(element, end, name) for end in ('parent', 'child'))
    axis = _axis(element, name) if kind in MOVABLE else (1.0, 0.0, 0.0)
    return Joint(name, kind, parent, child, _origin(element, name), axis, _mimic(element, name))


def _link_of(element: ET.Element, end: str, joint: str) -> str:
    found = element.find(end)
    link = '' if found is None else found.get('link', '')
    if not link:
        raise DescriptionError(f'joint {joint}: it needs <{end} link="..."/>')
    return link


def _origin(element: ET.Element, joint: str) -> Transform:
    origin = element.find('origin')
    if origin is None:
        return Transform()
    place = f'joint {joint}: <origin>'
    translation = _vector(origin.get('xyz', '0 0 0'), place)
    return Transform(translation, from_rpy(*_vector(origin.get('rpy', '0 0 0'), place)))


def _axis(element: ET.Element, joint: str) -> Vector:
    axis = element.find('axis')
    text = DEFAULT_AXIS if axis is None else axis.get('xyz', DEFAULT_AXIS)
    x, y, z = _vector(text, f'joint {joint}: <axis>')
    length = math.hypot(x, y, z)
    if not length:
        raise DescriptionError(f'joint {joint}: <axis> has no direction: {text!r}')
    return (x / length, y / length, z / length)


def _mimic(element: ET.Element, joint: str) -> Mimic | None:
    mimic = element.find('mimic')
    if mimic is None:
        return None
    source = mimic.get('joint')
    if not source:
        raise DescriptionError(f'joint {joint}: <mimic> names no joint')
    place = f'joint {joint}: <mimic>'
    multiplier = _number(mimic.get('multiplier', '1'), place)
    return Mimic(source, multiplier, _number(mimic.get('offset', '0'), place))


def _vector(text: str, place: str) -> Vector:
    words = text.split()
    if len(words) != 3:
        raise DescriptionError(f'{place} needs three numbers, not {text!r}')
    x, y, z = (_number(word, place) for word in words)
    return (x, y, z)


def _number(text: str, place: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise DescriptionError(f'{place}: {text!r} is no finite number')
    return value


def _refuse_duplicates(what: str, names: Sequence[str]) -> None:
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise DescriptionError(f'there are several {what}s called {", ".join(twice)}')


def _root(links: Sequence[str], joints: Sequence[Joint]) -> str:
    """Find the link without a parent, and make sure that all others hang on it."""
    if not links:
        raise DescriptionError('the robot description has no <link>')
    parents: dict[str, Joint] = {}
    for joint in joints:
        for link in (joint.parent, joint.child):
            if link not in links:
                raise DescriptionError(f'joint {joint.name}: there is no link {link!r}')
        if joint.child in parents:
            other = parents[joint.child].name
            raise DescriptionError(
                f'link {joint.child} is the child of two joints, {other} and {joint.name}'
            )
        parents[joint.child] = joint
    roots = [link for link in links if link not in parents]
    if len(roots) != 1:
        found = ', '.join(roots) or 'none: the joints make a loop'
        raise DescriptionError(f'exactly one link must have no parent; there are: {found}')
    _refuse_loops(links, parents)
    return roots[0]


def _refuse_loops(links: Sequence[str], parents: Mapping[str, Joint]) -> None:
    for link in links:
        above = link
        for _ in links:
            if above not in parents:
                break
            above = parents[above].parent
        else:
            raise DescriptionError(f'the joints above link {link} make a loop')


def _with_first_source(joint: Joint, joints: Mapping[str, Joint]) -> Joint:
    """Follow a chain of mimics to the joint at its beginning."""
    mimic = joint.mimic
    passed = {joint.name}
    while mimic is not None:
        source = joints.get(mimic.source)
        if source is None or source.kind not in MOVABLE:
            raise DescriptionError(
                f'joint {joint.name} mimics {mimic.source!r}, which is no movable joint'
            )
        if source.mimic is None:
            break
        if source.name in passed:
            raise DescriptionError(f'joint {joint.name} mimics itself by way of {source.name}')
        passed.add(source.name)
        above = source.mimic
        offset = mimic.multiplier * above.offset + mimic.offset
        mimic = Mimic(above.source, mimic.multiplier * above.multiplier, offset)
    fields = (joint.kind, joint.parent, joint.child, joint.origin, joint.axis)
    return Joint(joint.name, *fields, mimic)
