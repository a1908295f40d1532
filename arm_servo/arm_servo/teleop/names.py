# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Names of an arm's joints and frames, from its URDF and SRDF; without building its kinematics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from xml.etree import ElementTree as ET

from arm_model import ModelError, parse_srdf

MOVABLE = frozenset({'revolute', 'continuous', 'prismatic'})


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


def names_of(urdf: str, srdf: str = '', group: str = '', tip: str = '') -> ArmNames:
    """Find the names of an arm.

    Args:
        urdf: Robot description as XML text.
        srdf: Semantic description as XML text; without it, the arm is the longest chain.
        group: Group of the SRDF; by default its first one with a chain.
        tip: The tool link; by default the end of the chain.

    Raises:
        ModelError: A text is no XML, or there is no such group or chain.
    """
    try:
        joints = list(ET.fromstring(urdf).findall('joint'))  # noqa: S314  the robot's own
    except ET.ParseError as error:
        raise ModelError(f'the robot description is no XML: {error}') from error
    above = {_link(joint, 'child'): joint for joint in joints}
    base, end = _ends(srdf, group) if srdf else ('', '')
    end = tip or end
    if not end:
        end = max(above, key=lambda link: len(_movable(_chain(above, '', link))), default='')
    chain = _chain(above, base, end)
    base = base or (_link(chain[0], 'parent') if chain else '')
    return ArmNames(tuple(_movable(chain)), base, end)


def _ends(srdf: str, group: str) -> tuple[str, str]:
    semantic = parse_srdf(srdf)
    groups = [semantic.group(group)] if group else list(semantic.groups.values())
    chains = [chain for each in groups for chain in each.chains]
    return chains[0] if chains else ('', '')


def _chain(above: dict[str, ET.Element], base: str, end: str) -> Sequence[ET.Element]:
    chain: list[ET.Element] = []
    link = end
    while link != base and link in above and above[link] not in chain:
        chain.append(above[link])
        link = _link(above[link], 'parent')
    if base and link != base:
        raise ModelError(f'the robot description has no chain from {base!r} to {end!r}')
    return chain[::-1]


def _movable(chain: Sequence[ET.Element]) -> list[str]:
    return [
        joint.get('name', '')
        for joint in chain
        if joint.get('type') in MOVABLE and joint.find('mimic') is None
    ]


def _link(joint: ET.Element, role: str) -> str:
    element = joint.find(role)
    return '' if element is None else element.get('link', '')
