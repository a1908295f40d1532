# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
import shutil

from isolation import Isolation
import pytest
from ros_client import RosClient
from teleop_robot import Robot, STILL, TEST_TIMEOUT
from terminals import Pane

pytestmark = [
    pytest.mark.scenario,
    pytest.mark.skipif(shutil.which('tmux') is None, reason='needs tmux, for real key presses'),
]
LINKED = r'idle +\| timed releases'  # without "no subscriber" between


def wait_on_screen(client: RosClient, pane: Pane, text: str) -> None:
    """Wait until something is on the screen, and serve the robot meanwhile."""
    client.spin_until(lambda: text in pane.screen(), TEST_TIMEOUT, text)


@pytest.fixture
def pane(tmp_path: Path, isolation: Isolation) -> Iterator[Pane]:
    """Open a terminal."""
    pane = Pane(tmp_path, dict(isolation.env))
    try:
        yield pane
    finally:
        pane.stop()


def test_driving_with_real_key_presses(pane: Pane, isolation: Isolation) -> None:
    """The article's command in tmux: move, stop by itself, modes, body, quit.

    With stamped:=true the same velocities have a frame and a time.
    """
    with RosClient(isolation.domain_id) as client:
        robot = Robot(client)
        stamped = '--ros-args -p stamped:=true -p frame_id:=body'
        pane.press(f'ros2 run quad_teleop teleop_keyboard {stamped}; echo ended with $?', 'Enter')
        pane.wait_for(r'mode \? \| 0\.15 m/s 0\.60 rad/s \| idle')
        robot.wait_until_linked()
        pane.wait_for(LINKED)

        pane.press('i')
        robot.wait_for((0.15, 0.0, 0.0))
        settled = robot.wait_until_silent()
        client.spin_until(lambda: bool(robot.stamped), TEST_TIMEOUT, 'TwistStamped')
        message = robot.stamped[0]
        assert (message.header.frame_id, message.twist.linear.x) == ('body', 0.15)
        assert message.header.stamp.sec > 0

        pane.press('q', 'U')
        robot.wait_for((0.165, 0.165, 0.0), after=settled)
        pane.press('Space')
        robot.wait_until_stopped()
        wait_on_screen(client, pane, 'stop: nothing walks')
        pane.wait_for(r'0\.17 m/s 0\.66 rad/s \| idle')

        pane.press('2')
        wait_on_screen(client, pane, 'walk: walk')
        pane.press('0')
        wait_on_screen(client, pane, 'lie refused: stays in stand: it is too high')
        assert robot.modes == ['walk', 'lie']
        robot.fall_over()
        wait_on_screen(
            client, pane, 'fault: it fell over; Backspace clears it, 0 lies down, 9 gets up'
        )
        pane.press('BSpace')
        wait_on_screen(client, pane, 'clear fault: all is well')
        pane.press('t', 'Down')
        client.spin_until(lambda: len(robot.poses) == 2, TEST_TIMEOUT, 'two body poses')
        assert robot.poses[-1].position.z == pytest.approx(0.005)
        assert robot.poses[-1].orientation.y > 0.0, 'nose down'

        pane.press('j')
        robot.wait_for((0.0, 0.0, 0.66), after=settled)
        pane.press('C-c')
        robot.wait_until_stopped()
        pane.wait_for('ended with 0')
    assert set(robot.velocities) <= {
        STILL,
        (0.15, 0.0, 0.0),
        (0.165, 0.165, 0.0),
        (0.0, 0.0, 0.66),
    }
