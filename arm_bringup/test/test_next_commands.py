# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The commands that a bring-up proposes fit to what it has started."""

from __future__ import annotations

from arm_bringup.bringup import next_commands
from process_supervisor import RosOptions

DRIVES, MODE = ['shoulder', 'elbow'], 'cyclic_position_mode'


def test_an_enabled_arm_is_jogged_and_follows_trajectories() -> None:
    """In its namespace; nothing is enabled by hand."""
    controllers = ['arm_controller', 'hand_controller']
    ros = RosOptions('left')
    text = next_commands(DRIVES, MODE, controllers, ros, enabled=True, simulated=False)
    assert text.splitlines() == [
        'in a second terminal:',
        '    ros2 run arm_servo servo_keyboard_input --ros-args -r __ns:=/left',
        '    ros2 action info /left/arm_controller/follow_joint_trajectory',
        '    ros2 action info /left/hand_controller/follow_joint_trajectory',
        '    ros2 topic echo --once /left/joint_states',
    ]


def test_drives_that_are_not_enabled_are_enabled_first() -> None:
    """By the services of each, or the option that is named; move_group comes last."""
    text = next_commands(
        DRIVES, MODE, ['arm_controller'], RosOptions(), enabled=False, simulated=True, planned=True
    )
    assert text.splitlines() == [
        'in a second terminal (--enable enables all drives at the start):',
        *(
            f'    ros2 service call /shoulder/{service} std_srvs/srv/Trigger # and of the others'
            for service in ('init', MODE)
        ),
        '    ros2 run arm_servo servo_keyboard_input',
        '    ros2 action info /arm_controller/follow_joint_trajectory',
        '    ros2 action info /move_action',
        '    ros2 topic echo --once /joint_states',
    ]


def test_drives_alone_get_a_target_in_simulation_only() -> None:
    """It is absolute, so no arm on hardware gets one proposed."""
    simulated, real = (
        next_commands(['axis'], MODE, [], RosOptions(), enabled=True, simulated=each)
        for each in (True, False)
    )
    assert 'ros2 service call /axis/target canopen_interfaces/srv/COTargetDouble' in simulated
    assert '{ target: 0.1 }' in simulated
    assert real.splitlines()[1:] == ['    ros2 topic echo --once /joint_states']
