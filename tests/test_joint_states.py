# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""/joint_states of an arm: straight from its master, or put together from several publishers."""

from __future__ import annotations

import itertools
import time
from typing import TYPE_CHECKING

from bench_axes import urdf
from processes import executable, RunningProcess
import pytest
from ros_client import RosClient
from sensor_msgs.msg import JointState
from simulated_arm import JOINTS, SimulatedArm

from arm_msgs.srv import InjectFault

if TYPE_CHECKING:
    from isolation import Isolation

pytestmark = pytest.mark.scenario


def test_the_master_publishes_the_joints_of_its_bus(isolation: Isolation) -> None:
    """All of a SYNC in one message, from one publisher; a drive that is lost is left out."""
    with SimulatedArm(isolation, master_arguments=['-p', 'robot_joint_states:=true']) as arm:
        states = arm.client.listen(JointState, '/joint_states')

        def published(names: list[str]) -> bool:
            return bool(states) and [*states[-1].name] == names

        arm.client.spin_until(lambda: published(JOINTS), 20.0, 'all joints')
        assert len(arm.client.node.get_publishers_info_by_topic('/joint_states')) == 1
        arm.client.spin_until(lambda: len(states) > 50, 20.0, 'more of them')
        stamps = [state.header.stamp.sec * 10**9 + state.header.stamp.nanosec for state in states]
        assert all(after > before for before, after in itertools.pairwise(stamps))
        assert time.time_ns() - stamps[-1] < 60 * 10**9  # on the clock of ROS
        fault = InjectFault.Request(fault='disconnect')
        assert arm.client.call(InjectFault, f'/fake_slaves/{JOINTS[2]}/fault', fault).success
        others = [joint for joint in JOINTS if joint != JOINTS[2]]
        arm.client.spin_until(lambda: published(others), 20.0, 'the other joints')


def test_a_loss_is_warned_of_and_an_end_is_not(isolation: Isolation) -> None:
    """Of three publishers one goes on, one ends as a master does, and one is silent."""
    command = [executable('arm_canopen', 'canopen_joint_state_publisher'), '--ros-args']
    command += ['-p', f'robot_description:={urdf(["goes_on", "ends", "is_lost"])}']
    with RunningProcess(command, isolation.env) as process, RosClient(isolation.domain_id) as ros:
        process.wait_until_ready()
        publishers = {
            name: ros.node.create_publisher(JointState, f'/{name}/joint_states', 10)
            for name in ('goes_on', 'ends', 'is_lost')
        }
        states = ros.listen(JointState, '/joint_states')

        def publish(*names: str) -> None:
            stamp = ros.node.get_clock().now().to_msg()
            for name in names:
                message = JointState(name=[name], position=[0.5])
                message.header.stamp = stamp
                publishers[name].publish(message)

        def warned() -> bool:
            publish('goes_on')
            return 'no joint states of' in process.output

        def all_published() -> bool:
            publish(*publishers)
            return bool(states) and len(states[-1].name) == len(publishers)

        ros.spin_until(all_published, 20.0, 'all joints')
        ros.node.destroy_publisher(publishers['ends'])
        ros.spin_until(warned, 30.0, 'the warning')
        process.wait_for('no joint states of is_lost;')
