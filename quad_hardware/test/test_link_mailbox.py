# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Orders on their way from the node's thread to the driver's: none is lost in silence."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
import sys
import threading

import pytest

from quad_description import movable_joints, robot_urdf
from quad_hardware.joints import CommandLimiter, JointMap, servo_of
from quad_hardware.link import Driver, LinkOptions, LinkState
from quad_hardware.report import Report
from quad_pty_peer import PtyPeer

COMMANDS = 5_000


@pytest.fixture
def hurried() -> Iterator[None]:
    """Let threads take turns as often as can be."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(before)


def test_a_change_of_torque_that_is_not_sent_is_reported(tmp_path: Path) -> None:
    """It was accepted, and then the conversation broke off: the change of the link says so.

    Nobody knows how much of it has left: the servos count as let go until they are to hold.
    """
    changes: list[tuple[LinkState, str]] = []
    accepted: list[bool] = []

    def fail_once(_: Report) -> str:
        if not accepted and driver.status().state is LinkState.RUNNING:
            accepted.append(driver.torque(on=False))
            raise RuntimeError
        return ''

    found_again = threading.Event()

    def note(state: LinkState, detail: str) -> None:
        changes.append((state, detail))
        if accepted and state is LinkState.RUNNING:
            found_again.set()

    with PtyPeer(tmp_path / 'port') as peer:
        driver = Driver(LinkOptions(str(peer.link)), fail_once, note)
        driver.start()
        assert found_again.wait(15.0), changes
        driver.stop()
        assert accepted == [True]
        assert peer.torque
        assert driver.limp
    (failure,) = [detail for state, detail in changes if state is LinkState.FAILED]
    assert 'torque' in failure


@pytest.mark.usefixtures('hurried')
def test_a_lost_robot_may_be_reported_in_the_midst_of_a_command() -> None:
    """The driver's thread ends the stream while the node's takes a command of it."""
    joints = JointMap(servo_of(joint) for joint in movable_joints(robot_urdf('lite')))
    limiter, done = CommandLimiter(joints), threading.Event()
    place = [0.5] * len(joints.names)

    def lose() -> None:
        while not done.is_set():
            limiter.reset()

    thread = threading.Thread(target=lose)
    thread.start()
    try:
        for step in range(COMMANDS):
            assert len(limiter.step(place, place, 0.02 * step).targets) == len(place)
    finally:
        done.set()
        thread.join()
