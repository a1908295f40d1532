# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Poses of all links for given joint positions, by walking the tree; for set-up, not for loops."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from ..exceptions import DescriptionError
from .urdf import Description, Joint, JointKind

Matrix = npt.NDArray[np.float64]


def link_poses(
    description: Description, positions: Mapping[str, float], base: str
) -> dict[str, Matrix]:
    """Return the pose of every link below a base link, as 4x4 matrices in the base's frame.

    Args:
        description: The robot.
        positions: Joint positions by name in [rad] or [m]; joints that are left out are at zero.
        base: Link whose frame is the reference.
    """
    poses: dict[str, Matrix] = {base: np.eye(4)}
    # joints may stand in any order in the file: pass until nothing new is reached
    waiting = list(description.joints)
    while ready := [joint for joint in waiting if joint.parent in poses]:
        for joint in ready:
            moved = _joint_motion(joint, positions.get(joint.name, 0.0))
            poses[joint.child] = poses[joint.parent] @ _origin(joint) @ moved
        waiting = [joint for joint in waiting if joint.child not in poses]
    return poses


def centre_of_mass(description: Description, positions: Mapping[str, float], base: str) -> Matrix:
    """Return the centre of mass in the base's frame in [m].

    Raises:
        DescriptionError: No link has a mass.
    """
    poses = link_poses(description, positions, base)
    total, moment = 0.0, np.zeros(3)
    for link, point in description.masses.items():
        if link in poses:
            total += point.mass
            moment += point.mass * (poses[link] @ [*point.centre, 1.0])[:3]
    if total <= 0.0:
        raise DescriptionError('the robot description has no masses (inertial/mass)')
    return np.asarray(moment / total)


def _origin(joint: Joint) -> Matrix:
    pose = np.eye(4)
    for axis, angle in zip(np.eye(3)[::-1], joint.rpy[::-1], strict=True):
        pose[:3, :3] = pose[:3, :3] @ axis_rotation(axis, angle)
    pose[:3, 3] = joint.position
    return pose


def _joint_motion(joint: Joint, position: float) -> Matrix:
    pose = np.eye(4)
    if joint.kind is JointKind.PRISMATIC:
        pose[:3, 3] = np.multiply(joint.axis, position)
    elif joint.kind in {JointKind.REVOLUTE, JointKind.CONTINUOUS}:
        pose[:3, :3] = axis_rotation(np.asarray(joint.axis), position)
    return pose


def axis_rotation(axis: Matrix, angle: float) -> Matrix:
    """Return the rotation matrix about a unit vector (Rodrigues' formula)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross)
