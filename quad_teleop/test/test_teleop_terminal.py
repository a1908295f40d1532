# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
import os
from pathlib import Path
import shutil
import signal
import subprocess

from input_terminal import ScriptedTerminal
from isolation import Isolation
from processes import executable
import pytest
from ros_client import RosClient
from teleop_robot import Robot, STILL, TEST_TIMEOUT
from terminals import Pane

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


@pytest.mark.scenario
@pytest.mark.skipif(shutil.which('tmux') is None, reason='needs tmux, for real key presses')
def test_driving_with_real_key_presses(pane: Pane, isolation: Isolation) -> None:
    """The article's command in tmux: move, stop by itself, modes, body, quit."""
    with RosClient(isolation.domain_id) as client:
        robot = Robot(client)
        pane.press('ros2 run quad_teleop teleop_keyboard; echo ended with $?', 'Enter')
        pane.wait_for(r'mode \? \| 0\.15 m/s 0\.60 rad/s \| idle')
        robot.wait_until_linked()
        pane.wait_for(LINKED)

        pane.press('i')
        robot.wait_for((0.15, 0.0, 0.0))
        settled = robot.wait_until_silent()

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


@pytest.mark.scenario
@pytest.mark.skipif(shutil.which('tmux') is None, reason='needs tmux, for real key presses')
def test_nobody_there(pane: Pane) -> None:
    """Without a controller the screen says so, for the velocities and for the modes."""
    pane.press('ros2 run quad_teleop teleop_keyboard', 'Enter')
    pane.wait_for('no subscriber')
    pane.press('1')
    pane.wait_for(r'stand: no service /set_mode; is controller_node running')


FORWARD = (0.15, 0.0, 0.0)


@contextmanager
def teleop(
    terminal: ScriptedTerminal, isolation: Isolation, *parameters: str
) -> Iterator[subprocess.Popen[bytes]]:
    """Run teleop_keyboard in a terminal, which is the controlling one of its session."""
    settings = [word for parameter in parameters for word in ('-p', parameter)]
    descriptor = os.open(terminal.path, os.O_RDWR | os.O_NOCTTY)
    program = executable('quad_teleop', 'teleop_keyboard')
    process = subprocess.Popen(
        ['setsid', '--ctty', program, '--ros-args', *settings],
        env=isolation.env | {'NO_COLOR': '1'},
        stdin=descriptor,
        stdout=descriptor,
        stderr=descriptor,
        start_new_session=False,
    )
    os.close(descriptor)
    try:
        terminal.wait_written(rb'idle', TEST_TIMEOUT)
        yield process
    finally:
        process.kill()
        process.wait()


@pytest.fixture
def robot(isolation: Isolation) -> Iterator[Robot]:
    """Listen in the test's domain."""
    with RosClient(isolation.domain_id) as client:
        yield Robot(client)


def settle(robot: Robot, terminal: ScriptedTerminal) -> None:
    """Wait until the robot receives, and the terminal has promised true releases."""
    robot.wait_until_linked()
    terminal.wait_written(rb'idle +\| true releases', TEST_TIMEOUT)


@pytest.mark.scenario
@pytest.mark.skipif(shutil.which('setsid') is None, reason='needs setsid of util-linux')
def test_true_release_and_an_end_while_moving(isolation: Isolation, robot: Robot) -> None:
    """With the Kitty protocol a key may be silent for long and is held, until its release.

    Ended by a signal with a key held, zeros leave, and the terminal is as it was.
    """
    with ScriptedTerminal(kitty=True) as terminal:
        before = terminal.settings()
        with teleop(terminal, isolation) as process:
            settle(robot, terminal)
            terminal.key('i', 1)
            robot.wait_for(FORWARD)
            robot.listen_for(1.5)
            assert set(robot.velocities) == {FORWARD}, 'no stutter without repeats'
            terminal.key('i', 3)
            settled = robot.wait_until_silent()
            assert robot.velocities[-4:] == [FORWARD, STILL, STILL, STILL]
            terminal.key('i', 1)
            robot.wait_for(FORWARD, after=settled)
            process.send_signal(signal.SIGTERM)
            robot.wait_until_stopped()
            assert process.wait(TEST_TIMEOUT) == 0
        assert terminal.settings() == before
        assert (terminal.flags, terminal.modes) == ([], set())


@pytest.mark.scenario
@pytest.mark.skipif(shutil.which('setsid') is None, reason='needs setsid of util-linux')
def test_stamped_messages(isolation: Isolation, robot: Robot) -> None:
    """With twist:=false stamped:=true only TwistStamped is published, with frame and time."""
    with (
        ScriptedTerminal(kitty=False) as terminal,
        teleop(terminal, isolation, 'twist:=false', 'stamped:=true', 'frame_id:=body'),
    ):
        client = robot.client
        count = client.node.count_publishers
        client.spin_until(lambda: count('cmd_vel_stamped') > 0, TEST_TIMEOUT, 'publisher')
        terminal.wait_written(rb'idle +\| timed releases', TEST_TIMEOUT)
        terminal.send('i')
        client.spin_until(lambda: bool(robot.stamped), TEST_TIMEOUT, 'TwistStamped')
    message = robot.stamped[0]
    assert message.twist.linear.x == pytest.approx(0.15)
    assert message.header.frame_id == 'body'
    assert message.header.stamp.sec > 0
    assert robot.twists == []
