# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Where the links of a robot are, of the positions of its joints."""

from __future__ import annotations

from collections.abc import Mapping

from urdf_reader import (
    compose,
    joint_position,
    joint_transform,
    KinematicTree,
    parents_first,
    Transform,
)


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


def link_paths(tree: KinematicTree, base: str) -> dict[str, str]:
    """Return a path of each link, below that of the link it hangs on; parents come first."""
    paths = {tree.root: f'{base}/{tree.root}'}
    for joint in parents_first(tree):
        paths[joint.child] = f'{paths[joint.parent]}/{joint.child}'
    return paths


def links_beyond(tree: KinematicTree, joints: frozenset[str]) -> frozenset[str]:
    """Return the links that joints move, and those that follow one of them."""
    beyond: set[str] = set()
    for joint in parents_first(tree):
        follows = joint.mimic is not None and joint.mimic.source in joints
        if joint.name in joints or follows or joint.parent in beyond:
            beyond.add(joint.child)
    return frozenset(beyond)
