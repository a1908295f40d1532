# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The kinematic tree of a URDF: links and their shapes, joints, and mimic joints.

Format: http://wiki.ros.org/urdf/XML. Links, joints and their origins are checked at once, limits,
shapes and masses on access, as a viewer does not need them. Invalid content raises a
DescriptionError.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, field, replace
from enum import Enum
import math
import re
from typing import TypeAlias
from xml.etree import ElementTree as ET

from .exceptions import DescriptionError
from .transforms import from_rpy, Transform, Vector

DEFAULT_AXIS = '1 0 0'  # axis of a joint without ``<axis>`` (URDF)
XACRO_TAG = re.compile(r'\{[^}]*xacro[^}]*\}')  # namespace of elements that xacro replaces


class JointKind(Enum):
    """Joint types of URDF."""

    FIXED = 'fixed'
    REVOLUTE = 'revolute'
    CONTINUOUS = 'continuous'
    PRISMATIC = 'prismatic'
    FLOATING = 'floating'
    PLANAR = 'planar'


MOVABLE = frozenset({JointKind.REVOLUTE, JointKind.CONTINUOUS, JointKind.PRISMATIC})
"""Joints with one degree of freedom, which have a position in a JointState."""


@dataclass(frozen=True, slots=True)
class Mimic:
    """Mimic rule of a joint: position = multiplier * position of the source + offset."""

    source: str  # name of the joint that is followed; never one that follows another
    multiplier: float = 1.0  # factor; [m/rad] or [rad/m] between a rotary and a linear joint
    offset: float = 0.0  # summand in [rad] or [m]

    def position(self, source: float) -> float:
        """Return the position in [rad] or [m] for a position of the source."""
        return self.multiplier * source + self.offset

    def velocity(self, source: float) -> float:
        """Return the velocity in [rad/s] or [m/s] for a velocity of the source."""
        return self.multiplier * source


@dataclass(frozen=True, slots=True)
class JointRange:
    """Position range and maximum velocity of a joint, in radians or metres."""

    name: str  # name of the joint
    lower: float  # least position in [rad]; minus infinity for a continuous joint
    upper: float  # greatest position in [rad]; infinity for a continuous joint
    velocity: float  # greatest speed in [rad/s]; 0 where the description gives none
    unit: str = 'rad'  # unit of its positions, rad or m


@dataclass(frozen=True, slots=True)
class Joint:
    """A joint."""

    name: str  # its name
    kind: JointKind  # its type
    parent: str  # name of the parent link
    child: str  # name of the child link
    origin: Transform  # pose of the child in the parent at position zero
    axis: Vector  # unit vector in the child's frame
    mimic: Mimic | None = None  # what it follows, if it does
    # attributes of ``<limit>`` as they are written, if there is one
    limit: Mapping[str, str] | None = None
    # soft limits of ``<safety_controller>`` in [rad], if it has both
    soft: tuple[float, float] | None = None

    @property
    def independent(self) -> bool:
        """Whether it has a degree of freedom of its own."""
        return self.kind in MOVABLE and self.mimic is None

    @property
    def range(self) -> JointRange:
        """Position range and maximum velocity; velocity 0 if the description has none.

        Soft limits narrow it, as in MoveIt.

        Raises:
            DescriptionError: It is neither continuous nor fixed and has no ``<limit>``, or one
                without usable numbers.
        """
        if self.limit is None and self.kind is JointKind.CONTINUOUS:
            return JointRange(self.name, -math.inf, math.inf, 0.0)
        if self.limit is None:
            raise DescriptionError(
                f'joint {self.name}: a {self.kind.value} joint needs <limit .../>'
            )
        try:
            velocity = float(self.limit['velocity'])
            if self.kind is JointKind.CONTINUOUS:
                return JointRange(self.name, -math.inf, math.inf, velocity)
            lower, upper = self.stops
        except (KeyError, ValueError) as error:
            raise DescriptionError(f'joint {self.name}: <limit> is not usable: {error}') from error
        if self.soft is not None and max(lower, self.soft[0]) < min(upper, self.soft[1]):
            lower, upper = max(lower, self.soft[0]), min(upper, self.soft[1])
        unit = 'm' if self.kind is JointKind.PRISMATIC else 'rad'
        return JointRange(self.name, lower, upper, velocity, unit)

    @property
    def stops(self) -> tuple[float, float]:
        """Lower and upper position of ``<limit>`` in [rad]."""
        if self.limit is None or self.kind is JointKind.CONTINUOUS:
            return -math.inf, math.inf
        return float(self.limit.get('lower', 0)), float(self.limit.get('upper', 0))


Color: TypeAlias = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class UrdfShape:
    """A visual or collision shape of a link."""

    link: str  # name of the link
    shape: str  # what it is: box, cylinder, sphere, mesh, or empty where there is none
    attributes: Mapping[str, str]  # its attributes as they are written
    origin: Transform  # where it is in the link's frame
    # red, green, blue and opacity from 0 to 1; None where the URDF gives no usable one
    color: Color | None = None
    note: str = ''  # why its color is not usable; empty where it is, or where there is none

    def lengths(self, *names: str) -> tuple[float, ...]:
        """Return the numbers of some of its attributes in [m]."""
        try:
            return tuple(float(word) for name in names for word in self.attributes[name].split())
        except (KeyError, ValueError) as error:
            raise DescriptionError(
                f'link {self.link}: <{self.shape}> is not usable: {error}'
            ) from error


@dataclass(frozen=True, slots=True)
class PointMass:
    """Where the mass of a link is."""

    link: str  # name of the link
    mass: float  # in [kg]
    centre: Vector  # its centre in the link in [m]


@dataclass(frozen=True, slots=True)
class KinematicTree:
    """Contents of a URDF."""

    name: str  # name of the robot
    root: str  # name of the link without a parent
    links: tuple[str, ...]  # names of all links, in the order of the URDF
    joints: tuple[Joint, ...]  # all joints, in the order of the URDF
    _robot: ET.Element = field(repr=False, compare=False)

    def movable(self) -> Iterator[Joint]:
        """Yield the joints that have a position in a JointState."""
        return (joint for joint in self.joints if joint.kind in MOVABLE)

    def ranges(self) -> dict[str, JointRange]:
        """Return position range and maximum velocity of each independent joint, by name."""
        return {joint.name: joint.range for joint in self.joints if joint.independent}

    def chain(self, base: str, tip: str) -> list[Joint]:
        """Return the joints from a link out to the tip.

        Raises:
            DescriptionError: A link is unknown, or the tip is no descendant of the base.
        """
        for link in (base, tip):
            if link not in self.links:
                known = ', '.join(sorted(self.links))
                raise DescriptionError(
                    f'there is no link {link!r} in the description; links: {known}'
                )
        above = {joint.child: joint for joint in self.joints}
        joints: list[Joint] = []
        link = tip
        while link != base:
            if link not in above:
                raise DescriptionError(
                    f'link {tip!r} does not hang on link {base!r} in the description'
                )
            joints.append(above[link])
            link = above[link].parent
        return joints[::-1]

    def collisions(self) -> Iterator[UrdfShape]:
        """Yield the collision shapes of all links."""
        return self._shapes('collision')

    def visuals(self) -> Iterator[UrdfShape]:
        """Yield the visual shapes of all links."""
        return self._shapes('visual')

    def masses(self) -> Iterator[PointMass]:
        """Yield the masses of the links that have one."""
        for link in self._robot.findall('link'):
            inertial = link.find('inertial')
            mass = None if inertial is None else inertial.find('mass')
            if inertial is not None and mass is not None:
                name = _name(link, 'link')
                place = f'link {name}, <inertial>'
                value = _number(mass.get('value', ''), f'{place}, <mass>')
                yield PointMass(name, value, _origin(inertial, place).translation)

    def _shapes(self, tag: str) -> Iterator[UrdfShape]:
        materials = {each.get('name'): each for each in self._robot.findall('material')}
        for link in self._robot.findall('link'):
            name = _name(link, 'link')
            for element in link.findall(tag):
                shape = next(iter(element.find('geometry') or ()), None)
                place = f'link {name}, <{tag}>'
                color, note = _color(element.find('material'), materials)
                yield UrdfShape(
                    name,
                    '' if shape is None else shape.tag,
                    {} if shape is None else dict(shape.attrib),
                    _origin(element, place),
                    color,
                    note,
                )

    def bare_urdf(self, bound: float) -> str:
        """Return a URDF with links and joints only, for kinematics libraries.

        Continuous joints become revolute ones with limits of -bound and +bound in [rad].
        """
        bare = ET.Element('robot', name=self.name or 'robot')
        for link in self.links:
            ET.SubElement(bare, 'link', name=link)
        for joint in map(deepcopy, self._robot.findall('joint')):
            bare.append(joint)
            if joint.get('type') == JointKind.CONTINUOUS.value:
                joint.set('type', JointKind.REVOLUTE.value)
                limit = joint.find('limit')
                limit = ET.SubElement(joint, 'limit') if limit is None else limit
                end = {'lower': str(-bound), 'upper': str(bound)}
                limit.attrib.update({'effort': '0', 'velocity': '0', **limit.attrib, **end})
        return ET.tostring(bare, encoding='unicode')


def read_urdf(text: str) -> KinematicTree:
    """Read a URDF.

    Raises:
        DescriptionError: The text is empty or no URDF, or its joints form no tree; the message
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
    return KinematicTree(robot.get('name', ''), root, links, tuple(resolved), robot)


def _parse(text: str) -> ET.Element:
    if not text.strip():
        raise DescriptionError('the robot description is empty')
    try:
        robot = ET.fromstring(text)  # noqa: S314  a robot's own description, not from the network
    except ET.ParseError as error:
        raise DescriptionError(
            f'the robot description is no XML: {error}; give its text: "$(xacro robot.xacro)"'
        ) from error
    if robot.tag != 'robot':
        raise DescriptionError(f'the robot description begins with <{robot.tag}>, not <robot>')
    for element in robot.iter():
        if XACRO_TAG.match(element.tag):
            tag = XACRO_TAG.sub('xacro:', element.tag)
            raise DescriptionError(
                f'the robot description still has <{tag}>; expand it with xacro, or name the file'
                ' .xacro'
            )
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
    origin, limit = _origin(element, f'joint {name}'), element.find('limit')
    limits = None if limit is None else dict(limit.attrib)
    mimic = _mimic(element, name) if kind in MOVABLE else None  # some are fixed by a type only
    return Joint(name, kind, parent, child, origin, axis, mimic, limits, _soft(element, name))


def _soft(element: ET.Element, joint: str) -> tuple[float, float] | None:
    """Return the soft limits of a joint, if it has both: some descriptions have gains only."""
    safety = element.find('safety_controller')
    if safety is None or not {'soft_lower_limit', 'soft_upper_limit'} <= set(safety.attrib):
        return None
    try:
        return float(safety.attrib['soft_lower_limit']), float(safety.attrib['soft_upper_limit'])
    except ValueError as error:
        raise DescriptionError(
            f'joint {joint}: <safety_controller> is not usable: {error}'
        ) from error


def _link_of(element: ET.Element, end: str, joint: str) -> str:
    found = element.find(end)
    link = '' if found is None else found.get('link', '')
    if not link:
        raise DescriptionError(f'joint {joint}: it needs <{end} link="..."/>')
    return link


def _origin(element: ET.Element, what: str) -> Transform:
    origin = element.find('origin')
    if origin is None:
        return Transform()
    place = f'{what}: <origin>'
    translation = _vector(origin.get('xyz', '0 0 0'), place)
    return Transform(translation, from_rpy(*_vector(origin.get('rpy', '0 0 0'), place)))


def _color(
    material: ET.Element | None, materials: Mapping[str | None, ET.Element]
) -> tuple[Color | None, str]:
    """Return the color of a material, or of the global one of that name, and any problem.

    An invalid color does not reject the robot: the shape has no color.
    """
    if material is None:
        return None, ''
    known = (material, materials.get(material.get('name')))
    color = next((c for m in known if m is not None and (c := m.find('color')) is not None), None)
    if color is None:
        return None, ''
    words = color.get('rgba', '').split()
    try:
        red, green, blue, opacity = (min(max(_number(each, ''), 0.0), 1.0) for each in words)
    except ValueError:
        text = ' '.join(words)
        return None, f'<color rgba="{text}"> needs four numbers from 0 to 1; shown grey'
    return (red, green, blue, opacity), ''


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
    """Find the root link, and check that all other links descend from it."""
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
    """Resolve a chain of mimic joints to its independent joint."""
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
        mimic = Mimic(
            above.source, mimic.multiplier * above.multiplier, mimic.position(above.offset)
        )
    return replace(joint, mimic=mimic)
