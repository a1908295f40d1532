# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Names of an arm's joints and frames, from its URDF and SRDF; without building its kinematics."""

from __future__ import annotations

from dataclasses import dataclass

from urdf_reader import KinematicTree, parse_srdf, read_urdf

from .exceptions import description_refused


@dataclass(frozen=True, slots=True)
class ArmNames:
    """What an arm's parts are called; empty for what is not known.

    Attributes:
        joints: The joints, from the base to the tool.
        base: The base link.
        tool: The tool link.
    """

    joints: tuple[str, ...] = ()
    base: str = ''
    tool: str = ''


@description_refused()
def names_of(urdf: str, srdf: str = '', group: str = '', tip: str = '') -> ArmNames:
    """Find the names of an arm.

    Args:
        urdf: Robot description as XML text.
        srdf: Semantic description as XML text; without it, the arm is the longest chain.
        group: Group of the SRDF; by default its first one with a chain.
        tip: The tool link; by default the end of the chain.

    Raises:
        ModelError: A text cannot be read, or there is no such group or chain.
    """
    tree = read_urdf(urdf)
    base, end = _ends(srdf, group) if srdf else ('', '')
    base, end = base or tree.root, tip or end
    if not end:
        links = [tree.root, *(joint.child for joint in tree.joints)]
        end = max(links, key=lambda link: len(_moving(tree, tree.root, link)))
    return ArmNames(tuple(_moving(tree, base, end)), base, end)


def _ends(srdf: str, group: str) -> tuple[str, str]:
    semantic = parse_srdf(srdf)
    groups = [semantic.group(group)] if group else list(semantic.groups.values())
    chains = [chain for each in groups for chain in each.chains]
    return chains[0] if chains else ('', '')


def _moving(tree: KinematicTree, base: str, end: str) -> list[str]:
    return [joint.name for joint in tree.chain(base, end) if joint.independent]
