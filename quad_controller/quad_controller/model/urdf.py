# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the controller reads of a URDF: joints, their limits, and masses."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
import math
from xml.etree import ElementTree as ET

from ..exceptions import DescriptionError

Vector = tuple[float, float, float]


class JointKind(Enum):
    """Joint types of the URDF specification."""

    REVOLUTE = 'revolute'
    CONTINUOUS = 'continuous'
    PRISMATIC = 'prismatic'
    FIXED = 'fixed'
    FLOATING = 'floating'
    PLANAR = 'planar'


MOVABLE = frozenset({JointKind.REVOLUTE, JointKind.CONTINUOUS, JointKind.PRISMATIC})
"""Joints with exactly one variable."""


@dataclass(frozen=True, slots=True)
class Limits:
    """Range of a joint.

    Attributes:
        lower: Smallest position in [rad] or [m].
        upper: Largest position in [rad] or [m].
        velocity: Largest speed in [rad/s] or [m/s].
    """

    lower: float = -math.inf
    upper: float = math.inf
    velocity: float = math.inf

    def clamp(self, position: float) -> float:
        """Return the nearest position within the range."""
        return min(max(position, self.lower), self.upper)


@dataclass(frozen=True, slots=True)
class Joint:
    """A joint; the child's frame sits in the parent's at ``position``, turned by ``rpy``.

    Attributes:
        name: Name in the URDF.
        kind: Its type.
        parent: Link that it is fixed to.
        child: Link that it moves.
        position: Origin in the parent's frame in [m].
        rpy: Orientation in the parent's frame, fixed axes x, y, z in [rad].
        axis: Unit vector of the motion in the child's frame.
        limits: Its range.
        mimics: Whether it follows another joint.
    """

    name: str
    kind: JointKind
    parent: str
    child: str
    position: Vector
    rpy: Vector
    axis: Vector
    limits: Limits
    mimics: bool

    @property
    def commanded(self) -> bool:
        """Whether it takes commands of its own."""
        return self.kind in MOVABLE and not self.mimics


@dataclass(frozen=True, slots=True)
class PointMass:
    """A link's mass in [kg] and its centre in the link's frame in [m]."""

    mass: float
    centre: Vector


@dataclass(frozen=True, slots=True)
class Description:
    """A robot.

    Attributes:
        joints: All joints in the order of the URDF.
        masses: Mass and centre of the links that have one, by name.
    """

    joints: tuple[Joint, ...]
    masses: dict[str, PointMass]

    @property
    def commanded(self) -> tuple[Joint, ...]:
        """Joints that take commands, in the order of the URDF."""
        return tuple(joint for joint in self.joints if joint.commanded)

    def joint(self, name: str) -> Joint:
        """Return a joint.

        Raises:
            DescriptionError: There is none of that name.
        """
        for joint in self.joints:
            if joint.name == name:
                return joint
        known = ', '.join(joint.name for joint in self.joints) or 'none'
        raise DescriptionError(f'the robot description has no joint {name!r}; it has {known}')


def parse(robot_description: str) -> Description:
    """Read a URDF.

    Args:
        robot_description: URDF as XML text.

    Raises:
        DescriptionError: It is no URDF, or a number in it is none.
    """
    try:
        # a robot description is the user's own file, and expat resolves no external entities
        robot = ET.fromstring(robot_description)  # noqa: S314
    except ET.ParseError as error:
        raise DescriptionError(
            f'robot_description is not XML: {error}; give the text, e.g. "$(xacro robot.xacro)"'
        ) from error
    if robot.tag != 'robot':
        raise DescriptionError(f'robot_description is no URDF: its root is <{robot.tag}>')
    masses = {
        link.get('name', ''): _point_mass(link)
        for link in robot.findall('link')
        if link.find('inertial/mass') is not None
    }
    return Description(tuple(_joint(element) for element in robot.findall('joint')), masses)


def _joint(element: ET.Element) -> Joint:
    name = element.get('name', '')
    try:
        kind = JointKind(element.get('type'))
    except ValueError:
        raise DescriptionError(f'joint {name}: {element.get("type")!r} is no joint type') from None
    origin = element.find('origin')
    return Joint(
        name=name,
        kind=kind,
        parent=_link(element, 'parent'),
        child=_link(element, 'child'),
        position=_vector(origin, 'xyz', name),
        rpy=_vector(origin, 'rpy', name),
        axis=_unit(_vector(element.find('axis'), 'xyz', name, '1 0 0'), name),
        limits=_limits(element.find('limit'), name, kind),
        mimics=element.find('mimic') is not None,
    )


def _link(element: ET.Element, tag: str) -> str:
    link = element.find(tag)
    name = link.get('link') if link is not None else None
    if not name:
        raise DescriptionError(f'joint {element.get("name")}: <{tag} link="..."/> is missing')
    return name


def _limits(element: ET.Element | None, name: str, kind: JointKind) -> Limits:
    if element is None:
        return Limits()
    velocity = _number(element, 'velocity', name) or math.inf
    if kind is JointKind.CONTINUOUS:
        return Limits(velocity=velocity)
    return Limits(_number(element, 'lower', name), _number(element, 'upper', name), velocity)


def _point_mass(link: ET.Element) -> PointMass:
    name = link.get('name', '')
    mass = link.find('inertial/mass')
    value = _number(mass, 'value', name) if mass is not None else 0.0
    return PointMass(value, _vector(link.find('inertial/origin'), 'xyz', name))


def _number(element: ET.Element, attribute: str, name: str) -> float:
    return _numbers(element.get(attribute, '0'), 1, name)[0]


def _vector(
    element: ET.Element | None, attribute: str, name: str, default: str = '0 0 0'
) -> Vector:
    text = element.get(attribute, default) if element is not None else default
    x, y, z = _numbers(text, 3, name)
    return x, y, z


def _numbers(text: str, count: int, name: str) -> list[float]:
    try:
        numbers = [float(word) for word in text.split()]
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(map(math.isfinite, numbers)):
        raise DescriptionError(f'{name}: {text!r} is not {count} finite number(s)')
    return numbers


def _unit(vector: Vector, name: str) -> Vector:
    length = math.hypot(*vector)
    if length == 0.0:
        raise DescriptionError(f'joint {name}: its axis has no direction')
    return vector[0] / length, vector[1] / length, vector[2] / length
