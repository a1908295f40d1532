# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Faults of an arm: processes that die, drives that fail, other clients, a dead master."""

from __future__ import annotations

import signal
import time
from typing import TYPE_CHECKING

from action_msgs.msg import GoalStatus
from bus_watch import BusRecorder
from control_msgs.action import FollowJointTrajectory
from control_msgs.msg import JointJog, JointTrajectoryControllerState
from moveit_msgs.msg import ServoStatus
import numpy as np
import pytest
from simulated_arm import CONTROLLER, goal_to, JOINTS, MovingArm, READY, SimulatedArm
from std_srvs.srv import SetBool

from canopen_core.standard import CobId

if TYPE_CHECKING:
    from pathlib import Path

    from isolation import Isolation


pytestmark = pytest.mark.scenario


def test_an_arm_survives_its_processes(isolation: Isolation) -> None:
    """A second master, drives that are killed in motion, and Ctrl-C of the master."""
    with BusRecorder(isolation.bus) as recorder, SimulatedArm(isolation) as arm:
        arm.init_all()
        _leaves_the_bus_to_the_first_master(arm, recorder)
        _boots_drives_again_that_were_killed(arm)
        arm.init_all()
        _start_all(arm, 5.0)
        assert arm.master.stop() == 0, arm.master.output
        assert recorder.last_states() == dict.fromkeys(range(2, 9), 'Switch on disabled')


def _start_all(arm: SimulatedArm, target: float) -> None:
    for joint in JOINTS:
        assert arm.client.trigger(f'/{joint}/position_mode').success
        assert arm.send_target(joint, target).success


def _leaves_the_bus_to_the_first_master(arm: SimulatedArm, recorder: BusRecorder) -> None:
    """The second one ends with words and without a frame; the drives stay enabled."""
    begin = time.monotonic()
    second = arm.start('master')
    second.wait_for('another master is on .*SYNC.*beside_master:=true')
    assert second.wait() == 1, second.output
    assert 'Traceback' not in second.output
    assert arm.client.trigger('/panda_joint1/position_mode').success
    after = [frame for frame in recorder.frames if frame.timestamp >= begin]
    assert not [frame for frame in after if frame.can_id == CobId.NMT]
    assert set(recorder.last_states().values()) == {'Operation enabled'}
    assert 'ERROR' not in arm.master.output


def _boots_drives_again_that_were_killed(arm: SimulatedArm) -> None:
    """Each lost drive is named, targets are refused, and a restart boots all again."""
    _start_all(arm, 2.0)
    arm.slaves.signal(signal.SIGKILL)
    arm.slaves.wait()
    for joint in JOINTS:
        arm.master.wait_for(f'{joint}: heartbeat lost', 10.0)
    assert not arm.send_target('panda_joint1', 0.0).success
    arm.master.wait_for('panda_joint1 takes no target.*offline')
    refused = arm.client.trigger('/panda_joint1/enable')
    assert not refused.success
    assert 'offline' in refused.message
    arm.start('fake_slaves')
    arm.master.wait_for('all 7 devices operational', 20.0, count=2)


Result = FollowJointTrajectory.Result


def test_an_arm_survives_its_drives(isolation: Isolation, tmp_path: Path) -> None:
    """A drive fails in a trajectory, in rest and by a client's hand; each time it is named."""
    with MovingArm(isolation, tmp_path) as arm:
        arm.follow()
        arm.reach(READY, 2.0)
        _stops_on_the_path_when_one_drive_fails(arm)
        _refuses_while_a_drive_is_faulted(arm)
        _recovers(arm)
        _leaves_a_target_of_another_client_alone(arm)
        _refuses_without_torque(arm)
        _aborts_a_goal_when_the_master_ends(arm)


def _stops_on_the_path_when_one_drive_fails(arm: MovingArm) -> None:
    states = arm.client.listen(JointTrajectoryControllerState, f'{CONTROLLER}/controller_state')
    to = [at + 0.4 for at in READY]
    run = arm.send(goal_to(to, 3.0))
    arm.client.spin_until(
        lambda: any(f.desired.positions[0] > 0.1 for f in run.feedback), 10.0, 'motion'
    )
    arm.inject('panda_joint4', 'over_current')
    status, result = run.wait()
    assert status == GoalStatus.STATUS_ABORTED
    assert result.error_code == Result.INVALID_GOAL
    assert 'panda_joint4 is faulted: 0x2310' in result.error_string
    assert 'recover' in result.error_string
    assert 'panda_joint3' not in result.error_string
    # the result may be here before the last states are
    arm.client.spin_until(lambda: not any(states[-1].reference.velocities), 20.0, 'rest')
    # at rest the state shows where the drives stand
    moving = [any(state.reference.velocities) for state in states]
    rest = moving.index(False, moving.index(True))
    way = np.array([list(state.reference.positions) for state in states[:rest]]) - READY
    assert np.ptp(way, axis=1).max() < 1e-4  # all joints were commanded in step, to the end
    assert 0.1 < way[-1, 0] < 0.39


def _refuses_while_a_drive_is_faulted(arm: MovingArm) -> None:
    result = arm.send(goal_to(READY, 3.0)).wait()[1]
    assert result.error_code == Result.INVALID_GOAL
    assert 'panda_joint4 ' in result.error_string
    words = arm.client.listen(ServoStatus, '/servo_node/status')
    publisher = arm.client.node.create_publisher(JointJog, '/servo_node/delta_joint_cmds', 10)
    jog = JointJog(joint_names=['panda_joint1'], velocities=[0.5])
    timer = arm.client.node.create_timer(0.05, lambda: publisher.publish(jog))
    arm.client.spin_until(
        lambda: bool(words) and words[-1].code == -1 and 'panda_joint4' in words[-1].message,
        10.0,
        'refusal of a jog',
    )
    arm.client.node.destroy_timer(timer)


def _recovers(arm: MovingArm) -> None:
    arm.inject('panda_joint4', 'none')
    answer = arm.client.trigger('/panda_joint4/recover')
    assert answer.success, answer.message
    if not arm.client.trigger('/panda_joint4/enable').success:
        assert arm.client.trigger('/panda_joint4/init').success
    arm.client.trigger('/panda_joint4/cyclic_position_mode')
    arm.reach(READY, 3.0)


def _leaves_a_target_of_another_client_alone(arm: MovingArm) -> None:
    run = arm.send(goal_to([0.5, *READY[1:]], 4.0))
    arm.client.spin_until(lambda: len(run.feedback) > 5, 10.0, 'motion')
    assert arm.send_target('panda_joint7', READY[6] + 0.1).success
    result = run.wait()[1]
    assert 'panda_joint7 ' in result.error_string
    # it takes the drive back, when its target is reached
    deadline = time.monotonic() + 20.0
    while 'single target' in arm.send(goal_to(READY, 2.0)).wait()[1].error_string:
        assert time.monotonic() < deadline
    arm.reach(READY, 2.0)


def _refuses_without_torque(arm: MovingArm) -> None:
    name = '/fake_slaves/panda_joint2/sto'
    assert arm.client.call(SetBool, name, SetBool.Request(data=True)).success
    result = arm.send(goal_to(READY, 2.0)).wait()[1]
    assert result.error_code != Result.SUCCESSFUL
    assert 'panda_joint2 ' in result.error_string


def _aborts_a_goal_when_the_master_ends(arm: MovingArm) -> None:
    """Ctrl-C in the middle of it: the drives stop, and the client gets a result."""
    name = '/fake_slaves/panda_joint2/sto'
    assert arm.client.call(SetBool, name, SetBool.Request(data=False)).success
    arm.follow()
    run = arm.send(goal_to([0.3, *READY[1:]], 6.0))
    arm.client.spin_until(lambda: len(run.feedback) > 10, 10.0, 'motion')
    arm.master.signal(signal.SIGINT)
    status, result = run.wait()
    assert status == GoalStatus.STATUS_ABORTED
    assert 'panda_joint' in result.error_string
    assert arm.master.wait() == 0
