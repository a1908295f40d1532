# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Reading a URDF's numbers, and forward kinematics straight from them."""

from __future__ import annotations

from collections.abc import Mapping
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[np.float64]


def numbers(element: ET.Element | None, key: str) -> list[float]:
    """Read three numbers of an attribute, zero when there are none."""
    text = element.get(key, '0 0 0') if element is not None else '0 0 0'
    return [float(word) for word in text.split()]


def transform(xyz: list[float], rpy: list[float]) -> Matrix:
    """Return the homogeneous matrix of a URDF origin (fixed axes, x then y then z)."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    matrix = np.eye(4)
    matrix[:3, 3] = xyz
    roll = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    pitch = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    yaw = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    matrix[:3, :3] = yaw @ pitch @ roll
    return matrix


def forward(root: ET.Element, angles: Mapping[str, float], tip: str) -> Matrix:
    """Return the pose of a link in the root link, for joints that turn about their z axes."""
    parents = {joint.find('child').get('link'): joint for joint in root.iter('joint')}  # type: ignore[union-attr]
    pose = np.eye(4)
    while (joint := parents.get(tip)) is not None:
        origin = joint.find('origin')
        here = transform(numbers(origin, 'xyz'), numbers(origin, 'rpy'))
        turn = transform([0, 0, 0], [0, 0, angles.get(joint.get('name', ''), 0.0)])
        pose = here @ turn @ pose
        tip = joint.find('parent').get('link')  # type: ignore[union-attr,assignment]
    return pose
