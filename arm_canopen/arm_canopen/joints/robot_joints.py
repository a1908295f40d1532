# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The movable joints of a URDF, in its order."""

from __future__ import annotations

from dataclasses import dataclass
from xml.etree import ElementTree as ET

from ..exceptions import CanopenError

FIXED_TYPES = frozenset({'fixed', 'floating', 'planar'})
"""Joint types without exactly one variable (URDF specification, joint)."""


@dataclass(frozen=True, slots=True)
class Mimic:
    """A joint follows another: ``position = multiplier * joint + offset``."""

    joint: str
    multiplier: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True, slots=True)
class RobotJoint:
    """A joint with one variable.

    Attributes:
        name: Name in the URDF.
        mimic: What it follows, None when it moves by itself.
    """

    name: str
    mimic: Mimic | None = None


def movable_joints(robot_description: str) -> list[RobotJoint]:
    """Return the revolute, continuous and prismatic joints in the order of the URDF.

    Args:
        robot_description: URDF as XML text.

    Raises:
        CanopenError: It is no URDF, or has no movable joint.
    """
    try:
        # a robot description is the user's own file, and expat resolves no external entities
        robot = ET.fromstring(robot_description)  # noqa: S314
    except ET.ParseError as error:
        raise CanopenError(f'robot_description is not XML: {error}') from error
    if robot.tag != 'robot':
        raise CanopenError(f'robot_description is no URDF: its root is <{robot.tag}>, not <robot>')
    joints = [
        RobotJoint(element.get('name', ''), _mimic(element.find('mimic')))
        for element in robot.findall('joint')
        if element.get('type') not in FIXED_TYPES
    ]
    if not joints:
        raise CanopenError('robot_description has no revolute, continuous or prismatic joint')
    return joints


def _mimic(element: ET.Element | None) -> Mimic | None:
    if element is None:
        return None
    try:
        return Mimic(
            element.get('joint', ''),
            float(element.get('multiplier', '1')),
            float(element.get('offset', '0')),
        )
    except ValueError as error:
        raise CanopenError(f'robot_description: odd number in <mimic>: {error}') from error
