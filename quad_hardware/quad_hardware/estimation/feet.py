# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Where the feet are in the body, from the chains of the URDF.

In plain numbers: for four legs of three joints, arrays cost several times as much.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math
from typing import NamedTuple
from xml.etree import ElementTree as ET

from quad_description import LEGS

from ..exceptions import CommandError
from .rotation import from_roll_pitch_yaw, IDENTITY, multiply, Quaternion, rotate, Vector

BASE = 'base_link'
FEET = tuple(f'{leg}_foot' for leg in LEGS)
_ORIGIN: Vector = (0.0, 0.0, 0.0)


class FootPose(NamedTuple):
    """Where a foot is.

    Attributes:
        position: Of its centre [m].
        rotation: From the foot to what the position is given in, (x, y, z, w).
    """

    position: Vector
    rotation: Quaternion


FootPoses = Sequence[FootPose]
"""Where the feet are, in URDF order."""


@dataclass(frozen=True, slots=True)
class _Joint:
    """A turning joint, and the fixed part of the leg before it."""

    position: Vector  # [m]
    rotation: Quaternion
    axis: Vector  # of length 1
    index: int  # of its angle


@dataclass(frozen=True, slots=True)
class _Leg:
    joints: tuple[_Joint, ...]
    tip: FootPose  # behind the last joint

    def pose(self, angles: Sequence[float]) -> FootPose:
        position, rotation = _ORIGIN, IDENTITY
        for joint in self.joints:
            position = _sum(position, rotate(rotation, joint.position))
            if joint.rotation is not IDENTITY:
                rotation = multiply(rotation, joint.rotation)
            sine, (x, y, z) = math.sin(angles[joint.index] / 2), joint.axis
            turn = sine * x, sine * y, sine * z, math.cos(angles[joint.index] / 2)
            rotation = multiply(rotation, turn)
        tip = self.tip
        return FootPose(
            _sum(position, rotate(rotation, tip.position)), multiply(rotation, tip.rotation)
        )


class Feet:
    """Forward kinematics of the feet.

    Attributes:
        radius: Of a foot, which is a ball [m].
    """

    def __init__(self, urdf: str, joints: Sequence[str]) -> None:
        """Read the legs.

        Args:
            urdf: The robot.
            joints: Order of the positions that are given to :meth:`poses`.

        Raises:
            CommandError: A foot is missing.
        """
        root = ET.fromstring(urdf)  # noqa: S314  # the robot's own description
        parents = {_link(joint, 'child'): joint for joint in root.iter('joint')}
        self.radius = _sphere_radius(root, FEET[0])
        self._legs = [_leg(_chain(parents, foot), joints) for foot in FEET]

    def poses(self, angles: Sequence[float]) -> FootPoses:
        """Return where the feet are in base_link.

        Args:
            angles: Positions of the joints [rad].
        """
        return [leg.pose(angles) for leg in self._legs]


def _sum(one: Vector, other: Vector) -> Vector:
    return one[0] + other[0], one[1] + other[1], one[2] + other[2]


def _chain(parents: dict[str, ET.Element], foot: str) -> list[ET.Element]:
    """Return the joints from the body to a foot."""
    chain: list[ET.Element] = []
    link = foot
    while link != BASE:
        joint = parents.get(link)
        if joint is None:
            raise CommandError(
                f'the URDF has no chain from {BASE} to {foot}: nothing moves {link}'
            )
        chain.insert(0, joint)
        link = _link(joint, 'parent')
    return chain


def _link(joint: ET.Element, end: str) -> str:
    element = joint.find(end)
    return '' if element is None else element.get('link', '')


def _leg(chain: Sequence[ET.Element], names: Sequence[str]) -> _Leg:
    """Gather the fixed parts of a chain: before each turning joint, and behind the last."""
    joints = []
    position, rotation = _ORIGIN, IDENTITY
    for joint in chain:
        origin = joint.find('origin')
        position = _sum(position, rotate(rotation, _vector(origin, 'xyz', '0 0 0')))
        rpy = _vector(origin, 'rpy', '0 0 0')
        if any(rpy):
            rotation = multiply(rotation, from_roll_pitch_yaw(*rpy))
        if joint.get('type') == 'revolute':
            x, y, z = _vector(joint.find('axis'), 'xyz', '1 0 0')
            length = math.hypot(x, y, z)
            axis = x / length, y / length, z / length
            joints.append(_Joint(position, rotation, axis, names.index(joint.get('name', ''))))
            position, rotation = _ORIGIN, IDENTITY
    return _Leg(tuple(joints), FootPose(position, rotation))


def _vector(element: ET.Element | None, key: str, default: str) -> Vector:
    text = default if element is None else element.get(key, default)
    x, y, z = (float(word) for word in text.split())
    return x, y, z


def _sphere_radius(root: ET.Element, link: str) -> float:
    sphere = root.find(f"link[@name='{link}']//sphere")
    return 0.0 if sphere is None else float(sphere.get('radius', '0'))
