# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Trajectories on a simulated arm: action, topic, cancel, speed and what is refused."""

from __future__ import annotations

import signal
from typing import TYPE_CHECKING

from action_msgs.msg import GoalStatus
from control_msgs.action import FollowJointTrajectory
from control_msgs.msg import JointTrajectoryControllerState, SpeedScalingFactor
from control_msgs.srv import QueryTrajectoryState
from controller_manager_msgs.srv import ListControllers, SwitchController
from moving_arm import CONTROLLER, goal_to, MovingArm, READY
import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState
from simulated_arm import JOINTS

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from isolation import Isolation

pytestmark = pytest.mark.scenario

Result = FollowJointTrajectory.Result


def test_an_arm_follows_goals_and_says_why_not(isolation: Isolation, tmp_path: Path) -> None:
    """Refusals before and after init, a goal to its end, a cancel on the path, a drive lost."""
    with MovingArm(isolation, tmp_path) as arm:
        states = arm.client.listen(
            JointTrajectoryControllerState, f'{CONTROLLER}/controller_state'
        )
        _reports_where_it_stands(arm, states)
        _refuses_before_init(arm)
        arm.follow()
        _refuses_what_is_wrong(arm)
        _reaches_a_goal(arm)
        _is_listed_and_switched(arm)
        _takes_a_goal_from_the_command_line(arm)
        _cancels_on_the_path(arm)
        _slows_down(arm)
        _names_the_lost_drives(arm)


def _reports_where_it_stands(
    arm: MovingArm, states: Sequence[JointTrajectoryControllerState]
) -> None:
    """Before any command, and before the drives are enabled."""
    arm.client.spin_until(lambda: bool(states), 10.0, 'state of the controller')
    assert list(states[0].reference.positions) == list(states[0].feedback.positions)
    assert not any(states[0].error.positions)
    service = f'{CONTROLLER}/query_state'
    answer = arm.client.call(QueryTrajectoryState, service, QueryTrajectoryState.Request())
    assert answer.success, answer.message
    assert list(answer.position) == pytest.approx(list(states[-1].feedback.positions), abs=1e-3)


def _refuses_before_init(arm: MovingArm) -> None:
    status, result = arm.send(goal_to(READY, 3.0)).wait()
    assert status == GoalStatus.STATUS_ABORTED
    assert result.error_code == Result.INVALID_GOAL
    assert '~/init' in result.error_string
    assert 'panda_joint1' in result.error_string


def _refuses_what_is_wrong(arm: MovingArm) -> None:
    unknown = goal_to(READY, 3.0, ['elbow', *JOINTS[1:]])
    beyond = goal_to([9.0, *READY[1:]], 3.0)
    old = goal_to(READY, 3.0)
    old.trajectory.header.stamp.sec = 1
    nan = goal_to([float('nan'), *READY[1:]], 3.0)
    fast = goal_to(READY, 0.1)
    twice = goal_to(READY, 3.0)
    twice.trajectory.points *= 2
    for goal, code, words in (
        (unknown, Result.INVALID_JOINTS, 'elbow'),
        (beyond, Result.INVALID_GOAL, 'panda_joint1'),
        (old, Result.OLD_HEADER_TIMESTAMP, 'stamp'),
        (nan, Result.INVALID_GOAL, 'nan'),
        (fast, Result.INVALID_GOAL, 'rad/s'),
        (twice, Result.INVALID_GOAL, 'must increase'),
        (goal_to(READY[:3], 3.0), Result.INVALID_GOAL, '3 positions'),
    ):
        status, result = arm.send(goal).wait()
        assert status == GoalStatus.STATUS_ABORTED
        assert result.error_code == code, result.error_string
        assert words in result.error_string


def _reaches_a_goal(arm: MovingArm) -> None:
    run = arm.send(goal_to(READY, 3.0))
    status, result = run.wait()
    assert (status, result.error_code) == (GoalStatus.STATUS_SUCCEEDED, 0), result.error_string
    assert list(run.feedback[-1].joint_names) == JOINTS
    assert list(run.feedback[-1].actual.positions) == pytest.approx(READY, abs=0.02)
    assert len(run.feedback) > 10
    answer = arm.client.call(
        QueryTrajectoryState, f'{CONTROLLER}/query_state', QueryTrajectoryState.Request()
    )
    assert answer.success
    assert list(answer.position) == pytest.approx(READY, abs=1e-3)


def _is_listed_and_switched(arm: MovingArm) -> None:
    states = arm.client.listen(JointState, '/joint_states')
    arm.client.spin_until(lambda: bool(states), 10.0, 'joint states')
    assert list(states[-1].name) == JOINTS
    assert list(states[-1].position) == pytest.approx(READY, abs=0.02)
    listed = arm.client.call(
        ListControllers, '/controller_manager/list_controllers', ListControllers.Request()
    )
    assert {each.name: each.state for each in listed.controller} == {
        'panda_arm_controller': 'active',
        'joint_state_broadcaster': 'active',
    }
    run = arm.send(goal_to([0.5, *READY[1:]], 4.0))
    arm.client.spin_until(lambda: len(run.feedback) > 5, 10.0, 'motion')
    _switch(arm, SwitchController.Request(deactivate_controllers=['panda_arm_controller']))
    status, result = run.wait()
    assert status == GoalStatus.STATUS_ABORTED
    assert 'deactivated' in result.error_string
    assert 'inactive' in arm.send(goal_to(READY, 2.0)).wait()[1].error_string
    _switch(arm, SwitchController.Request(activate_controllers=['panda_arm_controller']))


def _switch(arm: MovingArm, request: SwitchController.Request) -> None:
    request.strictness = SwitchController.Request.STRICT
    answer = arm.client.call(SwitchController, '/controller_manager/switch_controller', request)
    assert answer.ok, answer.message


def _takes_a_goal_from_the_command_line(arm: MovingArm) -> None:
    numbers = ', '.join(map(str, [0.1, *READY[1:]]))
    goal = (
        f'{{trajectory: {{joint_names: [{", ".join(JOINTS)}], points: [{{positions: [{numbers}],'
        ' time_from_start: {sec: 1}}]}}'
    )
    name = f'{CONTROLLER}/follow_joint_trajectory'
    kind = 'control_msgs/action/FollowJointTrajectory'
    command = arm.run('ros2', 'action', 'send_goal', '--feedback', name, kind, goal)
    assert command.wait(30.0) == 0, command.output
    assert 'status: SUCCEEDED' in command.output
    assert 'Feedback:' in command.output


def _cancels_on_the_path(arm: MovingArm) -> None:
    run = arm.send(goal_to([0.5, *READY[1:]], 2.0))
    arm.client.spin_until(
        lambda: any(f.desired.positions[0] > 0.1 for f in run.feedback), 10.0, 'motion'
    )
    run.cancel()
    status, result = run.wait()
    assert status == GoalStatus.STATUS_CANCELED, result.error_string
    assert 'on the path' in result.error_string


def _slows_down(arm: MovingArm) -> None:
    states = arm.client.listen(JointTrajectoryControllerState, f'{CONTROLLER}/controller_state')
    _scales(arm, states, 0.8, DurabilityPolicy.VOLATILE)
    _scales(arm, states, 0.5, DurabilityPolicy.TRANSIENT_LOCAL)
    run = arm.send(goal_to(READY, 1.0))
    assert run.wait()[0] == GoalStatus.STATUS_SUCCEEDED
    times = [f.header.stamp.sec + 1e-9 * f.header.stamp.nanosec for f in run.feedback]
    assert times[-1] - times[0] > 1.5  # of 2 s
    assert not any('incompatible QoS' in line for line in arm.master.lines)


def _scales(
    arm: MovingArm,
    states: Sequence[JointTrajectoryControllerState],
    factor: float,
    durability: DurabilityPolicy,
) -> None:
    """Set the speed as a controller that latches it does, or a person in a shell."""
    publisher = arm.client.node.create_publisher(
        SpeedScalingFactor,
        f'{CONTROLLER}/speed_scaling_input',
        QoSProfile(depth=1, durability=durability),
    )
    arm.client.spin_until(
        lambda: publisher.get_subscription_count() > 0, 10.0, 'match of the publisher'
    )
    publisher.publish(SpeedScalingFactor(factor=factor))
    arm.client.spin_until(
        lambda: bool(states) and states[-1].speed_scaling_factor == factor, 10.0, f'{factor}'
    )


def _names_the_lost_drives(arm: MovingArm) -> None:
    run = arm.send(goal_to([0.5, *READY[1:]], 4.0))
    arm.client.spin_until(lambda: len(run.feedback) > 5, 10.0, 'motion')
    arm.slaves.signal(signal.SIGKILL)
    status, result = run.wait()
    assert status == GoalStatus.STATUS_ABORTED
    assert 'panda_joint' in result.error_string
    assert result.error_code == Result.INVALID_GOAL
    assert all(name in result.error_string for name in JOINTS)
