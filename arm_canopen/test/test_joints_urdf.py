# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Which joints of a URDF have a state."""

from __future__ import annotations

import pytest

from arm_canopen.exceptions import CanopenError
from arm_canopen.joints.robot_joints import Mimic, movable_joints, RobotJoint

URDF = """
<robot name="arm">
  <joint name="z_first" type="revolute"/>
  <joint name="flange" type="fixed"/>
  <joint name="a_second" type="continuous"/>
  <joint name="floor" type="planar"/>
  <joint name="finger" type="prismatic">
    <mimic joint="a_second" multiplier="-1.5" offset="0.2"/>
  </joint>
  <joint name="other" type="prismatic"><mimic joint="finger"/></joint>
</robot>
"""


def test_joints_with_one_variable_in_the_order_of_the_file() -> None:
    """Fixed, floating and planar ones have no state here; mimic keeps its numbers."""
    assert movable_joints(URDF) == [
        RobotJoint('z_first'),
        RobotJoint('a_second'),
        RobotJoint('finger', Mimic('a_second', -1.5, 0.2)),
        RobotJoint('other', Mimic('finger', 1.0, 0.0)),
    ]


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        ('', 'not XML'),
        ('<robot>', 'not XML'),
        ('<sdf/>', 'no URDF: its root is <sdf>'),
        ('<robot><joint name="a" type="fixed"/></robot>', 'no revolute'),
        (
            '<robot><joint name="a" type="revolute"><mimic joint="b" offset="x"/></joint></robot>',
            'odd number in <mimic>',
        ),
    ],
    ids=['empty', 'broken', 'sdf', 'fixed', 'number'],
)
def test_what_is_no_robot_is_refused_with_the_reason(text: str, words: str) -> None:
    """The message says what it is instead."""
    with pytest.raises(CanopenError, match=words):
        movable_joints(text)
