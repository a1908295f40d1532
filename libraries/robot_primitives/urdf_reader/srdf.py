# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Semantic description (SRDF): groups, named poses, end effectors, disabled collisions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from xml.etree import ElementTree as ET

from .exceptions import DescriptionError
from .urdf import Joint, JointKind, KinematicTree

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
        """Return a group; an unknown name raises a DescriptionError."""
        if name not in self.groups:
            known = ', '.join(self.groups) or 'none'
            raise DescriptionError(f'there is no group {name!r} in the SRDF; groups: {known}')
        return self.groups[name]


def parse_srdf(text: str) -> SemanticDescription:
    """Read an SRDF; any other text raises a DescriptionError."""
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
    keys = ('name', 'group', 'parent_link', 'parent_group')
    effectors = tuple(
        EndEffector(*(each.get(key, '') for key in keys)) for each in root.findall('end_effector')
    )
    return SemanticDescription(
        groups, poses, disabled, unchecked, enabled, effectors, passive, virtual, world_frames
    )


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
    """Return the positions of a pose, without multi-DOF joints, which no group has."""
    try:
        values = {
            joint.get('name', ''): [*map(float, joint.get('value', '').split() or [''])]
            for joint in state.findall('joint')
        }
        return {name: each[0] for name, each in values.items() if len(each) == 1}
    except ValueError as error:
        raise DescriptionError(f'pose {state.get("name")!r} of the SRDF: {error}') from error


@dataclass(frozen=True, slots=True)
class JointGroup:
    """A group of joints of a robot."""

    name: str  # its name
    joints: tuple[str, ...]  # joints that move by themselves, from the base out
    base: str  # its base link, which none of them moves
    tip: str  # its tip link


def find_group(
    tree: KinematicTree,
    semantic: SemanticDescription,
    name: str | None = None,
    tip: str | None = None,
) -> JointGroup:
    """Find a group of an SRDF in the description.

    It consists of chains, joints, links (each with the joint that moves it) and subgroups; its
    fixed, mimic and passive joints are not independent.

    Args:
        name: The group; by default the only one, or the only one that is no tool.
        tip: The tip link; by default the end of the last chain, or the link of the last joint.

    Raises:
        DescriptionError: The group is unknown, refers to something unknown, or has no movable
            joint, or a multi-DOF joint.
    """
    group = semantic.group(_only(semantic) if name is None else name)
    members = [*_with_subgroups(group, semantic, ())]
    found = [joint for member in members for joint in _joints(tree, semantic, member)]
    for joint in found:
        if joint.kind in {JointKind.PLANAR, JointKind.FLOATING}:
            raise DescriptionError(_several_directions(group.name, joint.name, joint.kind.value))
    moving = [each for each in found if each.independent and each.name not in semantic.passive]
    for joint in moving:
        _check_range(joint)
    names = sorted({joint.name for joint in moving}, key=lambda joint: _place(tree, joint))
    if not names:
        raise DescriptionError(f'group {group.name}: it has no joint that moves')
    base, end = _ends(tree, [chain for each in members for chain in each.chains], names, tip)
    return JointGroup(group.name, tuple(names), base, end)


def _only(semantic: SemanticDescription) -> str:
    arms = semantic.arms or tuple(semantic.groups)
    if len(arms) != 1:
        known = ', '.join(semantic.groups) or 'none'
        raise DescriptionError(f'the SRDF has the groups {known}: choose one (parameter group)')
    return arms[0]


def _with_subgroups(
    group: Group, semantic: SemanticDescription, above: tuple[str, ...]
) -> Iterator[Group]:
    """Yield a group, then the groups in it."""
    if group.name in above:
        raise DescriptionError(f'group {group.name} contains itself')
    yield group
    for name in group.subgroups:
        yield from _with_subgroups(semantic.group(name), semantic, (*above, group.name))


def _joints(tree: KinematicTree, semantic: SemanticDescription, group: Group) -> Iterator[Joint]:
    """Yield the joints that a group names itself, without its subgroups."""
    for base, tip in group.chains:
        yield from tree.chain(base, tip)
    by_name = {joint.name: joint for joint in tree.joints}
    for name in group.joints:
        if name in by_name:
            yield by_name[name]
        elif semantic.virtual.get(name, 'fixed') != 'fixed':
            raise DescriptionError(_several_directions(group.name, name, semantic.virtual[name]))
        elif name not in semantic.virtual:
            known = ', '.join(by_name)
            raise DescriptionError(
                f'group {group.name}: joint {name!r} is not in the description; joints: {known}'
            )
    above = {joint.child: joint for joint in tree.joints}
    for link in group.links:
        tree.chain(tree.root, link)  # or raises: there is no such link
        if link in above:
            yield above[link]


def _several_directions(group: str, joint: str, kind: str) -> str:
    return (
        f'group {group}: joint {joint!r} is {kind}, it moves in several directions; a group has'
        ' joints of one direction on a base that stands still: take it out of the group'
    )


def _check_range(joint: Joint) -> None:
    span = joint.range
    if not (span.lower < span.upper and span.velocity >= 0.0):  # 0: not given
        raise DescriptionError(
            f'joint {joint.name}: <limit> {span.lower:g}..{span.upper:g} at {span.velocity:g}'
            ' is empty'
        )


def _place(tree: KinematicTree, joint: str) -> tuple[int, int]:
    """Return the depth of a joint in the tree, and its index in the description."""
    number, found = next(
        (number, each) for number, each in enumerate(tree.joints) if each.name == joint
    )
    return len(tree.chain(tree.root, found.parent)), number


def _ends(
    tree: KinematicTree, chains: Sequence[tuple[str, str]], joints: Sequence[str], tip: str | None
) -> tuple[str, str]:
    """Return the base link and the tip link of a group."""
    by_name = {joint.name: joint for joint in tree.joints}
    end = tip or (chains[-1][1] if chains else by_name[joints[-1]].child)
    inward = {tree.root, *(joint.parent for joint in tree.chain(tree.root, end))}
    bases = [base for base, _ in chains] or [by_name[joints[0]].parent]
    base = next((link for link in bases if link in inward), bases[0])
    moving = [joint for joint in tree.chain(tree.root, base) if joint.name in joints]
    base = moving[0].parent if moving else base  # a lift below the chain of the arm
    tree.chain(base, end)  # or raises with the reason
    return base, end
