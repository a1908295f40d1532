# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The joints that a URDF says a robot can move."""

from __future__ import annotations

from dataclasses import dataclass
import math
from typing import Final
from xml.etree import ElementTree as ET

from .exceptions import DescriptionError

LEGS: Final = ('fl', 'fr', 'bl', 'br')
"""Front left, front right, back left, back right: the order of the URDF."""

MOVABLE: Final = frozenset({'revolute', 'continuous', 'prismatic'})


@dataclass(frozen=True, slots=True)
class Joint:
    """A movable joint.

    Attributes:
        name: Its name.
        lower: Least position in [rad] or [m]; minus infinity for a continuous joint.
        upper: Greatest position in [rad] or [m]; infinity for a continuous joint.
        velocity: Greatest speed in [rad/s] or [m/s].
        effort: Greatest torque in [Nm] or force in [N].
    """

    name: str
    lower: float
    upper: float
    velocity: float
    effort: float


def movable_joints(urdf: str) -> tuple[Joint, ...]:
    """Read the joints that have a motor; those that mimic others are left out.

    Args:
        urdf: A URDF as XML text.

    Returns:
        The joints, in the order of the URDF.

    Raises:
        DescriptionError: The text is no URDF, or a movable joint lacks its limits.
    """
    try:
        root = ET.fromstring(urdf)  # noqa: S314  a robot's own description, not from the network
    except ET.ParseError as error:
        raise DescriptionError(f'the robot description is no XML: {error}') from error
    return tuple(
        _joint(element)
        for element in root.iter('joint')
        if element.get('type') in MOVABLE and element.find('mimic') is None
    )


def _joint(element: ET.Element) -> Joint:
    name = element.get('name', '')
    limit = element.find('limit')
    if limit is None:
        raise DescriptionError(f'joint {name}: a {element.get("type")} joint needs <limit .../>')
    try:
        velocity, effort = float(limit.attrib['velocity']), float(limit.attrib['effort'])
        if element.get('type') == 'continuous':
            return Joint(name, -math.inf, math.inf, velocity, effort)
        lower, upper = (float(limit.get(key, 0)) for key in ('lower', 'upper'))
        return Joint(name, lower, upper, velocity, effort)
    except (KeyError, ValueError) as error:
        raise DescriptionError(f'joint {name}: <limit> is not usable: {error}') from error
