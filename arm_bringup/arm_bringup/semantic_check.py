# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The part of the check that compares an SRDF with the description: names and groups."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import urdf_reader
from urdf_reader import Group, KinematicTree, parse_srdf, SemanticDescription

from .description import read_semantic
from .exceptions import DescriptionError
from .findings import error, Finding, Severity, warning
from .robots import Robot


def srdf_command(robot: Robot) -> str:
    """Return the command that makes or completes the SRDF of a robot."""
    return f'ros2 run arm_planning srdf {robot.folder}/ --output {robot.semantic}'


def check_semantic(
    robot: Robot, tree: KinematicTree
) -> tuple[list[Finding], SemanticDescription | None]:
    """Compare the SRDF of a robot with its description.

    Returns:
        What is wrong, and the SRDF where no group mixes names of the description with others.
    """
    place = robot.semantic.name
    try:
        semantic = parse_srdf(read_semantic(robot))
    except (DescriptionError, urdf_reader.DescriptionError) as problem:
        return [error(place, str(problem), 'correct it: the arm has no group without')], None
    found = list(_groups(place, semantic, tree))
    if not semantic.groups:
        remedy = f'{srdf_command(robot)} adds groups from the chains of the description'
        found.append(error(place, 'it has no group', remedy))
    wrong = any(finding.severity is Severity.ERROR for finding in found)
    return found, None if wrong else semantic


def _groups(place: str, semantic: SemanticDescription, tree: KinematicTree) -> Iterable[Finding]:
    """Find names of groups that the description does not have."""
    joints = {joint.name for joint in tree.joints} | set(semantic.virtual)
    known = {'joint': sorted(joints), 'link': sorted(tree.links), 'group': list(semantic.groups)}
    named = {name: _named(group) for name, group in semantic.groups.items()}
    lost = {
        name: {kind: [each for each in names[kind] if each not in known[kind]] for kind in known}
        for name, names in named.items()
    }
    absent = [name for name in named if lost[name] == named[name]]
    if len(absent) == len(named):
        absent = []  # the SRDF is that of another robot
    for name in absent:
        yield warning(
            f'{place}, group {name}',
            'the description has no joint or link of it: it is left out',
            'fine where the robot comes without, such as a gripper that is not mounted',
        )
    for name, kinds in lost.items():
        for kind, names in kinds.items():
            if names and name not in absent:
                yield error(
                    f'{place}, group {name}',
                    f'there is no {kind} {", ".join(map(repr, names))}',
                    f'name links and joints as the description does; {kind}s: '
                    f'{", ".join(known[kind])}',
                )


def _named(group: Group) -> Mapping[str, Sequence[str]]:
    """Return what a group names, each once."""
    links = [link for chain in group.chains for link in chain] + list(group.links)
    return {
        'joint': [*group.joints],
        'link': [*dict.fromkeys(links)],
        'group': [*group.subgroups],
    }
