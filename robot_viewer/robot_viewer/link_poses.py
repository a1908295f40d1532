# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Where the links of a robot are, of the positions of its joints."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from urdf_reader import (
    about,
    Joint,
    JointKind,
    KinematicTree,
    MOVABLE,
    multiply,
    rotate,
    Transform,
)


def compose(parent: Transform, child: Transform) -> Transform:
    """Return the pose of what is in a frame that is in another one."""
    x, y, z = rotate(parent.rotation, child.translation)
    a, b, c = parent.translation
    return Transform((a + x, b + y, c + z), multiply(parent.rotation, child.rotation))


def joint_transform(joint: Joint, position: float) -> Transform:
    """Return the pose of a joint's child link in its parent link.

    Args:
        joint: A fixed or movable joint.
        position: Its position in [rad] or [m]; without meaning for a fixed one.
    """
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
    """Return the position of a joint in [rad] or [m]; None where nothing says it.

    One that follows another is where it was measured, else where its source puts it, as
    robot_state_publisher has it.

    Args:
        joint: The joint.
        positions: In [rad] or [m] by name.
        missing: Position of joints without one, which others may follow.
    """
    if joint.name in positions or joint.mimic is None:
        return positions.get(joint.name, missing)
    source = positions.get(joint.mimic.source, missing)
    return None if source is None else joint.mimic.position(source)


def moved(
    tree: KinematicTree, positions: Mapping[str, float], goals: Mapping[str, float]
) -> dict[str, float]:
    """Return positions with some joints at goals; what follows those is left out, to follow.

    Args:
        tree: The robot.
        positions: Measured, in [rad] or [m] by name.
        goals: In [rad] or [m] by name.
    """
    followers = {j.name for j in tree.movable() if j.mimic and j.mimic.source in goals}
    return {name: at for name, at in positions.items() if name not in followers} | dict(goals)


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
        pose = compose(pose, joint_transform(joint, joint_position(joint, positions, 0.0) or 0.0))
    return pose


def link_poses(tree: KinematicTree, positions: Mapping[str, float]) -> dict[str, Transform]:
    """Return the poses of all links in the root link.

    Args:
        tree: The robot.
        positions: Of joints in [rad] or [m]; those that are missing stand at zero.
    """
    poses = {tree.root: Transform()}
    for joint in _parents_first(tree):
        place = joint_transform(joint, joint_position(joint, positions, 0.0) or 0.0)
        poses[joint.child] = compose(poses[joint.parent], place)
    return poses


def link_paths(tree: KinematicTree, base: str) -> dict[str, str]:
    """Return a path of each link, below that of the link it hangs on; parents come first."""
    paths = {tree.root: f'{base}/{tree.root}'}
    for joint in _parents_first(tree):
        paths[joint.child] = f'{paths[joint.parent]}/{joint.child}'
    return paths


def links_beyond(tree: KinematicTree, joints: frozenset[str]) -> frozenset[str]:
    """Return the links that joints move, and those that follow one of them."""
    beyond: set[str] = set()
    for joint in _parents_first(tree):
        follows = joint.mimic is not None and joint.mimic.source in joints
        if joint.name in joints or follows or joint.parent in beyond:
            beyond.add(joint.child)
    return frozenset(beyond)


def _parents_first(tree: KinematicTree) -> Iterator[Joint]:
    """Yield each joint behind the one that its parent hangs on, in whatever order they stand."""
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
