# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The part of the check that compares an SRDF with the description: names and groups."""

from __future__ import annotations

from collections.abc import Iterable

import urdf_reader
from urdf_reader import Group, KinematicTree, parse_srdf, SemanticDescription

from .description import read_semantic
from .exceptions import DescriptionError
from .findings import error, Finding
from .robots import Robot


def srdf_command(robot: Robot) -> str:
    """Return the command that makes or completes the SRDF of a robot."""
    return f'ros2 run arm_planning srdf {robot.folder}/ --output {robot.semantic}'


def check_semantic(
    robot: Robot, tree: KinematicTree
) -> tuple[list[Finding], SemanticDescription | None]:
    """Compare the SRDF of a robot with its description.

    Returns:
        What is wrong, and the SRDF where all names in its groups are those of the description.
    """
    place = robot.semantic.name
    try:
        semantic = parse_srdf(read_semantic(robot))
    except (DescriptionError, urdf_reader.DescriptionError) as problem:
        return [error(place, str(problem), 'correct it: the arm has no group without')], None
    wrong = [
        finding
        for group in semantic.groups.values()
        for finding in _group(place, group, semantic, tree)
    ]
    if not semantic.groups:
        remedy = f'{srdf_command(robot)} adds groups from the chains of the description'
        wrong.append(error(place, 'it has no group', remedy))
    return wrong, None if wrong else semantic


def _group(
    place: str, group: Group, semantic: SemanticDescription, tree: KinematicTree
) -> Iterable[Finding]:
    """Find names of a group that the description does not have."""
    joints = {joint.name for joint in tree.joints}
    links = [link for chain in group.chains for link in chain] + list(group.links)
    lost = {
        'joint': [name for name in group.joints if name not in {*joints, *semantic.virtual}],
        'link': [name for name in dict.fromkeys(links) if name not in tree.links],
        'group': [name for name in group.subgroups if name not in semantic.groups],
    }
    known = {'joint': sorted(joints), 'link': sorted(tree.links), 'group': list(semantic.groups)}
    for kind, names in lost.items():
        if names:
            yield error(
                f'{place}, group {group.name}',
                f'there is no {kind} {", ".join(map(repr, names))}',
                f'name links and joints as the description does; {kind}s: '
                f'{", ".join(known[kind])}',
            )
