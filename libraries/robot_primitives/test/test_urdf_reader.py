# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What is read of a URDF, and what is refused."""

from __future__ import annotations

import pytest
from urdf_reader import DescriptionError, JointKind, Mimic, parse_srdf, read_urdf
from urdf_robots import ARM

TWO = '<robot name="r"><link name="a"/><link name="b"/>{}</robot>'
JOINT = '<joint name="j" type="{}"><parent link="{}"/><child link="{}"/>{}</joint>'
AGAIN = JOINT.format('fixed', 'a', 'b', '') + '</robot>'


def two_links(kind: str = 'revolute', parent: str = 'a', child: str = 'b', inner: str = '') -> str:
    """Make a URDF with one joint."""
    return TWO.format(JOINT.format(kind, parent, child, inner))


def three_links(inner: str, parent: str, child: str, other: str) -> str:
    """Make a URDF with two joints, j and k."""
    second = JOINT.format('revolute', parent, child, other).replace('"j" ', '"k" ')
    return two_links(inner=inner).replace('</robot>', f'<link name="c"/>{second}</robot>')


def test_a_tree_is_read_in_its_order() -> None:
    """Links, joints, root; the movable joints are those with one degree of freedom."""
    model = read_urdf(ARM)
    assert (model.name, model.root) == ('arm', 'base')
    assert model.links[:3] == ('base', 'upper', 'slider')
    assert [joint.name for joint in model.movable()] == [
        'shoulder', 'lift', 'roll', 'finger_joint', 'thumb_joint',
    ]  # fmt: skip
    assert {joint.kind for joint in model.joints} == set(JointKind)


def test_an_axis_is_made_a_unit_vector_and_is_x_by_default() -> None:
    """As URDF says."""
    shoulder = read_urdf(ARM).joints[0]
    assert shoulder.axis == (0.0, 0.0, 1.0)
    assert read_urdf(two_links()).joints[0].axis == (1.0, 0.0, 0.0)


def test_a_chain_of_mimics_leads_to_its_first_joint() -> None:
    """Multipliers and offsets are composed, whatever the order in the file is."""
    links = ''.join(f'<link name="{name}"/>' for name in 'abcd')
    joints = [
        JOINT.format('revolute', 'a', 'b', '').replace('"j"', '"first"'),
        JOINT.format('revolute', 'a', 'c', '<mimic joint="first" multiplier="2" offset="1"/>')
        .replace('"j"', '"second"'),
        JOINT.format('revolute', 'a', 'd', '<mimic joint="second" multiplier="3" offset="10"/>')
        .replace('"j"', '"third"'),
    ]  # fmt: skip
    for order in (joints, joints[::-1]):
        model = read_urdf(f'<robot name="r">{links}{"".join(order)}</robot>')
        found = {joint.name: joint.mimic for joint in model.joints}
        assert found['second'] == Mimic('first', 2.0, 1.0)
        assert found['third'] == Mimic('first', 6.0, 13.0)


@pytest.mark.parametrize(
    ('urdf', 'words'),
    [
        ('', 'empty'),
        (' \n', 'empty'),
        ('<robot', 'no XML'),
        ('<sdf/>', '<sdf>'),
        ('<robot name="r"/>', 'no <link>'),
        (
            '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:include/></robot>',
            'still has <xacro:include>; expand it',
        ),
        ('<robot name="r"><link/></robot>', '<link> has no name'),
        ('<robot name="r"><link name="a"/><link name="a"/></robot>', 'several links called a'),
        ('<robot name="r"><link name="a"/><link name="b"/></robot>', 'no parent.*a, b'),
        (two_links('hinge'), "joint j: type 'hinge'.*revolute"),
        (two_links(parent='x'), "joint j: there is no link 'x'"),
        (two_links().replace('</robot>', AGAIN), 'several joints called j'),
        (two_links(parent='b'), 'joints above link b make a loop'),
        (two_links(inner='<origin xyz="0 0"/>'), "joint j: <origin> needs three.*'0 0'"),
        (two_links(inner='<origin rpy="0 0 nan"/>'), "<origin>: 'nan' is no finite"),
        (two_links(inner='<axis xyz="0 0 0"/>'), 'joint j: <axis> has no direction'),
        (two_links(inner='<mimic/>'), 'joint j: <mimic> names no joint'),
        (two_links(inner='<mimic joint="j"/>'), 'mimics itself'),
        (two_links(inner='<mimic joint="k"/>'), "mimics 'k', which is no movable joint"),
        (two_links().replace('<parent link="a"/>', ''), 'joint j: it needs <parent'),
        (three_links('', 'c', 'b', ''), 'link b is the child of two joints, j and k'),
        (three_links('<mimic joint="k"/>', 'a', 'c', '<mimic joint="j"/>'), 'by way of'),
    ],
)
def test_what_is_no_tree_is_refused_with_the_element(urdf: str, words: str) -> None:
    """The message says where and what."""
    with pytest.raises(DescriptionError, match=words):
        read_urdf(urdf)


def test_a_fixed_joint_follows_nothing() -> None:
    """Grippers are fixed by the type of their joints, and keep their <mimic>."""
    (joint,) = read_urdf(two_links('fixed', inner='<mimic joint="elsewhere"/>')).joints
    assert joint.mimic is None


def test_a_pose_of_the_srdf_with_several_values_for_a_joint() -> None:
    """Those of floating and planar joints, which no group moves, are left out."""
    joint = '<joint name="{}" value="{}"/>'
    joints = joint.format('base', '0 0 0 0 0 0 1') + joint.format('j', ' 0.5 ')
    srdf = f'<robot name="r"><group_state name="p" group="g">{joints}</group_state></robot>'
    assert parse_srdf(srdf).poses == {'g': {'p': {'j': 0.5}}}
    for value in ('', '0 high'):
        with pytest.raises(DescriptionError, match="pose 'p'"):
            parse_srdf(srdf.replace(' 0.5 ', value))
