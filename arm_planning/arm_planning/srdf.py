# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Makes the SRDF of a robot from its URDF, as MoveIt's setup assistant does.

Groups come from the chains of the URDF, end effectors from the branches at their ends, disabled
link pairs from sampling, and ``ready`` from a search for a pose without contact or singularity.
An existing SRDF is kept, except for its pairs of links; of those, only pairs whose
reason begins with ``User`` are kept.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from importlib import import_module
import math
from pathlib import Path
import re
import sys
from typing import Any
from xml.etree import ElementTree as ET

from urdf_reader import DescriptionError, Joint, KinematicTree, Pair, parse_srdf, read_urdf

from arm_model import (
    LinkPairs,
    ModelError,
    pose_quality,
    RobotModel,
    sample_link_pairs,
    start_pose,
)

SAMPLES = 20_000  # poses that are drawn
MARGIN = 0.005  # distance in [m] that links keep which count as never in contact
MIN_ARM_JOINTS = 3
"""Least number of joints of an arm; a branch with fewer joints is a tool."""
MISS = 1e-4  # probability with which the share that the report names would have been missed
READY = 'ready'
USER = 'User'  # how the reason of a pair begins that a person decided on
PAIR_LINE = re.compile(r'^[ \t]*<disable_collisions\b[^>]*/>[ \t]*\n', re.MULTILINE)
END = re.compile(r'\s*</robot>\s*\Z')


@dataclass(frozen=True, slots=True)
class SrdfDraft:
    """An SRDF, and a report on it."""

    text: str  # the SRDF as XML text
    report: Sequence[str]  # what was found, line by line


@dataclass(frozen=True, slots=True)
class _Chain:
    """An arm of a description, and the tool at its end."""

    name: str  # name of its group
    base: str  # its base link
    tip: str  # its tip link
    tool: Sequence[str]  # links of the tool that move against the tip


def make_srdf(
    urdf: str,
    previous: str = '',
    limits: Mapping[str, Any] | None = None,
    samples: int = SAMPLES,
    folder: Path | None = None,
) -> SrdfDraft:
    """Make an SRDF, or refresh one.

    Args:
        previous: The existing SRDF; empty if there is none.
        limits: The table ``joint_limits`` of a limits file; missing entries come from the URDF.

    Raises:
        ModelError: The description or the SRDF cannot be used, or there is no good pose.
    """
    try:
        tree = read_urdf(urdf)
        before = parse_srdf(previous) if previous else None
    except DescriptionError as error:
        raise ModelError(str(error)) from error
    pairs = sample_link_pairs(urdf, samples, folder)
    chosen = _by_user(previous)
    reasons = _reasons(pairs) | chosen
    opening = previous or f'<?xml version="1.0"?>\n<robot name={_quoted(tree.name)}>\n'
    head = END.sub('', PAIR_LINE.sub('', opening))
    if before is None or not before.groups:
        head = '\n'.join([head.rstrip(), '', *_groups(tree)])
    table: dict[str, Any] = {each: {} for each in tree.ranges()}  # what a limits file may lack
    table |= limits or {}
    draft = _closed(head, reasons)
    poses, notes = _ready_poses(urdf, draft, table, folder)
    report = [
        *pairs.notes,
        *_pair_report(pairs, chosen),
        *_changes(before.disabled if before else frozenset(), reasons, pairs),
        *notes,
    ]
    return SrdfDraft(_closed(head + poses, reasons), report)


def _closed(head: str, reasons: Mapping[Pair, str]) -> str:
    """Return the whole text, pairs last and in a fixed order."""
    lines = [
        f'  <disable_collisions link1={_quoted(first)} link2={_quoted(second)}'
        f' reason={_quoted(reason)}/>'
        for reason, first, second in sorted(
            (reason, *sorted(pair)) for pair, reason in reasons.items()
        )
    ]
    return '\n'.join([head.rstrip(), '', *lines, '', '</robot>', ''])


def _reasons(pairs: LinkPairs) -> dict[Pair, str]:
    found = dict.fromkeys(pairs.never(MARGIN), 'Never')
    found |= dict.fromkeys(pairs.always, 'Always')
    found |= dict.fromkeys(pairs.fixed, 'Fixed')
    return found | dict.fromkeys(pairs.adjacent, 'Adjacent')


def _by_user(previous: str) -> dict[Pair, str]:
    """Return the pairs of an SRDF whose reason begins with ``User``, with the reasons."""
    if not previous:
        return {}
    return {
        frozenset((each.get('link1', ''), each.get('link2', ''))): each.get('reason', '')
        for each in ET.fromstring(previous).iter('disable_collisions')  # noqa: S314  own file
        if each.get('reason', '').startswith(USER)
    }


def _groups(tree: KinematicTree) -> list[str]:
    """Return the groups and end effectors of a description as lines of XML."""
    lines: list[str] = []
    chains = list(_Branches(tree).chains())
    if not chains:
        raise ModelError(f'{tree.name}: no chain of joints that move; there is no group to make')
    for chain in chains:
        lines += [
            f'  <group name={_quoted(chain.name)}>',
            f'    <chain base_link={_quoted(chain.base)} tip_link={_quoted(chain.tip)}/>',
            '  </group>',
        ]
        if chain.tool:
            tool = f'{chain.name}_tool'
            lines.append(f'  <group name={_quoted(tool)}>')
            lines += [f'    <link name={_quoted(link)}/>' for link in chain.tool]
            lines += [
                '  </group>',
                f'  <end_effector name={_quoted(tool)} group={_quoted(tool)}',
                f'    parent_link={_quoted(chain.tip)} parent_group={_quoted(chain.name)}/>',
            ]
    return lines


class _Branches:
    """Tree of the links of a description."""

    def __init__(self, tree: KinematicTree) -> None:
        self._tree = tree
        self._movable = {joint.name for joint in tree.movable()}
        self._free = set(tree.ranges())
        self._joints: dict[str, list[Joint]] = {}
        for joint in tree.joints:
            self._joints.setdefault(joint.parent, []).append(joint)

    def chains(self) -> Iterator[_Chain]:
        """Yield the arms: from the root, or a fork of arms, to the next fork."""
        ends = list(self._ends(self._tree.root, self._tree.root))
        for base, tip, tool in ends:
            yield _Chain('arm' if len(ends) == 1 else f'arm_{tip}', base, tip, tool)

    def _ends(self, base: str, link: str) -> Iterator[tuple[str, str, Sequence[str]]]:
        onward = [each for each in self._joints.get(link, []) if self._moving(each, self._movable)]
        if len(onward) == 1:
            yield from self._ends(base, onward[0].child)
            return
        moved = any(joint.name in self._free for joint in self._tree.chain(base, link))
        forks = [self._moving(each, self._free) >= MIN_ARM_JOINTS for each in onward]
        if moved and any(forks):
            yield base, link, []
        elif moved:
            tool = [each for joint in onward for each in self._links(joint.child)]
            yield base, link if tool else self._outermost(link), tool
        if any(forks):
            for each in onward:
                yield from self._ends(link, each.child)

    def _links(self, link: str) -> list[str]:
        joints = self._joints.get(link, [])
        return [link, *(each for joint in joints for each in self._links(joint.child))]

    def _moving(self, joint: Joint, names: set[str]) -> int:
        """Count the joints of these names from a joint on."""
        onward = self._joints.get(joint.child, [])
        return (joint.name in names) + sum(self._moving(each, names) for each in onward)

    def _outermost(self, link: str) -> str:
        """Follow fixed joints out to a flange or tool frame, up to the first fork."""
        while len(self._joints.get(link, ())) == 1:
            link = self._joints[link][0].child
        return link


def _ready_poses(
    urdf: str, srdf: str, limits: Mapping[str, Any], folder: Path | None
) -> tuple[str, list[str]]:
    """Return XML for each missing ``ready`` pose, and the quality of the existing ones."""
    semantic = parse_srdf(srdf)
    text, notes = '', []
    for group in semantic.arms:
        model = RobotModel(urdf, srdf, limits, group, folder=folder)
        pose = start_pose(model)
        quality = pose_quality(model, pose)
        if quality == 0.0:
            notes.append(
                f'group {group}: pose {READY} is singular, at a limit or in collision; choose'
                ' another, or remove it to have one found'
            )
            continue
        values = zip(model.joints, pose.tolist(), strict=True)
        if READY in model.poses:
            notes.append(f'group {group}: pose {READY} is kept, quality {quality:.2f} of 0 to 1')
            continue
        lines = [f'    <joint name={_quoted(name)} value="{at:g}"/>' for name, at in values]
        state = f'  <group_state name="{READY}" group={_quoted(group)}>'
        text += '\n'.join(['\n', state, *lines, '  </group_state>'])
        notes.append(f'group {group}: pose {READY} found, quality {quality:.2f} of 0 to 1')
    return text, notes


def _pair_report(pairs: LinkPairs, chosen: Mapping[Pair, str]) -> Iterator[str]:
    never, always = pairs.never(MARGIN), pairs.always
    yield f'adjacent: {len(pairs.adjacent)} pairs; fixed to each other: {len(pairs.fixed)}'
    yield f'always in contact: {_named(always) or "none"}'
    if never:
        nearest = min(never, key=lambda pair: pairs.least[pair])
        yield (
            f'never in contact: {len(never)} pairs; the nearest {_name(nearest)}, at'
            f' {pairs.least[nearest] * 1e3:.0f} mm'
        )
        share = -math.log(MISS) / pairs.samples
        yield (
            f'  of {pairs.samples} poses none nearer than {MARGIN * 1e3:g} mm, nor of'
            f' {pairs.searched} that were searched on from the nearest; contact in'
            f' {share:.2%} of all poses would have been missed with a probability of'
            f' {MISS:g}'
        )
    checked = pairs.least.keys() - never - always - chosen.keys()
    yield f'checked, because they can touch: {_named(checked) or "none"}'
    if chosen:
        yield f'not checked, as {USER} says: {_named(chosen)}'


def _changes(
    before: frozenset[Pair], reasons: Mapping[Pair, str], pairs: LinkPairs
) -> Iterator[str]:
    for pair in sorted(before - reasons.keys(), key=sorted):
        why = (
            f'can touch ({pairs.shares[pair]:.2%} of the poses, least'
            f' {pairs.least[pair] * 1e3:.0f} mm)'
            if pair in pairs.least
            else 'is not in the description'
        )
        yield f'removed: {_name(pair)} {why}; to keep it, give it a reason that begins with {USER}'


def _name(pair: Pair) -> str:
    return ' and '.join(sorted(pair))


def _named(pairs: Mapping[Pair, str] | frozenset[Pair] | set[Pair]) -> str:
    return ', '.join(sorted(map(_name, pairs)))


def _quoted(value: str) -> str:
    """Return the value of an attribute in XML."""
    return f'"{escape(value)}"'


def srdf() -> None:
    """Run the program of arm_bringup, which knows robot folders, by the name it has here."""
    try:
        program = import_module('arm_bringup.srdf')
    except ModuleNotFoundError as error:
        sys.exit(f'{error.name} is missing: build arm_bringup, which knows robot folders')
    sys.exit(program.main())
