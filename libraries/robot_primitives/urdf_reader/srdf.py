# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Semantic description (SRDF): groups, named poses, end effectors, pairs that are not checked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from xml.etree import ElementTree as ET

from .exceptions import DescriptionError

Pair = frozenset[str]  # two links, in no order


@dataclass(frozen=True, slots=True)
class Group:
    """A group of joints."""

    name: str  # its name
    chains: tuple[tuple[str, str], ...]  # base and tip link of each chain in it
    joints: tuple[str, ...]  # joints that it lists one by one
    subgroups: tuple[str, ...]  # groups that it contains
    # links that it lists one by one; each stands for the joint that moves it
    links: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class EndEffector:
    """A tool at the end of an arm."""

    name: str  # its name
    group: str  # group of its joints and links
    parent_link: str  # link of the arm to which it is fixed
    parent_group: str = ''  # group of that arm, if it is named


@dataclass(frozen=True, slots=True)
class SemanticDescription:
    """Contents of an SRDF."""

    groups: Mapping[str, Group]  # groups by name
    # positions in [rad] or [m] by joint, by pose, by group
    poses: Mapping[str, Mapping[str, Mapping[str, float]]]
    disabled: frozenset[Pair]  # pairs of links that need no collision check
    # links that need none with any other (``disable_default_collisions``)
    unchecked: frozenset[str] = frozenset()
    # pairs of them that are checked nevertheless (``enable_collisions``)
    enabled: frozenset[Pair] = frozenset()
    end_effectors: tuple[EndEffector, ...] = ()  # tools at the ends of arms
    passive: frozenset[str] = frozenset()  # joints without an actuator (``passive_joint``)
    # types of the joints between the world and the robot (``virtual_joint``), by name: fixed,
    # planar or floating. They are not in the URDF
    virtual: Mapping[str, str] = field(default_factory=dict)
    # frames of the world (``parent_frame``) to which fixed ones of them hold the robot
    world_frames: tuple[str, ...] = ()

    @property
    def tools(self) -> tuple[str, ...]:
        """Names of the groups of end effectors that have a group of their own."""
        named = {each.group for each in self.end_effectors}
        arms = {each.parent_group for each in self.end_effectors}
        return tuple(name for name in self.groups if name in named - arms)

    @property
    def arms(self) -> tuple[str, ...]:
        """Names of the groups that are neither end effectors nor made of other groups."""
        tools = self.tools
        return tuple(
            name
            for name, group in self.groups.items()
            if name not in tools and not group.subgroups
        )

    def group(self, name: str) -> Group:
        """Return a group.

        Raises:
            DescriptionError: There is none of this name; lists those that there are.
        """
        if name not in self.groups:
            known = ', '.join(self.groups) or 'none'
            raise DescriptionError(f'there is no group {name!r} in the SRDF; groups: {known}')
        return self.groups[name]


def parse_srdf(text: str) -> SemanticDescription:
    """Read an SRDF.

    Raises:
        DescriptionError: The text is no SRDF.
    """
    try:
        root = ET.fromstring(text)  # noqa: S314  a robot's own description, not from the network
    except ET.ParseError as error:
        raise DescriptionError(f'the SRDF is no XML: {error}') from error
    groups = {group.name: group for group in map(_group, root.findall('group'))}
    poses: dict[str, dict[str, Mapping[str, float]]] = {name: {} for name in groups}
    for state in root.findall('group_state'):
        poses.setdefault(state.get('group', ''), {})[state.get('name', '')] = _pose(state)
    unchecked = frozenset(
        each.get('link', '') for each in root.findall('disable_default_collisions')
    )
    disabled, enabled = _pairs(root, 'disable_collisions'), _pairs(root, 'enable_collisions')
    passive = frozenset(each.get('name', '') for each in root.iter('passive_joint'))
    virtual = {
        each.get('name', ''): each.get('type', '') for each in root.findall('virtual_joint')
    }
    fixed = (each for each in root.findall('virtual_joint') if each.get('type') == 'fixed')
    world_frames = tuple(filter(None, (each.get('parent_frame') for each in fixed)))
    effectors = tuple(map(_end_effector, root.findall('end_effector')))
    return SemanticDescription(
        groups, poses, disabled, unchecked, enabled, effectors, passive, virtual, world_frames
    )


def _end_effector(element: ET.Element) -> EndEffector:
    keys = ('name', 'group', 'parent_link', 'parent_group')
    return EndEffector(*(element.get(key, '') for key in keys))


def _pairs(root: ET.Element, tag: str) -> frozenset[Pair]:
    return frozenset(
        frozenset((each.get('link1', ''), each.get('link2', ''))) for each in root.findall(tag)
    )


def _group(element: ET.Element) -> Group:
    return Group(
        element.get('name', ''),
        tuple(
            (chain.get('base_link', ''), chain.get('tip_link', ''))
            for chain in element.findall('chain')
        ),
        tuple(joint.get('name', '') for joint in element.findall('joint')),
        tuple(group.get('name', '') for group in element.findall('group')),
        tuple(link.get('name', '') for link in element.findall('link')),
    )


def _pose(state: ET.Element) -> Mapping[str, float]:
    """Return the positions of a pose, without joints of several directions: no group has these."""
    try:
        values = {
            joint.get('name', ''): [*map(float, joint.get('value', '').split() or [''])]
            for joint in state.findall('joint')
        }
        return {name: each[0] for name, each in values.items() if len(each) == 1}
    except ValueError as error:
        raise DescriptionError(f'pose {state.get("name")!r} of the SRDF: {error}') from error
