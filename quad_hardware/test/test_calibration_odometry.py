# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Calibration of the odometry: a robot whose odometry is wrong by a known factor."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
import math
from pathlib import Path
import threading
import time
from typing import Any

from geometry_msgs.msg import Twist
from hypothesis import given
from hypothesis import strategies as st
from isolation import Isolation
from nav_msgs.msg import Odometry
import pytest
import rclpy
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node

from quad_calibration_script import Script
from quad_hardware.calibration import odometry
from quad_hardware.calibration.main import read_parameters, run_calibrate
from quad_hardware.calibration.odometry import Place, way

PERIOD = 0.01  # [s]
pytestmark = pytest.mark.scenario


class WalkingRobot(Node):
    """Goes as commanded; its odometry counts what its scale says."""

    def __init__(self, context: Context) -> None:
        """Stand at an angle, for the way counts in the robot's own heading."""
        super().__init__('hardware_node', context=context)
        self.declare_parameter('odometry.scale_x', 1.25)
        self.velocity = Twist()
        self.way = 0.0
        self._odom = self.create_publisher(Odometry, 'odom', 10)
        self.create_subscription(Twist, 'cmd_vel', self._move, 1)
        self.create_timer(PERIOD, self._step)

    def _move(self, message: Twist) -> None:
        self.velocity = message

    def _step(self) -> None:
        self.way += self.velocity.linear.x * PERIOD
        message = Odometry()
        message.pose.pose.position.y = self.way
        message.pose.pose.orientation.z = message.pose.pose.orientation.w = math.sqrt(0.5)
        self._odom.publish(message)


@pytest.fixture
def walking_robot(isolation: Isolation, monkeypatch: pytest.MonkeyPatch) -> Iterator[WalkingRobot]:
    """A robot in a domain of its own, served in a thread."""
    for name, value in isolation.env.items():
        monkeypatch.setenv(name, value)
    context = Context()
    rclpy.init(context=context)
    robot = WalkingRobot(context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(robot)
    thread = threading.Thread(target=spin, args=(executor,))
    thread.start()
    yield robot
    rclpy.shutdown(context=context)
    thread.join()
    robot.destroy_node()


def spin(executor: Any) -> None:
    """Serve until the context ends."""
    with suppress(ExternalShutdownException):
        executor.spin()


def test_the_scale_is_what_the_tape_says(walking_robot: WalkingRobot, tmp_path: Path) -> None:
    """It walks, stops, and the scale of before is multiplied by tape over odometry."""
    output = tmp_path / 'found.yaml'
    script = Script('', '0.15')
    command = ['odometry', '--distance', '0.3', '--speed', '0.5', '--output', str(output)]
    assert run_calibrate(command, script) == 0, script.said
    assert walking_robot.velocity.linear.x == 0.0
    said = float(
        next(line for line in script.said if line.startswith('odometry measured')).split()[2]
    )
    assert said >= 0.3
    scale = read_parameters(output)['odometry']['scale_x']  # type: ignore[index]
    assert scale == pytest.approx(1.25 * 0.15 / said, rel=2e-3)


def test_a_way_in_another_unit_is_asked_for_again(
    walking_robot: WalkingRobot, tmp_path: Path
) -> None:
    """Centimetres would make a scale that the bridge refuses."""
    output = tmp_path / 'found.yaml'
    script = Script('', '15', '0.15')
    command = ['odometry', '--distance', '0.1', '--speed', '0.5', '--output', str(output)]
    assert run_calibrate(command, script) == 0, script.said
    assert any('was it in metres?' in text for text in script.said)
    assert read_parameters(output)['odometry']['scale_x'] < 10.0  # type: ignore[index]
    assert walking_robot.velocity.linear.x == 0.0


@pytest.mark.parametrize('option', ['--speed', '--distance'])
@pytest.mark.parametrize('value', ['0', '-1', 'nan', 'inf', 'far'])
def test_a_way_that_cannot_be_walked_is_refused(
    option: str, value: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Before anything moves, and the message names the option."""
    with pytest.raises(SystemExit) as ended:
        run_calibrate(['odometry', f'{option}={value}'], Script())
    assert ended.value.code == 2
    assert option in capsys.readouterr().err


def test_who_breaks_off_has_it_stopped(
    walking_robot: WalkingRobot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ctrl-C on the way: the robot is commanded to stand, and nothing is written."""
    place = odometry.Walker.place

    def break_off(walker: odometry.Walker) -> Place:
        if walking_robot.way > 0.02:
            raise KeyboardInterrupt
        return place(walker)

    monkeypatch.setattr(odometry.Walker, 'place', break_off)
    output = tmp_path / 'found.yaml'
    script = Script('')
    command = ['odometry', '--speed', '0.5', '--output', str(output)]
    assert run_calibrate(command, script) == 1
    assert script.said[-1] == 'cancelled; nothing was written'
    assert not output.exists()
    deadline = time.monotonic() + 10.0
    while walking_robot.velocity.linear.x != 0.0:
        assert time.monotonic() < deadline, 'it walks on'
        time.sleep(0.01)


def test_nobody_there_is_said(
    isolation: Isolation, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Without a robot in the domain, and nothing is written."""
    for name, value in isolation.env.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(odometry, 'ODOMETRY_TIMEOUT', 0.3)
    script = Script('')
    output = tmp_path / 'found.yaml'
    assert run_calibrate(['odometry', '--output', str(output)], script) == 1
    assert 'bringup' in script.said[-1]
    assert not output.exists()


@given(*[st.floats(-3, 3)] * 3, *[st.floats(-2, 2)] * 2)
def test_a_way_is_taken_in_the_heading_of_its_start(
    x: float, y: float, yaw: float, ahead: float, aside: float
) -> None:
    """Both axes, from any place."""
    end = (
        x + math.cos(yaw) * ahead - math.sin(yaw) * aside,
        y + math.sin(yaw) * ahead + math.cos(yaw) * aside,
        0.0,
    )
    assert way((x, y, yaw), end, 'x') == pytest.approx(ahead, abs=1e-9)
    assert way((x, y, yaw), end, 'y') == pytest.approx(aside, abs=1e-9)
