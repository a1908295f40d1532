# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Where the feet are in the body, for all legs at once, from the chains of the URDF."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import NDArray

from quad_description import LEGS

from ..exceptions import CommandError

Array = NDArray[np.float64]

BASE = 'base_link'
FEET = tuple(f'{leg}_foot' for leg in LEGS)
_EYE = np.eye(3)
_IDENTITIES: Array = np.stack([_EYE] * len(FEET))
_ORIGINS: Array = np.zeros((len(FEET), 3))


@dataclass(frozen=True, slots=True, eq=False)
class FootPoses:
    """Where the feet are in base_link, in URDF order.

    Attributes:
        position: Of their centres [m], (4, 3).
        rotation: From the foot to base_link, (4, 3, 3).
    """

    position: Array
    rotation: Array


@dataclass(frozen=True, slots=True, eq=False)
class _Stage:
    """One joint of each leg: a fixed part, then a turn about an axis of each."""

    rotation: Array  # (4, 3, 3)
    position: Array  # (4, 3)
    cross: Array  # (4, 3, 3) cross product with the axis
    cross_twice: Array  # (4, 3, 3)
    joints: NDArray[np.intp]  # where their angles stand (4, 1, 1)


class Feet:
    """Forward kinematics of the feet.

    Attributes:
        radius: Of the feet, below the point that is computed [m].
    """

    def __init__(self, urdf: str, joints: Sequence[str]) -> None:
        """Read the legs.

        Args:
            urdf: The robot.
            joints: Order of the positions that are given to :meth:`poses`.

        Raises:
            CommandError: A foot is missing, or the legs have chains of different lengths.
        """
        root = ET.fromstring(urdf)  # noqa: S314  # the robot's own description
        parents = {_link(j, 'child'): j for j in root.iter('joint')}
        chains = [_chain(parents, foot) for foot in FEET]
        self.radius = _sphere_radius(root, FEET[0])
        moving = [[j for j in chain if j.get('type') == 'revolute'] for chain in chains]
        if len({len(chain) for chain in moving}) != 1:
            raise CommandError('the legs of the URDF have different numbers of joints')
        splits = [_split(chain) for chain in chains]
        self._stages = [
            _stage([split[k] for split in splits], [chain[k] for chain in moving], joints)
            for k in range(len(moving[0]))
        ]
        self._tip_rotation, self._tip_position = _stack([split[-1] for split in splits])

    def poses(self, angles: Sequence[float] | Array) -> FootPoses:
        """Return where the feet are.

        Args:
            angles: Positions of the joints [rad].
        """
        values = np.asarray(angles, dtype=np.float64)
        rotation, position = _IDENTITIES, _ORIGINS
        sines, versines = np.sin(values), 1.0 - np.cos(values)
        for stage in self._stages:
            position = position + _apply(rotation, stage.position)
            sine, versine = sines[stage.joints], versines[stage.joints]
            # Rodrigues: I + sin K + (1 - cos) K²
            turn = _EYE + sine * stage.cross + versine * stage.cross_twice
            rotation = rotation @ stage.rotation @ turn
        tip = position + _apply(rotation, self._tip_position)
        return FootPoses(tip, rotation @ self._tip_rotation)


def _apply(rotation: Array, vector: Array) -> Array:
    result: Array = (rotation @ vector[:, :, None])[:, :, 0]
    return result


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


def _split(chain: Sequence[ET.Element]) -> list[tuple[Array, Array]]:
    """Return the fixed parts of a chain: before each moving joint, and behind the last."""
    parts = []
    rotation, position = np.eye(3), np.zeros(3)
    for joint in chain:
        origin = joint.find('origin')
        xyz = _numbers(origin, 'xyz', '0 0 0')
        position = position + rotation @ xyz
        rotation = rotation @ _rotation(_numbers(origin, 'rpy', '0 0 0'))
        if joint.get('type') == 'revolute':
            parts.append((rotation, position))
            rotation, position = np.eye(3), np.zeros(3)
    return [*parts, (rotation, position)]


def _stage(
    fixed: Sequence[tuple[Array, Array]], moving: Sequence[ET.Element], joints: Sequence[str]
) -> _Stage:
    rotation, position = _stack(fixed)
    axes = [_numbers(joint.find('axis'), 'xyz', '1 0 0') for joint in moving]
    cross = np.array([_cross(axis / np.linalg.norm(axis)) for axis in axes])
    indices = np.array([joints.index(j.get('name', '')) for j in moving], dtype=np.intp)
    return _Stage(rotation, position, cross, cross @ cross, indices[:, None, None])


def _stack(parts: Sequence[tuple[Array, Array]]) -> tuple[Array, Array]:
    return np.array([part[0] for part in parts]), np.array([part[1] for part in parts])


def _numbers(element: ET.Element | None, key: str, default: str) -> Array:
    text = default if element is None else element.get(key, default)
    return np.array([float(word) for word in text.split()])


def _cross(axis: Array) -> Array:
    x, y, z = axis
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def _rotation(rpy: Array) -> Array:
    (sr, cr), (sp, cp), (sy, cy) = ((math.sin(a), math.cos(a)) for a in rpy)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def _sphere_radius(root: ET.Element, link: str) -> float:
    sphere = root.find(f"link[@name='{link}']//sphere")
    return 0.0 if sphere is None else float(sphere.get('radius', '0'))
