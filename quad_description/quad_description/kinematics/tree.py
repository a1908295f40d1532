# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Poses of all links for given joint positions, by walking the tree; for set-up, not for loops."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from ..exceptions import DescriptionError
from ..rotations import about, IDENTITY, multiply, Quaternion, rotate, Vector
from ..urdf import Description, Joint, JointKind

BASE = 'base_link'
"""Link of the body."""


class Pose3(NamedTuple):
    """Where a link is."""

    position: Vector  # of its origin in the reference in [m]
    rotation: Quaternion  # from its frame to the reference

    def point(self, point: Vector) -> Vector:
        """Return in the reference a point of the link in [m]."""
        return _sum(self.position, rotate(self.rotation, point))


def link_poses(
    description: Description, positions: Mapping[str, float], base: str = BASE
) -> dict[str, Pose3]:
    """Return the pose of every link below a base link, in the base's frame.

    Args:
        positions: Joint positions by name in [rad] or [m]; joints that are left out are at zero.
    """
    poses = {base: Pose3((0.0, 0.0, 0.0), IDENTITY)}
    # joints may stand in any order in the file: pass until nothing new is reached
    waiting = list(description.joints)
    while ready := [joint for joint in waiting if joint.parent in poses]:
        for joint in ready:
            poses[joint.child] = _child(poses[joint.parent], joint, positions.get(joint.name, 0.0))
        waiting = [joint for joint in waiting if joint.child not in poses]
    return poses


def centre_of_mass(
    description: Description, positions: Mapping[str, float], base: str = BASE
) -> Vector:
    """Return the centre of mass in the base's frame in [m].

    Raises:
        DescriptionError: No link has a mass.
    """
    poses = link_poses(description, positions, base)
    total, moment = 0.0, (0.0, 0.0, 0.0)
    for link, part in description.masses.items():
        if link in poses:
            x, y, z = poses[link].point(part.centre)
            total += part.mass
            moment = _sum(moment, (part.mass * x, part.mass * y, part.mass * z))
    if total <= 0.0:
        raise DescriptionError('the robot description has no masses (inertial/mass)')
    return moment[0] / total, moment[1] / total, moment[2] / total


def _child(parent: Pose3, joint: Joint, position: float) -> Pose3:
    origin = Pose3(parent.point(joint.position), multiply(parent.rotation, joint.rotation))
    x, y, z = joint.axis
    if joint.kind is JointKind.PRISMATIC:
        return Pose3(origin.point((position * x, position * y, position * z)), origin.rotation)
    if joint.kind in {JointKind.REVOLUTE, JointKind.CONTINUOUS}:
        return Pose3(origin.position, multiply(origin.rotation, about(joint.axis, position)))
    return origin


def _sum(one: Vector, other: Vector) -> Vector:
    return one[0] + other[0], one[1] + other[1], one[2] + other[2]
