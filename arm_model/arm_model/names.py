# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Names of an arm's joints and frames, from its URDF and SRDF; without building its kinematics."""

from __future__ import annotations

from dataclasses import dataclass

from urdf_reader import find_group, KinematicTree, parse_srdf, read_urdf

from .exceptions import description_refused


@dataclass(frozen=True, slots=True)
class ArmNames:
    """What an arm's parts are called; empty for what is not known."""

    joints: tuple[str, ...] = ()  # the joints, from the base to the tool
    base: str = ''  # the base link
    tool: str = ''  # the tool link


@description_refused()
def names_of(urdf: str, srdf: str = '', group: str = '', tip: str = '') -> ArmNames:
    """Find the names of an arm.

    Args:
        srdf: Semantic description as XML text; without it, the arm is the longest chain.
        tip: The tool link; by default the end of the chain.

    Raises:
        ModelError: A text cannot be read, or there is no such group or chain.
    """
    tree = read_urdf(urdf)
    semantic = parse_srdf(srdf) if srdf else None
    if semantic is not None and semantic.groups:
        first = next(iter(semantic.arms), next(iter(semantic.groups)))
        found = find_group(tree, semantic, group or first, tip or None)
        return ArmNames(found.joints, found.base, found.tip)
    links = [tree.root, *(joint.child for joint in tree.joints)]
    end = tip or max(links, key=lambda link: len(_moving(tree, link)))
    return ArmNames(tuple(_moving(tree, end)), tree.root, end)


def _moving(tree: KinematicTree, end: str) -> list[str]:
    return [joint.name for joint in tree.chain(tree.root, end) if joint.independent]
