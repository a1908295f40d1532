# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Joint states: measured lately, stamped when they were, and of all drives."""

from __future__ import annotations

from dataclasses import replace
import time

from isolation import Isolation
import pytest
from ros_client import RosClient
from sensor_msgs.msg import JointState
from servo_commands import Drives, PERIOD
from urdf_reader import Mimic

from arm_servo.ros.controller_manager import JointSamples, JointStateBroadcaster, MAX_AGE


def ready() -> tuple[Drives, JointSamples]:
    """Return drives that follow, and what is published of them."""
    drives = Drives().following()
    return drives, JointSamples(drives.gateway.model.joints, {})


def test_what_is_old_is_published_no_more() -> None:
    """A last position does not pass for the present one; the others go on.

    Of a cycle that stands still, of a drive that is silent, of a gripper beside the arm.
    """
    drives, samples = ready()
    joints, cycle = list(drives.source.axes), drives.now
    samples.receive(['gripper'], [0.04], [0.0], cycle)
    found = samples.fresh(drives.gateway.snapshot, cycle + 0.3)
    assert list(found) == [*joints, 'gripper']
    assert {sample.time for sample in found.values()} == {cycle}
    assert found['gripper'].position == 0.04
    assert samples.fresh(drives.gateway.snapshot, cycle + MAX_AGE + PERIOD) == {}
    drives.axes[2] = replace(drives.axes[2], age=0.3)
    drives.run()
    found = samples.fresh(drives.gateway.snapshot, drives.now)
    assert found['panda_joint3'].time == pytest.approx(drives.now - 0.3)
    drives.axes[2] = replace(drives.axes[2], age=MAX_AGE + PERIOD)
    drives.run()
    found = samples.fresh(drives.gateway.snapshot, drives.now)
    assert set(joints) - set(found) == {'panda_joint3'}


def test_a_gripper_is_published_with_the_arm(isolation: Isolation) -> None:
    """Its own joint states come beside the arm's, stamped when the oldest was measured."""
    drives, _ = ready()
    drives.axes[2] = replace(drives.axes[2], age=0.3)
    received: list[JointState] = []
    with RosClient(isolation.domain_id, 'joint_state_broadcaster') as client:
        mimics = {'finger': Mimic('gripper', -2.0, 1.0)}
        JointStateBroadcaster(client.node, drives.gateway, ['gripper'], mimics, active=True)
        publisher = client.node.create_publisher(JointState, 'gripper/joint_states', 10)
        client.node.create_subscription(JointState, 'joint_states', received.append, 10)

        def is_whole() -> bool:
            drives.now = time.monotonic() - PERIOD
            drives.run()
            publisher.publish(JointState(name=['gripper'], position=[0.04], velocity=[0.0]))
            return any('gripper' in message.name for message in received)

        client.spin_until(is_whole, 30.0, 'joint states of all')
    whole = next(message for message in received if 'gripper' in message.name)
    assert [*whole.name] == [*drives.source.axes, 'gripper', 'finger']
    assert [*whole.position[-2:]] == pytest.approx([0.04, 0.92])
    age = time.time() - (whole.header.stamp.sec + 1e-9 * whole.header.stamp.nanosec)
    assert age >= 0.3
