# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from collections.abc import Iterator
import threading

from input_devices import InjectedDevice, InjectedDevices, xbox_pad
from isolation import Isolation
import pytest
import rclpy
from ros_client import RosClient
from teleop_robot import Robot, TEST_TIMEOUT

from operator_input.ros import serve_teleop
from quad_teleop.nodes.teleop import TeleopGamepad

pytestmark = pytest.mark.scenario
ABS_Y, ABS_HAT0Y = 1, 0x11
SOUTH, LEFT_SHOULDER, RIGHT_SHOULDER, SELECT = 0x130, 0x136, 0x137, 0x13A
FORWARD = (0.15, 0.0, 0.0)


@pytest.fixture
def pad() -> InjectedDevice:
    """Make an Xbox pad."""
    return xbox_pad()


@pytest.fixture
def context(isolation: Isolation) -> Iterator[None]:
    """Start ROS in the test's domain."""
    rclpy.init(domain_id=isolation.domain_id)
    try:
        yield
    finally:
        rclpy.shutdown()


@pytest.fixture
def robot(context: None, pad: InjectedDevice, isolation: Isolation) -> Iterator[Robot]:
    """Run the node's own loop on the pad, and listen."""
    stop = threading.Event()
    node = TeleopGamepad(InjectedDevices(pad))
    thread = threading.Thread(target=serve_teleop, args=[node, stop])
    thread.start()
    try:
        with RosClient(isolation.domain_id) as client:
            robot = Robot(client)
            robot.wait_until_linked()
            client.spin_until(lambda: node.robot.has_subscriber, TEST_TIMEOUT, 'link')
            yield robot
    finally:
        stop.set()
        thread.join()
        assert pad.is_closed


def test_deadman_stick_and_turbo(pad: InjectedDevice, robot: Robot) -> None:
    """Stick alone: nothing. With the deadman it walks, with turbo faster; let go, it stops."""
    pad.move(ABS_Y, -32768)
    robot.listen_for(0.3)
    assert robot.twists == []
    pad.press(LEFT_SHOULDER)
    robot.wait_for(FORWARD)
    pad.press(RIGHT_SHOULDER)
    robot.wait_for((0.3, 0.0, 0.0))
    pad.release(RIGHT_SHOULDER)
    pad.release(LEFT_SHOULDER)
    robot.wait_until_silent()


def test_modes_and_body(pad: InjectedDevice, robot: Robot) -> None:
    """With the deadman, A asks to stand and the d-pad lifts the body."""
    pad.press(LEFT_SHOULDER)
    pad.press(SOUTH)
    robot.client.spin_until(lambda: robot.modes == ['stand'], TEST_TIMEOUT, 'set_mode')
    pad.move(ABS_HAT0Y, -1)
    robot.client.spin_until(lambda: bool(robot.poses), TEST_TIMEOUT, 'body pose')
    assert robot.poses[0].position.z == pytest.approx(0.005)
