# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Where the links of a robot are, of the positions of its joints."""

from __future__ import annotations

from collections.abc import Mapping

from urdf_reader import Joint, KinematicTree, multiply, rotate, Transform

from .state_publisher import joint_transform


def compose(parent: Transform, child: Transform) -> Transform:
    """Return the pose of what is in a frame that is in another one.

    Args:
        parent: Pose of the frame.
        child: Pose in that frame.
    """
    x, y, z = rotate(parent.rotation, child.translation)
    a, b, c = parent.translation
    return Transform((a + x, b + y, c + z), multiply(parent.rotation, child.rotation))


def joint_position(joint: Joint, positions: Mapping[str, float]) -> float:
    """Return the position of a joint in [rad] or [m], also of one that follows another; else 0.

    Args:
        joint: The joint.
        positions: In [rad] or [m] by name.
    """
    if joint.mimic is None:
        return positions.get(joint.name, 0.0)
    return joint.mimic.position(positions.get(joint.mimic.source, 0.0))


def link_pose(tree: KinematicTree, link: str, positions: Mapping[str, float]) -> Transform:
    """Return the pose of a link in the root link.

    Args:
        tree: The robot.
        link: Name of the link.
        positions: Of joints in [rad] or [m]; those that are missing stand at zero.

    Raises:
        DescriptionError: There is no such link.
    """
    pose = Transform()
    for joint in tree.chain(tree.root, link):
        pose = compose(pose, joint_transform(joint, joint_position(joint, positions)))
    return pose


def link_poses(tree: KinematicTree, positions: Mapping[str, float]) -> dict[str, Transform]:
    """Return the poses of all links in the root link.

    Args:
        tree: The robot.
        positions: Of joints in [rad] or [m]; those that are missing stand at zero.
    """
    poses = {tree.root: Transform()}
    waiting = list(tree.joints)
    while waiting:  # a joint may stand before the one that its parent hangs on
        later: list[Joint] = []
        for joint in waiting:
            if joint.parent in poses:
                place = joint_transform(joint, joint_position(joint, positions))
                poses[joint.child] = compose(poses[joint.parent], place)
            else:
                later.append(joint)
        waiting = later
    return poses


def link_paths(tree: KinematicTree, base: str) -> dict[str, str]:
    """Return a path of each link, below that of the link it hangs on; parents come first.

    Args:
        tree: The robot.
        base: Path above the root link.
    """
    paths = {tree.root: f'{base}/{tree.root}'}
    waiting = list(tree.joints)
    while waiting:  # a joint may stand before the one that its parent hangs on
        later: list[Joint] = []
        for joint in waiting:
            if joint.parent in paths:
                paths[joint.child] = f'{paths[joint.parent]}/{joint.child}'
            else:
                later.append(joint)
        waiting = later
    return paths


def links_beyond(tree: KinematicTree, joints: frozenset[str]) -> frozenset[str]:
    """Return the links that joints move.

    Args:
        tree: The robot.
        joints: Their names; those that follow one of them move along.
    """
    moved: set[str] = set()
    found = True
    while found:
        found = False
        for joint in tree.joints:
            own = joint.name in joints or (
                joint.mimic is not None and joint.mimic.source in joints
            )
            if joint.child not in moved and (own or joint.parent in moved):
                moved.add(joint.child)
                found = True
    return frozenset(moved)
