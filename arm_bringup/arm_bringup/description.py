# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""From a xacro file to a URDF, and from a URDF to the limits of its joints."""

from __future__ import annotations

from collections.abc import Mapping
import contextlib
from dataclasses import dataclass
import io
import math
from pathlib import Path
from xml.etree import ElementTree as ET

from .exceptions import DescriptionError

MOVABLE = frozenset({'revolute', 'continuous', 'prismatic'})
"""URDF joint types with one degree of freedom."""


@dataclass(frozen=True, slots=True)
class JointLimits:
    """What a URDF says of a movable joint.

    Attributes:
        name: Its name.
        lower: Least position in [rad] or [m]; minus infinity for a continuous joint.
        upper: Greatest position in [rad] or [m]; infinity for a continuous joint.
        velocity: Greatest speed in [rad/s] or [m/s].
    """

    name: str
    lower: float
    upper: float
    velocity: float


def expand_xacro(path: Path, arguments: Mapping[str, str] | None = None) -> str:
    """Expand a xacro file to a URDF.

    Args:
        path: The xacro file.
        arguments: Values for its xacro arguments.

    Returns:
        The URDF as XML text.

    Raises:
        DescriptionError: The file cannot be expanded; the message is xacro's own.
    """
    import xacro

    complaints = io.StringIO()  # xacro tells on stderr where in the file it was
    try:
        with contextlib.redirect_stderr(complaints):
            document = xacro.process_file(str(path), mappings=dict(arguments or {}))
    except Exception as error:  # an expression in the file may raise anything
        place = ' '.join(complaints.getvalue().split())
        text = f'{path}: {type(error).__name__}: {error} {place}'
        raise DescriptionError(text.strip()) from error
    return str(document.toprettyxml(indent='  '))


def joint_limits(urdf: str) -> dict[str, JointLimits]:
    """Read the limits of all movable joints.

    Args:
        urdf: A URDF as XML text.

    Returns:
        The limits by the joint's name, in the order of the URDF; joints that mimic others are left
        out.

    Raises:
        DescriptionError: The text is no URDF, or a movable joint lacks its limits.
    """
    try:
        root = ET.fromstring(urdf)  # noqa: S314  a robot's own description, not from the network
    except ET.ParseError as error:
        raise DescriptionError(f'the robot description is no XML: {error}') from error
    limits = (
        _limits(joint)
        for joint in root.iter('joint')
        if joint.get('type') in MOVABLE and joint.find('mimic') is None
    )
    return {each.name: each for each in limits}


def _limits(joint: ET.Element) -> JointLimits:
    name = joint.get('name', '')
    limit = joint.find('limit')
    if limit is None:
        raise DescriptionError(f'joint {name}: a {joint.get("type")} joint needs <limit .../>')
    try:
        velocity = float(limit.attrib['velocity'])
        if joint.get('type') == 'continuous':
            return JointLimits(name, -math.inf, math.inf, velocity)
        lower, upper = (float(limit.get(key, 0)) for key in ('lower', 'upper'))
        return JointLimits(name, lower, upper, velocity)
    except (KeyError, ValueError) as error:
        raise DescriptionError(f'joint {name}: <limit> is not usable: {error}') from error
