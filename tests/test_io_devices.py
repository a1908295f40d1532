# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Topics of an I/O module, over DDS and a real bus."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from canopen_interfaces.msg import COData
from isolation import reserve
import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile
from simulated_arm import SimulatedArm

pytestmark = pytest.mark.scenario
BUS_YML = Path(__file__).parents[1] / 'arm_canopen' / 'eds' / 'io_bus.yml'
LATCHED = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
TIMEOUT = 30.0  # [s]


@pytest.fixture(scope='module')
def devices() -> Iterator[SimulatedArm]:
    """Boot both, for all tests of this module."""
    with (
        reserve() as isolation,
        SimulatedArm(isolation, BUS_YML, [], ['-p', 'robot_joint_states:=true']) as started,
    ):
        yield started


def test_any_object_is_published_and_received_as_with_ros2_canopen(devices: SimulatedArm) -> None:
    """`~/tpdo` sends an RPDO, `~/rpdo` has each object of a TPDO."""
    client = devices.client
    received = client.listen(COData, '/io/rpdo')
    sender = client.node.create_publisher(COData, '/io/tpdo', 10)
    client.spin_until(lambda: bool(sender.get_subscription_count()), TIMEOUT, 'the master')
    client.spin_for(0.5)  # in which it sees who listens
    sender.publish(COData(index=0x6000, subindex=1, data=1))
    sender.publish(COData(index=0x6200, subindex=1, data=9))
    wanted = (0x6000, 1, 9)
    shown = lambda: [(each.index, each.subindex, each.data) for each in received]  # noqa: E731
    client.spin_until(lambda: wanted in shown(), TIMEOUT, 'the input')
    devices.master.wait_for('~/tpdo: 0x6000:01 is in no RPDO of the device; map it', TIMEOUT)
