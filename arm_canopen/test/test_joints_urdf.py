# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Which joints of a URDF have a state."""

from __future__ import annotations

import pytest
from urdf_reader import Mimic

from arm_canopen import CanopenError
from arm_canopen.joints import movable_joints, RobotJoint

PARTS = """
  <joint name="z_first" type="revolute">{0}<child link="b"/></joint>
  <joint name="flange" type="fixed">{0}<child link="c"/></joint>
  <joint name="a_second" type="continuous">{0}<child link="d"/></joint>
  <joint name="floor" type="planar">{0}<child link="e"/></joint>
  <joint name="finger" type="prismatic">{0}<child link="f"/>
    <mimic joint="a_second" multiplier="-1.5" offset="0.2"/>
  </joint>
  <joint name="other" type="prismatic">{0}<child link="g"/><mimic joint="finger"/></joint>
""".format('<parent link="a"/>')
LINKS = ''.join(f'<link name="{name}"/>' for name in 'abcdefg')
URDF = f'<robot name="arm">{LINKS}{PARTS}</robot>'


def test_joints_with_one_variable_in_the_order_of_the_file() -> None:
    """Fixed, floating and planar ones have no state here; a mimic leads to its first joint."""
    assert movable_joints(URDF) == [
        RobotJoint('z_first'),
        RobotJoint('a_second'),
        RobotJoint('finger', Mimic('a_second', -1.5, 0.2)),
        RobotJoint('other', Mimic('a_second', -1.5, 0.2)),
    ]


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        ('', 'empty'),
        ('<robot>', 'no XML'),
        ('<sdf/>', 'begins with <sdf>'),
        ('<robot><link name="a"/></robot>', 'no revolute'),
        (URDF.replace('0.2', 'x'), "<mimic>: 'x' is no finite number"),
    ],
    ids=['empty', 'broken', 'sdf', 'fixed', 'number'],
)
def test_what_is_no_robot_is_refused_with_the_reason(text: str, words: str) -> None:
    """The message says what it is instead."""
    with pytest.raises(CanopenError, match=words):
        movable_joints(text)
