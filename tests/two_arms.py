# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A robot folder as others write them: two arms, a gripper with a mimic joint, a neck, a wheel."""

from __future__ import annotations

from pathlib import Path
import shutil

from ament_index_python import get_package_share_path

ARMS = {'left': ('left_turn', 'left_lift', 'left_roll'), 'right': ('right_turn', 'right_slide')}
"""Joints of each arm: of each kind that URDF knows."""
GRIPPER, FOLLOWER = 'left_finger', 'left_other_finger'
DRIVES = (*ARMS['left'], *ARMS['right'], GRIPPER, 'neck')
SLIDING = {'right_slide', GRIPPER}


def _joint(name: str, kind: str, parent: str, xyz: str, axis: str, *, rest: str) -> str:
    return (
        f'<link name="{name}_link"><collision><origin xyz="0 0 0.05"/><geometry>'
        f'<sphere radius="0.02"/></geometry></collision></link><joint name="{name}" '
        f'type="{kind}"><origin xyz="{xyz}"/><parent link="{parent}"/>'
        f'<child link="{name}_link"/><axis xyz="{axis}"/>{rest}</joint>'
    )


def _limit(lower: float, upper: float, velocity: float) -> str:
    return f'<limit lower="{lower}" upper="{upper}" velocity="{velocity}" effort="9"/>'


def write_two_arms(folder: Path) -> Path:
    """Write the robot folder.

    Args:
        folder: Where to; it is made.

    Returns:
        The folder.
    """
    folder.mkdir()
    turn, slide, finger = _limit(-2, 2, 1.5), _limit(0, 0.3, 0.2), _limit(0, 0.04, 0.1)
    joints = [
        _joint('left_turn', 'revolute', 'torso', '0 0.3 0.2', '0 0 1', rest=turn),
        _joint('left_lift', 'revolute', 'left_turn_link', '0.1 0 0.1', '0 1 0', rest=turn),
        _joint('left_roll', 'continuous', 'left_lift_link', '0.2 0 0', '1 0 0', rest=''),
        _joint('right_turn', 'revolute', 'torso', '0 -0.3 0.2', '0 0 1', rest=turn),
        _joint('right_slide', 'prismatic', 'right_turn_link', '0.3 0 0.1', '0 0 1', rest=slide),
        _joint(GRIPPER, 'prismatic', 'left_roll_link', '0.1 0.03 0', '0 1 0', rest=finger),
        _joint(
            FOLLOWER,
            'prismatic',
            'left_roll_link',
            '0.1 -0.03 0',
            '0 -1 0',
            rest=f'{finger}<mimic joint="{GRIPPER}"/>',
        ),
        _joint('neck', 'revolute', 'torso', '0 0 0.5', '0 0 1', rest=_limit(-1, 1, 0)),
        _joint('wheel', 'continuous', 'torso', '0 0 -0.1', '0 1 0', rest=''),
    ]
    (folder / f'{folder.name}.urdf.xacro').write_text(
        '<robot name="$(arg name)" xmlns:xacro="http://wiki.ros.org/xacro">'
        '<xacro:include filename="$(find vendor_driver)/urdf/vendor.ros2_control.xacro"/>'
        f'<link name="torso"/>{"".join(joints)}<xacro:vendor_ros2_control name="v"/></robot>'
    )
    groups = ''.join(
        f'<group name="{side}"><chain base_link="torso" tip_link="{names[-1]}_link"/></group>'
        for side, names in ARMS.items()
    )
    (folder / f'{folder.name}.srdf').write_text(
        f'<robot name="two_arms">{groups}<group name="both"><group name="left"/>'
        f'<group name="right"/></group><group name="hand"><link name="{GRIPPER}_link"/>'
        f'<link name="{FOLLOWER}_link"/></group><end_effector name="hand" '
        'parent_link="left_roll_link" group="hand" parent_group="left"/></robot>'
    )
    entries = ''.join(
        f'  {name}:\n    has_velocity_limits: false\n    max_velocity: 0\n'
        '    has_acceleration_limits: false\n    max_acceleration: 0\n'
        for name in (*DRIVES, FOLLOWER)
    )
    (folder / 'joint_limits.yaml').write_text(f'joint_limits:\n{entries}')
    (folder / 'robot.yaml').write_text('xacro_args: {name: two_arms}\n')
    gp110 = get_package_share_path('arm_bringup') / 'robots' / 'gp110'
    shutil.copy(gp110 / 'cia402_slave.eds', folder)
    bus = (gp110 / 'bus.yml').read_text().partition('nodes:\n')[0]
    metres = '    scale_{0}_from_dev: 0.000001\n    scale_{0}_to_dev: 1000000.0\n'
    nodes = ''.join(
        f'  {name}:\n    node_id: {number}\n'
        + (''.join(map(metres.format, ('pos', 'vel', 'acc'))) if name in SLIDING else '')
        for number, name in enumerate(DRIVES, 2)
    )
    (folder / 'bus.yml').write_text(f'{bus}nodes:\n{nodes}')
    return folder
