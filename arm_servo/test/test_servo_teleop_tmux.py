# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The article's second window: real keys in a real terminal, commands over DDS."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
import re
import shutil

from isolation import Isolation
from model_robots import texts
import pytest
from ros_client import RosClient
from servo_nodes import ServoListener, TIMEOUT
from terminals import Pane

pytestmark = [
    pytest.mark.scenario,
    pytest.mark.skipif(shutil.which('tmux') is None, reason='needs tmux, for real key presses'),
]

REST = (0.0,) * 6
RUN = 'ros2 run arm_servo servo_keyboard_input; echo ended with $?'
LINKED = r'idle +\| base frame, joints \+ \| 50 %: 0\.100 m/s \| timed releases'


@pytest.fixture
def pane(tmp_path: Path, isolation: Isolation) -> Iterator[Pane]:
    """Open a terminal."""
    pane = Pane(tmp_path, dict(isolation.env))
    try:
        yield pane
    finally:
        pane.stop()


@pytest.fixture
def servo(isolation: Isolation) -> Iterator[ServoListener]:
    """Listen as the servo of a GP110."""
    with RosClient(isolation.domain_id, 'servo_node') as client:
        yield ServoListener(client, *texts('gp110'))


def wait_on_screen(servo: ServoListener, pane: Pane, pattern: str) -> None:
    """Wait until something is on the screen, and serve the servo meanwhile."""
    servo.client.spin_until(lambda: bool(re.search(pattern, pane.screen())), TIMEOUT, pattern)


def wait_for_rest(servo: ServoListener, begin: int) -> None:
    """Wait for the three rests that end a motion of the tool."""
    servo.client.spin_until(
        lambda: [values for _, values in servo.received[begin:]][-3:] == [REST] * 3,
        TIMEOUT,
        'rest',
    )


def test_jogging_with_real_key_presses(pane: Pane, servo: ServoListener) -> None:
    """Arrows, frames, joints of this robot, types, pause, quit: each key as in the map."""
    pane.press(RUN, 'Enter')
    wait_on_screen(servo, pane, LINKED)

    pane.press('Up')
    wait_for_rest(servo, 0)
    assert servo.received[0] == ('base_link', (0.02, 0.0, 0.0, 0.0, 0.0, 0.0))

    count = len(servo.twists)
    pane.press('e', '\\;')  # of tmux
    wait_for_rest(servo, count)
    assert servo.received[count] == ('tool0', (0.0, 0.0, 0.02, 0.0, 0.0, 0.0))

    pane.press('R', '6')
    servo.client.spin_until(
        lambda: [list(each.velocities) for each in servo.jogs][-3:] == [[0.0]] * 3, TIMEOUT, 'rest'
    )
    assert list(servo.jogs[0].joint_names) == ['joint_6_t']
    assert list(servo.jogs[0].velocities) == pytest.approx([-0.05])
    pane.press('7')
    wait_on_screen(servo, pane, 'the arm has 6 joints: there is no joint 7')

    pane.press('J', 't', 'p')
    wait_on_screen(servo, pane, 'pause: done')
    wait_on_screen(servo, pane, r'paused +\|')
    assert servo.types == [0, 1]
    assert servo.pauses == [True]
    pane.press('p')
    wait_on_screen(servo, pane, 'go on: done')

    servo.say(6, 'joint limit: joint_5_b')
    wait_on_screen(servo, pane, r'joint limit: joint_5_b +\|')
    pane.press('q')
    wait_on_screen(servo, pane, 'ended with 0')


def test_without_a_servo(pane: Pane) -> None:
    """The screen says that nobody listens, and that there is no frame yet."""
    pane.press(RUN, 'Enter')
    pane.wait_for('nobody listens')
    pane.press('Up')
    pane.wait_for('no base frame yet')
    pane.press('p')
    pane.wait_for('there is no service /servo_node/pause_servo; is the robot running')
