# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""/joint_states that is put together from several publishers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bench_axes import urdf
from processes import executable, RunningProcess
import pytest
from ros_client import RosClient
from sensor_msgs.msg import JointState

if TYPE_CHECKING:
    from isolation import Isolation

pytestmark = pytest.mark.scenario


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
