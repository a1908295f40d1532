# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Groups of an SRDF: which joints move, and where the group begins and ends."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from .exceptions import DescriptionError
from .srdf import Group, SemanticDescription
from .urdf import Joint, JointKind, KinematicTree


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

    Chains, joints, links (each with the joint that moves it) and subgroups make it; fixed, mimic
    and passive joints in it do not move by themselves.

    Args:
        name: The group; by default the only one, or the only one that is no tool.
        tip: The tip link; by default the end of the last chain, or the link of the last joint.

    Raises:
        DescriptionError: There is no such group, it names what does not exist, it has no joint
            that moves, or one that moves in several directions.
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
    """Go through a group and the groups in it, the inner ones last."""
    if group.name in above:
        raise DescriptionError(f'group {group.name} contains itself')
    yield group
    for name in group.subgroups:
        yield from _with_subgroups(semantic.group(name), semantic, (*above, group.name))


def _joints(tree: KinematicTree, semantic: SemanticDescription, group: Group) -> Iterator[Joint]:
    """Go through the joints that a group names itself, without its subgroups."""
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
    """Return how many joints a joint hangs on, and its place in the description."""
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
