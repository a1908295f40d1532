# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Forward kinematics, masses and inertias straight from a URDF, independent of the product."""

from __future__ import annotations

from collections.abc import Mapping
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def parse(urdf: str) -> ET.Element:
    """Parse a URDF."""
    return ET.fromstring(urdf)  # noqa: S314


def triple(element: ET.Element | None, key: str) -> Array:
    """Read three numbers of an attribute, zero when there are none."""
    text = element.get(key, '0 0 0') if element is not None else '0 0 0'
    return np.array([float(word) for word in text.split()])


def rotation(axis: Array, angle: float) -> Array:
    """Rodrigues' formula."""
    x, y, z = axis
    skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    turn: Array = np.eye(3) + np.sin(angle) * skew + (1 - np.cos(angle)) * skew @ skew
    return turn


def fixed_axes(rpy: Array) -> Array:
    """Roll about x, then pitch about y, then yaw about z, all of them fixed."""
    x, y, z = np.eye(3)
    return rotation(z, rpy[2]) @ rotation(y, rpy[1]) @ rotation(x, rpy[0])


def link_pose(root: ET.Element, link: str, at: Mapping[str, float]) -> tuple[Array, Array]:
    """Return a link's position and rotation in the root link."""
    position, turn = np.zeros(3), np.eye(3)
    parents = {joint.find('child').get('link'): joint for joint in root.iter('joint')}  # type: ignore[union-attr]
    while (joint := parents.get(link)) is not None:
        origin = joint.find('origin')
        here = fixed_axes(triple(origin, 'rpy'))
        value = at.get(joint.get('name', ''), 0.0)
        axis = triple(joint.find('axis'), 'xyz')
        shift = triple(origin, 'xyz')
        if joint.get('type') == 'revolute':
            here = here @ rotation(axis, value)
        elif joint.get('type') == 'prismatic':
            shift += here @ axis * value
        position = shift + here @ position
        turn = here @ turn
        link = joint.find('parent').get('link')  # type: ignore[union-attr,assignment]
    return position, turn


def mass(link: ET.Element) -> float:
    """Return a link's mass in [kg]."""
    element = link.find('inertial/mass')
    return 0.0 if element is None else float(element.attrib['value'])


def inertia(link: ET.Element) -> Array:
    """Return a link's inertia about its centre of mass in [kg m2], in its inertial frame."""
    values = link.find('inertial/inertia')
    assert values is not None
    i = {key: float(value) for key, value in values.attrib.items()}
    return np.array(
        [
            [i['ixx'], i['ixy'], i['ixz']],
            [i['ixy'], i['iyy'], i['iyz']],
            [i['ixz'], i['iyz'], i['izz']],
        ]
    )


def centre_of_mass(root: ET.Element, at: Mapping[str, float]) -> Array:
    """Return the whole robot's centre of mass in the root link."""
    total, moment = 0.0, np.zeros(3)
    for link in root.iter('link'):
        if m := mass(link):
            position, turn = link_pose(root, link.get('name', ''), at)
            moment += m * (position + turn @ triple(link.find('inertial/origin'), 'xyz'))
            total += m
    return moment / total
