# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The URDF of a quadruped, read once: links, joints, limits, masses."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
import math
from xml.etree import ElementTree as ET

from .exceptions import DescriptionError
from .rotations import from_roll_pitch_yaw, Quaternion, Vector


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
class JointLimits:
    """Range of a joint."""

    lower: float = -math.inf  # smallest position in [rad] or [m]
    upper: float = math.inf  # largest position in [rad] or [m]
    velocity: float = math.inf  # largest speed in [rad/s] or [m/s]
    effort: float = math.inf  # largest torque in [N m] or force in [N]

    def clamp(self, position: float) -> float:
        """Return the nearest position within the range."""
        return min(max(position, self.lower), self.upper)


@dataclass(frozen=True, slots=True)
class Joint:
    """A joint; the child's frame sits in the parent's at ``position``, turned by ``rotation``."""

    name: str  # name in the URDF
    kind: JointKind  # its type
    parent: str  # link that it is fixed to
    child: str  # link that it moves
    position: Vector  # origin in the parent's frame in [m]
    rotation: Quaternion  # from the child's frame at zero to the parent's
    axis: Vector  # unit vector of the motion in the child's frame
    # its range; unlimited where the joint takes no commands and the URDF has none
    limits: JointLimits
    mimics: bool  # whether it follows another joint

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
    """A robot."""

    links: tuple[str, ...]  # names of all links in the order of the URDF
    joints: tuple[Joint, ...]  # all joints in the order of the URDF
    masses: dict[str, PointMass]  # mass and centre of the links that have one, by name
    # radius of the first sphere of the links that have one, by name, in [m]
    spheres: dict[str, float]

    @property
    def commanded(self) -> tuple[Joint, ...]:
        """Joints that take commands, in the order of the URDF."""
        return tuple(joint for joint in self.joints if joint.commanded)


def parse(urdf: str) -> Description:
    """Read a URDF.

    Raises:
        DescriptionError: It is no URDF, a number in it is none, or a joint that takes commands
            has no limits.
    """
    try:
        # a robot description is the user's own file, and expat resolves no external entities
        robot = ET.fromstring(urdf)  # noqa: S314
    except ET.ParseError as error:
        raise DescriptionError(
            f'the robot description is not XML: {error}; give its text: "$(xacro robot.xacro)"'
        ) from error
    if robot.tag != 'robot':
        raise DescriptionError(f'the robot description is not a URDF: its root is <{robot.tag}>')
    links = {link.get('name', ''): link for link in robot.findall('link')}
    spheres = {name: link.find('.//sphere') for name, link in links.items()}
    return Description(
        links=tuple(links),
        joints=tuple(_joint(element) for element in robot.findall('joint')),
        masses={
            name: _point_mass(link)
            for name, link in links.items()
            if link.find('inertial/mass') is not None
        },
        spheres={
            name: _number(sphere, 'radius', name)
            for name, sphere in spheres.items()
            if sphere is not None
        },
    )


def movable_joints(urdf: str) -> tuple[Joint, ...]:
    """Return the joints that have a motor, in the order of the URDF; those that mimic do not.

    Raises:
        DescriptionError: As :func:`parse`.
    """
    return parse(urdf).commanded


def _joint(element: ET.Element) -> Joint:
    name = element.get('name', '')
    try:
        kind = JointKind(element.get('type'))
    except ValueError:
        raise DescriptionError(
            f'joint {name}: {element.get("type")!r} is not a joint type'
        ) from None
    origin = element.find('origin')
    mimics = element.find('mimic') is not None
    return Joint(
        name=name,
        kind=kind,
        parent=_link(element, 'parent'),
        child=_link(element, 'child'),
        position=_vector(origin, 'xyz', name),
        rotation=from_roll_pitch_yaw(*_vector(origin, 'rpy', name)),
        axis=_unit(_vector(element.find('axis'), 'xyz', name, '1 0 0'), name),
        limits=_limits(element, name, kind, needed=kind in MOVABLE and not mimics),
        mimics=mimics,
    )


def _link(element: ET.Element, tag: str) -> str:
    link = element.find(tag)
    name = link.get('link') if link is not None else None
    if not name:
        raise DescriptionError(f'joint {element.get("name")}: <{tag} link="..."/> is missing')
    return name


def _limits(joint: ET.Element, name: str, kind: JointKind, *, needed: bool) -> JointLimits:
    element = joint.find('limit')
    given = {} if element is None else element.attrib
    missing = [key for key in ('velocity', 'effort') if key not in given]
    if needed and missing:
        raise DescriptionError(
            f'joint {name}: a {kind.value} joint needs <limit .../> with {" and ".join(missing)}'
        )
    if element is None:
        return JointLimits()
    velocity, effort = (
        math.inf if key in missing else _number(element, key, name)
        for key in ('velocity', 'effort')
    )
    if kind is JointKind.CONTINUOUS:
        return JointLimits(velocity=velocity, effort=effort)
    lower, upper = (_number(element, key, name) for key in ('lower', 'upper'))
    return JointLimits(lower, upper, velocity, effort)


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
