# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Groups as SRDFs of MoveIt make them, and the pose that an arm without ``ready`` starts from."""

from __future__ import annotations

from model_robots import chain, chain_texts, gripper, robot, ROBOTS, table, texts
import numpy as np
import pytest

from arm_model import ModelError, pose_quality, RobotModel, start_pose

pytestmark = pytest.mark.slow

CHAIN = '<chain base_link="base" tip_link="tip"/>'


def group(
    inner: str,
    more: str = '',
    kinds: str = 'zyyz',
    name: str | None = None,
    tip: str | None = None,
) -> RobotModel:
    """Return a chain with a group of one's own, and further elements of the SRDF."""
    urdf, srdf, limits = chain_texts(kinds)
    srdf = srdf.replace(CHAIN, inner).replace('</robot>', f'{more}</robot>')
    return RobotModel(urdf, srdf, limits, name, tip)


FIXED, FLOATING = (
    f'<virtual_joint name="world" type="{kind}" parent_frame="world" child_link="base"/>'
    for kind in ('fixed', 'floating')
)
WRIST = '<group name="wrist"><link name="link_4"/></group>'


@pytest.mark.parametrize(
    ('inner', 'more', 'joints'),
    [
        (CHAIN, '', 'j1 j2 j3 j4'),
        ('<joint name="j3"/><joint name="j2"/><joint name="end"/>', '', 'j2 j3'),
        ('<link name="link_2"/><link name="tip"/><link name="base"/>', '', 'j2'),
        ('<joint name="world"/><joint name="j1"/>', FIXED, 'j1'),
        (CHAIN, '<passive_joint name="j2"/>', 'j1 j3 j4'),
        ('<group name="wrist"/><joint name="j1"/>', WRIST, 'j1 j4'),
        # in another order it is the same arm
        (
            '<joint name="j4"/><joint name="j1"/><joint name="j2"/><joint name="j3"/>',
            '',
            'j1 j2 j3 j4',
        ),
    ],
)  # fmt: skip
def test_a_group_is_what_its_elements_make(inner: str, more: str, joints: str) -> None:
    """Chains, joints, links, subgroups; what does not move by itself is passed over."""
    assert ' '.join(group(inner, more, name='arm').joints) == joints


def test_a_lift_below_the_chain_of_an_arm_is_part_of_it() -> None:
    """A group of a joint and a group, as MoveIt's users write an arm on a lift."""
    lifted = '<group name="all"><joint name="j1"/><group name="arm"/></group>'
    model = group(CHAIN.replace('"base"', '"link_1"'), lifted, 'pyy', 'all')
    assert model.joints == ('j1', 'j2', 'j3')
    assert (model.base, model.tip, model.serial) == ('base', 'tip', True)
    with pytest.raises(ModelError, match='does not hang on'):
        group('<joint name="j2"/>', tip='base')


@pytest.mark.parametrize(
    ('inner', 'more', 'words'),
    [
        ('<joint name="world"/><joint name="j1"/>', FLOATING, "joint 'world' is floating"),
        ('<group name="arm"/>', '', 'group arm contains itself'),
        (
            '<group name="b"/>',
            '<group name="b"><group name="arm"/></group>',
            'arm contains itself',
        ),
        ('<joint name="j9"/>', '', "joint 'j9' is not in the description; joints: j1"),
        ('<link name="link_9"/>', '', "no link 'link_9'"),
        ('<joint name="end"/>', '', 'no joint that moves'),
    ],
)
def test_what_makes_no_group_is_refused(inner: str, more: str, words: str) -> None:
    """In words that name the joint, the link or the group."""
    with pytest.raises(ModelError, match=words):
        group(inner, more, name='arm')


@pytest.mark.parametrize('kind', ['planar', 'floating'])
def test_a_joint_of_several_directions_is_refused_in_a_group_only(kind: str) -> None:
    """Below the group, it stands still."""
    urdf, srdf, limits = chain_texts('zyy')
    moved = (
        f'<link name="world"/><joint name="rail" type="{kind}"><parent link="world"/>'
        '<child link="base"/></joint></robot>'
    )
    urdf = urdf.replace('</robot>', moved)
    model = RobotModel(urdf, srdf, limits)
    assert model.joints == ('j1', 'j2', 'j3')
    with pytest.raises(ModelError, match=f"joint 'rail' is {kind}.*take it out of the group"):
        RobotModel(urdf, srdf.replace('base_link="base"', 'base_link="world"'), limits)


def test_the_only_group_that_is_no_tool_is_the_arm() -> None:
    """A single candidate is taken without being named."""
    model = gripper('arm')
    assert model.joints == ('j1',)
    assert [each.name for each in model.end_effectors] == ['tool']
    assert gripper('hand').end_effectors == ()
    urdf, srdf, limits = chain_texts('zyy')
    hand = '<group name="hand"><joint name="j3"/></group>'
    two = srdf.replace('</robot>', f'{hand}</robot>')
    with pytest.raises(ModelError, match='groups arm, hand: choose one'):
        RobotModel(urdf, two, limits)
    tool = '<end_effector name="e" group="hand" parent_link="link_2"/></robot>'
    assert RobotModel(urdf, two.replace('</robot>', tool), limits).group == 'arm'


def test_a_group_of_a_gripper_has_its_poses() -> None:
    """A pose names the finger only; its mimic follows."""
    hand = gripper('hand')
    assert hand.joints == ('finger',)
    assert hand.poses['open'].tolist() == [0.04]


def test_a_joint_with_an_empty_range_is_refused_in_the_group_only() -> None:
    """Descriptions have joints that were fixed by their limits."""
    urdf, srdf, limits = chain_texts('zyy')
    urdf = urdf.replace('lower="-2" upper="2"', 'lower="0" upper="0"', 1)
    with pytest.raises(ModelError, match=r'joint j1: <limit> 0\.\.0'):
        RobotModel(urdf, srdf, limits)
    rest = srdf.replace(CHAIN, '<chain base_link="link_1" tip_link="tip"/>')
    assert RobotModel(urdf, rest, limits).joints == ('j2', 'j3')


def without_poses(name: str) -> RobotModel:
    """Return a robot of arm_bringup whose SRDF names no pose."""
    urdf, srdf = texts(name)
    start, _, end = srdf.partition('<group_state')
    return RobotModel(urdf, start + end.rpartition('</group_state>')[2], table(name))


@pytest.mark.parametrize('name', ROBOTS)
def test_a_pose_to_start_from_is_found(name: str) -> None:
    """As good as the one that a person chose, and the same each time."""
    model, chosen = without_poses(name), robot(name)
    assert not model.poses
    found = start_pose(model)
    assert found.tolist() == start_pose(without_poses(name)).tolist()
    assert pose_quality(model, found) >= pose_quality(chosen, chosen.poses['ready']) > 0.0
    assert (found > model.limits.lower).all()
    assert (found < model.limits.upper).all()
    assert model.clearance(found) > 0.0
    assert model.lowest(found) >= 0.0
    assert start_pose(chosen) is chosen.poses['ready']


def test_a_good_pose_of_the_srdf_is_taken_before_any_that_is_found() -> None:
    """A state that was chosen is taken; a singular one is not."""
    urdf, srdf = texts('panda')
    renamed = RobotModel(urdf, srdf.replace('"ready"', '"home"'), table('panda'))
    assert start_pose(renamed) is renamed.poses['home']
    straight = chain('zyyzyz')
    assert pose_quality(straight, np.zeros(6)) == pytest.approx(0.0, abs=1e-6)
    assert pose_quality(straight, start_pose(straight)) > 0.01


def test_an_arm_that_always_collides_has_no_pose_to_start_from() -> None:
    """It is refused with what to do."""
    urdf, srdf, limits = chain_texts('zyy')
    urdf = urdf.replace('<sphere radius="0.03"/>', '<sphere radius="0.3"/>')
    enabled = '<enable_collisions link1="link_1" link2="link_2"/></robot>'
    model = RobotModel(urdf, srdf.replace('</robot>', enabled), limits)
    assert any('touch wherever' in note for note in model.notes)
    with pytest.raises(ModelError, match='give the SRDF a group_state'):
        start_pose(model)
