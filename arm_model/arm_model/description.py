# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A robot description as an arm needs it: ranges of joints, groups, shapes that can be checked."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from urdf_reader import DescriptionError, Group, Joint, read_urdf, SemanticDescription

from .scene.link_shapes import link_shapes


class Description:
    """What a URDF says of an arm.

    Attributes:
        name: Name of the robot.
        tree: Its links and joints.
        joints: Its joints by name.
        ranges: Range and speed of each joint that moves by itself.
        shapes: Collision shapes of the links.
        notes: What was passed over, in words.
    """

    def __init__(self, urdf: str, folder: Path | None = None) -> None:
        """Read.

        Args:
            urdf: The URDF as XML text.
            folder: Its folder, where names of mesh files are relative.

        Raises:
            DescriptionError: It is no URDF, or a joint that moves lacks its limits.
        """
        self.tree = read_urdf(urdf)
        self.name = self.tree.name
        self.joints: Mapping[str, Joint] = {joint.name: joint for joint in self.tree.joints}
        self.ranges = self.tree.ranges()
        for each in self.ranges.values():
            if not (each.lower < each.upper and each.velocity >= 0.0):  # 0: nobody gives it
                raise DescriptionError(
                    f'joint {each.name}: <limit> {each.lower:g}..{each.upper:g} at'
                    f' {each.velocity:g} is empty'
                )
        shapes = link_shapes(self.tree, folder)
        self.shapes, self.notes = shapes.by_link, tuple(shapes.notes)

    def group_joints(self, group: Group, semantic: SemanticDescription) -> list[str]:
        """Return the joints of a group that move by themselves, from the base out.

        Args:
            group: The group.
            semantic: Where its subgroups are.

        Raises:
            DescriptionError: It names a joint, a link or a group that does not exist, or has no
                joint.
        """
        names = [
            name
            for sub in group.subgroups
            for name in self.group_joints(semantic.group(sub), semantic)
        ]
        for base, tip in group.chains:
            names += [joint.name for joint in self.tree.chain(base, tip) if joint.independent]
        for name in group.joints:
            if name not in self.joints:
                raise DescriptionError(
                    f'group {group.name}: joint {name!r} is not in the description'
                )
            names += [name] if self.joints[name].independent else []
        moved = {joint.child: joint for joint in self.tree.joints}
        for link in group.links:
            names += [moved[link].name] if link in moved and moved[link].independent else []
        names = [name for name in names if name not in semantic.passive]
        if not names:
            raise DescriptionError(f'group {group.name}: it has no joint that moves')
        return sorted(dict.fromkeys(names), key=self._depth)

    def _depth(self, joint: str) -> int:
        """Return how many joints a joint hangs on."""
        return len(self.tree.chain(self.tree.root, self.joints[joint].parent))
