# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Forward kinematics of a tree: the poses of links for the positions of joints."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from .transforms import about, compose, multiply, Transform, Vector
from .urdf import Joint, JointKind, KinematicTree, MOVABLE, PointMass


def joint_transform(joint: Joint, position: float) -> Transform:
    """Return the pose of a joint's child link in its parent at a position in [rad] or [m]."""
    if joint.kind is JointKind.PRISMATIC:
        x, y, z = joint.axis
        return compose(joint.origin, Transform((x * position, y * position, z * position)))
    if joint.kind in MOVABLE:
        turned = multiply(joint.origin.rotation, about(joint.axis, position))
        return Transform(joint.origin.translation, turned)
    return joint.origin


def joint_position(
    joint: Joint, positions: Mapping[str, float], missing: float | None = None
) -> float | None:
    """Return the position of a joint in [rad] or [m]; None if it is unknown.

    A mimic joint takes its measured position, else the one computed from its source, as in
    robot_state_publisher. Joints without a position are at ``missing``.
    """
    if joint.name in positions or joint.mimic is None:
        return positions.get(joint.name, missing)
    source = positions.get(joint.mimic.source, missing)
    return None if source is None else joint.mimic.position(source)


def link_poses(
    tree: KinematicTree, positions: Mapping[str, float], base: str = ''
) -> dict[str, Transform]:
    """Return the poses of all links below a base link (default: root) in its frame.

    ``positions`` are in [rad] or [m]; missing joints are at zero.
    """
    poses = {base or tree.root: Transform()}
    for joint in parents_first(tree):
        if joint.parent in poses:
            place = joint_transform(joint, joint_position(joint, positions, 0.0) or 0.0)
            poses[joint.child] = compose(poses[joint.parent], place)
    return poses


def centre_of_mass(masses: Iterable[PointMass], poses: Mapping[str, Transform]) -> Vector | None:
    """Return the centre of mass in [m] for given link poses; None without masses.

    Masses of links without a pose are ignored.
    """
    total, x, y, z = 0.0, 0.0, 0.0, 0.0
    for part in masses:
        if part.link in poses:
            px, py, pz = compose(poses[part.link], Transform(part.centre)).translation
            total += part.mass
            x, y, z = x + part.mass * px, y + part.mass * py, z + part.mass * pz
    return (x / total, y / total, z / total) if total > 0.0 else None


def parents_first(tree: KinematicTree) -> Iterator[Joint]:
    """Yield the joints so that each follows the joint of its parent link."""
    known, waiting = {tree.root}, list(tree.joints)
    while waiting:
        later: list[Joint] = []
        for joint in waiting:
            if joint.parent in known:
                known.add(joint.child)
                yield joint
            else:
                later.append(joint)
        waiting = later
