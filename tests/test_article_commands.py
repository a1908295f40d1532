# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The CANopen article's own programs, one by one, on a real bus; the manual has its commands."""

from __future__ import annotations

from collections.abc import Iterator

from isolation import Isolation, reserve
from processes import RunningProcess
import pytest
from sensor_msgs.msg import JointState
from simulated_arm import panda_bus, SimulatedArm

pytestmark = pytest.mark.scenario

TRIGGER = 'std_srvs/srv/Trigger'
TARGET = 'canopen_interfaces/srv/COTargetDouble'


@pytest.fixture(scope='module')
def reserved() -> Iterator[Isolation]:
    """Give all tests of this module one ROS domain and one CAN bus."""
    with reserve() as isolation:
        yield isolation


@pytest.fixture(scope='module')
def arm(reserved: Isolation) -> Iterator[SimulatedArm]:
    """Boot the arm, for all tests of this module."""
    with SimulatedArm(reserved) as arm:
        yield arm


@pytest.fixture(scope='module')
def publisher(arm: SimulatedArm) -> RunningProcess:
    """Publish the joint states of its first joint."""
    description = f'robot_description:={one_joint_urdf()}'
    publisher = arm.start('canopen_joint_state_publisher', '-p', description)
    publisher.wait_until_ready()
    return publisher


def call(arm: SimulatedArm, *arguments: str) -> str:
    """Run ``ros2 service call`` to its end and return what it prints."""
    process = arm.run('ros2', 'service', 'call', *arguments)
    assert process.wait(30.0) == 0, process.output
    return process.output


@pytest.mark.usefixtures('publisher')
def test_article_moves_a_joint(arm: SimulatedArm) -> None:
    """init, position_mode and target answer as described, and the joint goes to 10."""
    answer = call(arm, '/panda_joint1/init', TRIGGER)
    assert 'success=True' in answer
    assert 'Operation enabled' in answer
    answer = call(arm, '/panda_joint1/position_mode', TRIGGER)
    assert 'success=True' in answer
    assert 'mode Profile position' in answer
    again = call(arm, '/panda_joint1/position_mode', TRIGGER)
    assert 'success=True' in again
    assert 'already in mode' in again
    assert 'success=True' in call(arm, '/panda_joint1/target', TARGET, '{ target: 10.0 }')
    states = arm.client.listen(JointState, '/joint_states')
    arm.client.spin_until(
        lambda: bool(states) and abs(states[-1].position[0] - 10.0) < 1e-3, 30.0, 'arrival at 10'
    )
    assert states[-1].name == ['panda_joint1']
    assert states[-1].header.stamp.sec > 0


@pytest.mark.usefixtures('publisher')
def test_joint_states_come_at_the_rate_of_sync(arm: SimulatedArm) -> None:
    """``ros2 topic hz /joint_states`` shows the SYNC rate of 100 Hz."""
    # a second is enough: a machine that pauses slows everything for a while, SYNC included
    hz = arm.run('ros2', 'topic', 'hz', '/joint_states', '--window', '100')
    hz.wait_for(r'average rate: (9[0-9]|10[0-9])\.', 40.0)
    hz.stop()


def test_refusals_say_why(arm: SimulatedArm) -> None:
    """A mode that no RPDO carries is refused in words."""
    refused = call(arm, '/panda_joint2/cyclic_torque_mode', TRIGGER)
    assert 'success=False' in refused
    assert 'in no RPDO' in refused


def test_candump_explains_the_bus(arm: SimulatedArm, reserved: Isolation) -> None:
    """Candump shows the SDO that a service causes."""
    candump = arm.run(
        *('ros2', 'run', 'arm_canopen', 'candump', reserved.bus),
        *('--bus-config', str(panda_bus())),
    )
    candump.wait_for('SYNC')  # it listens
    request = '{ index: 0x1000, subindex: 0 }'
    answer = call(arm, '/panda_joint1/sdo_read', 'canopen_interfaces/srv/CORead', request)
    assert 'success=True' in answer
    assert f'data={0x00020192}' in answer
    candump.wait_for('SDO.*panda_joint1.*0x1000')
    candump.stop()


def one_joint_urdf() -> str:
    """Return a URDF with the first joint only."""
    return (
        '<robot name="one"><link name="a"/><link name="b"/>'
        '<joint name="panda_joint1" type="revolute"><parent link="a"/><child link="b"/>'
        '<axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint></robot>'
    )
