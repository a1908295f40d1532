# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Arms for the tests: the robots of arm_bringup, and chains of any length."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from arm_bringup.robots import expand_xacro
from arm_model import Array, frozen, load_limits, RobotModel

FOLDER = Path(__file__).parents[2] / 'arm_bringup' / 'robots'

ROBOTS = ('panda', 'prbt', 'gp110')
LIMITS = {'max_velocity': 2.0, 'max_acceleration': 5.0, 'max_jerk': 50.0}

# the straight pose of each arm, where it is singular; Panda's fourth joint does not reach zero
STRAIGHT: Mapping[str, Array] = {
    'panda': frozen([0.0, 0.0, 0.0, -0.0698, 0.0, 1.0, 0.0]),
    'prbt': frozen([0.0] * 6),
    'gp110': frozen([0.0] * 6),
}


@cache
def texts(name: str) -> tuple[str, str]:
    """Return URDF and SRDF of a robot."""
    folder = FOLDER / name
    urdf = expand_xacro(folder / f'{name}.urdf.xacro')
    return urdf, (folder / f'{name}.srdf').read_text(encoding='utf-8')


def table(name: str) -> dict[str, Any]:
    """Return the limits of a robot."""
    return dict(load_limits(FOLDER / name / 'limits.yaml'))


@cache
def robot(name: str) -> RobotModel:
    """Return a robot of arm_bringup."""
    urdf, srdf = texts(name)
    return RobotModel(urdf, srdf, table(name))


def ready(name: str) -> Array:
    """Return the pose of a robot from which it can move in every direction."""
    return robot(name).poses['ready']


def chain_texts(kinds: str) -> tuple[str, str, dict[str, Any]]:
    """Return URDF, SRDF and limits of a chain.

    Args:
        kinds: One letter per joint: x, y or z for a revolute joint about it, c for a continuous
            joint about z, p for a sliding one along x.
    """
    parts, parent = ['<link name="base"/>'], 'base'
    for number, kind in enumerate(kinds, 1):
        axis, sort = _axis_and_type(kind)
        link = f'link_{number}'
        parts.append(
            f'<link name="{link}"><collision><origin xyz="0 0 0.05"/><geometry>'
            f'<sphere radius="0.03"/></geometry></collision></link>'
            f'<joint name="j{number}" type="{sort}"><origin xyz="0.05 0 0.2"/>'
            f'<parent link="{parent}"/><child link="{link}"/><axis xyz="{axis}"/>'
            f'<limit lower="-2" upper="2" velocity="2" effort="1"/></joint>'
        )
        parent = link
    parts.append(
        '<link name="tip"/><joint name="end" type="fixed"><origin xyz="0.1 0 0.15"/>'
        f'<parent link="{parent}"/><child link="tip"/></joint>'
    )
    srdf = (
        '<robot name="chain"><group name="arm">'
        '<chain base_link="base" tip_link="tip"/></group></robot>'
    )
    limits = {f'j{number}': dict(LIMITS) for number in range(1, len(kinds) + 1)}
    return f'<robot name="chain">{"".join(parts)}</robot>', srdf, limits


def _axis_and_type(kind: str) -> tuple[str, str]:
    """Return axis and type of a joint by its letter."""
    axis = {'x': '1 0 0', 'y': '0 1 0', 'p': '1 0 0'}.get(kind, '0 0 1')
    return axis, {'c': 'continuous', 'p': 'prismatic'}.get(kind, 'revolute')


@cache
def chain(kinds: str) -> RobotModel:
    """Return a chain, see :func:`chain_texts`."""
    return RobotModel(*chain_texts(kinds))


ARM_KINDS = {'left': 'yyp', 'right': 'yc'}
"""Joints of each arm of :func:`two_arms`, by the letters of :func:`chain_texts`."""


@cache
def two_arms(group: str = 'both', tip: str | None = None) -> RobotModel:
    """Return two arms on a torso that turns about z.

    Args:
        group: both (with the torso), left or right.
        tip: The tip; by default that of the last arm of the group.
    """
    return RobotModel(*two_arms_texts(), group, tip)


def two_arms_texts() -> tuple[str, str, dict[str, dict[str, float]]]:
    """Return URDF, SRDF and limits of :func:`two_arms`."""
    sphere = '<collision><geometry><sphere radius="0.04"/></geometry></collision>'
    parts = [f'<link name="base">{sphere}</link>', _joint('torso', 'z', 'base', '0 0 0.2')]
    names, groups = ['torso'], ''
    for side, kinds in ARM_KINDS.items():
        parent, y = 'torso_link', 0.15 if side == 'left' else -0.15
        for number, kind in enumerate(kinds):
            names.append(f'{side}_{number + 1}')
            parts.append(_joint(names[-1], kind, parent, f'0.05 {y} 0.1'))
            parent, y = f'{names[-1]}_link', 0.0
        chain = f'<chain base_link="torso_link" tip_link="{parent}"/>'
        groups += f'<group name="{side}">{chain}</group>'
    srdf = (
        f'<robot name="two_arms">{groups}<group name="both"><chain base_link="base"'
        ' tip_link="torso_link"/><group name="left"/><group name="right"/></group></robot>'
    )
    limits = {name: dict(LIMITS) for name in names}
    return f'<robot name="two_arms">{"".join(parts)}</robot>', srdf, limits


def _joint(name: str, kind: str, parent: str, xyz: str) -> str:
    """Return a joint by its letter, and the link with a sphere that it moves."""
    axis, sort = _axis_and_type(kind)
    return (
        f'<link name="{name}_link"><collision><origin xyz="0.05 0 0"/><geometry>'
        f'<sphere radius="0.03"/></geometry></collision></link>'
        f'<joint name="{name}" type="{sort}"><origin xyz="{xyz}"/><parent link="{parent}"/>'
        f'<child link="{name}_link"/><axis xyz="{axis}"/>'
        '<limit lower="-1.5" upper="1.5" velocity="2" effort="1"/></joint>'
    )


@cache
def gripper(group: str = 'all') -> RobotModel:
    """Return an arm of one joint with a gripper, whose right finger mimics the left one.

    Args:
        group: all, arm or hand.
    """
    finger = '<collision><geometry><sphere radius="0.005"/></geometry></collision>'
    limit = '<limit lower="{}" upper="{}" velocity="1" effort="1"/>'
    urdf = (
        f'<robot name="gripper"><link name="base"/><link name="palm"/>'
        f'<link name="left_link">{finger}</link><link name="right_link">{finger}</link>'
        '<joint name="j1" type="revolute"><parent link="base"/><child link="palm"/>'
        f'<axis xyz="0 0 1"/>{limit.format(-2, 2)}</joint>'
        '<joint name="finger" type="prismatic"><parent link="palm"/><child link="left_link"/>'
        f'<origin xyz="0.4 0.01 0"/><axis xyz="0 1 0"/>{limit.format(0, 0.04)}</joint>'
        '<joint name="follower" type="prismatic"><parent link="palm"/><child link="right_link"/>'
        f'<origin xyz="0.4 -0.01 0"/><axis xyz="0 -1 0"/>{limit.format(0, 0.05)}'
        '<mimic joint="finger" multiplier="1" offset="0.01"/></joint></robot>'
    )
    srdf = (
        '<robot name="gripper"><group name="arm"><joint name="j1"/></group>'
        '<group name="hand"><joint name="finger"/></group>'
        '<group name="all"><chain base_link="base" tip_link="right_link"/>'
        '<group name="arm"/><group name="hand"/></group>'
        '<end_effector name="tool" parent_link="palm" group="hand" parent_group="arm"/>'
        '<group_state name="open" group="hand"><joint name="finger" value="0.04"/></group_state>'
        '<disable_collisions link1="base" link2="palm"/></robot>'
    )
    limits = {name: {'max_acceleration': 5.0, 'max_jerk': 50.0} for name in ('j1', 'finger')}
    return RobotModel(urdf, srdf, limits, group)
