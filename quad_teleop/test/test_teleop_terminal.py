# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
import os
import shutil
import signal
import subprocess

from input_terminal import ScriptedTerminal
from isolation import Isolation
from processes import executable
import pytest
from ros_client import RosClient
from teleop_robot import Robot, STILL, TEST_TIMEOUT

pytestmark = [
    pytest.mark.scenario,
    pytest.mark.skipif(shutil.which('setsid') is None, reason='needs setsid of util-linux'),
]
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
