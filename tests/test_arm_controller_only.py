# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``bringup --controller-only``: trajectories and jogging for drives of another process."""

from __future__ import annotations

from itertools import pairwise
import signal
from typing import TYPE_CHECKING

from control_msgs.action import FollowJointTrajectory
from control_msgs.msg import JointJog
from moving_arm import goal_to, GoalRun, reach, READY
from processes import executable
import pytest
from topic_arm import PATIENT, TopicArm
from two_arms import ARMS, GRIPPER, write_two_arms

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from isolation import Isolation

pytestmark = pytest.mark.scenario


def test_a_goal_and_a_jog_move_drives_elsewhere(isolation: Isolation) -> None:
    """A goal is reached; a jog takes over from the next one, without a jump; it ends at rest."""
    command = [executable('arm_bringup', 'bringup'), 'panda', '--controller-only']
    with TopicArm(isolation, command, 'all is ready') as arm:
        reach(arm.client, goal_to([0.3, *READY[1:]], 2.0))
        assert arm.at[0] == pytest.approx(0.3, abs=1e-6)
        run = GoalRun(arm.client, goal_to([1.0, *READY[1:]], 6.0))
        arm.client.spin_until(lambda: arm.at[0] > 0.35, 10.0, 'motion')
        publisher = arm.client.node.create_publisher(JointJog, '/servo_node/delta_joint_cmds', 10)
        jog = JointJog(joint_names=['panda_joint1'], velocities=[-1.0])
        arm.client.node.create_timer(0.02, lambda: publisher.publish(jog))
        arm.client.spin_until(lambda: arm.at[0] < 0.2, 10.0, 'motion the other way')
        result = run.wait()[1]
        assert result.error_code == FollowJointTrajectory.Result.INVALID_GOAL
        assert 'jogging took over' in result.error_string
        assert max(abs(b[0] - a[0]) for a, b in pairwise(arm.arrays)) < 0.01
        assert not arm.trajectories  # they would go to the trajectory controller
        names = arm.client.node.get_node_names()
        assert 'robot_state_publisher' not in names
        arm.process.signal(signal.SIGINT)
        arm.client.spin_until(lambda: not arm.process.is_running(), 15.0, 'end of the bring-up')
        assert arm.process.wait() == 0
        steps = [abs(b[0] - a[0]) for a, b in pairwise(arm.arrays)]
        assert steps[-1] < 1e-4


def test_each_group_has_a_topic_of_its_own(isolation: Isolation, tmp_path: Path) -> None:
    """Two arms and a gripper move at the same time; one is canceled, and the others go on."""
    groups = {**ARMS, 'hand': (GRIPPER,)}
    commands = 'forward_position_controller/commands'
    topics = {
        f'/{"" if group == "left" else group + "_"}{commands}': joints
        for group, joints in groups.items()
    }
    command = [executable('arm_bringup', 'bringup'), f'{write_two_arms(tmp_path / "two_arms")}/']
    command += ['--controller-only', '--ros-args']
    for group in groups:
        for name, value in PATIENT.items():
            command += ['-p', f'{group}_controller:{name}:={value}']
    start = [0.0] * sum(map(len, groups.values()))
    with TopicArm(isolation, command, 'all is ready', topics=topics, start=start) as robot:

        def follow(group: str, positions: Sequence[float], time: float) -> GoalRun:
            goal = goal_to(positions, time, groups[group])
            return GoalRun(robot.client, goal, f'/{group}_controller')

        runs = {
            'left': follow('left', [0.4, -0.3, 0.5], 4.0),
            'right': follow('right', [-1.5, 0.2], 20.0),
            'hand': follow('hand', [0.03], 4.0),
        }
        for name in ('left', 'hand'):
            result = runs[name].wait()[1]
            assert result.error_code == 0, (name, result.error_string)
        places = dict(zip(robot.joints, robot.at, strict=True))
        assert [places[name] for name in ARMS['left']] == pytest.approx([0.4, -0.3, 0.5], abs=1e-6)
        assert places[GRIPPER] == pytest.approx(0.03, abs=1e-6)
        assert -1.4 < places['right_turn'] < -0.05
        runs['right'].cancel()
        runs['right'].wait()
        jogs = robot.client.node.create_publisher(
            JointJog, '/right_servo_node/delta_joint_cmds', 10
        )
        jog = JointJog(joint_names=['right_turn'], velocities=[1.0])
        robot.client.node.create_timer(0.02, lambda: jogs.publish(jog))
        turn, before = robot.joints.index('right_turn'), places['right_turn']
        robot.client.spin_until(lambda: robot.at[turn] > before + 0.1, 20.0, 'a jog')
        robot.process.signal(signal.SIGINT)
        robot.client.spin_until(lambda: not robot.process.is_running(), 15.0, 'end')
        assert robot.process.wait() == 0
