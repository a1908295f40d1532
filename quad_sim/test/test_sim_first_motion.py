# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``calibrate first-motion`` at a simulated board, through its serial line."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace

import pytest
from sim_virtual import Line

from operator_input import KeyAction, KeyEvent
from quad_calibration_script import Script
from quad_description import movable_joints, robot_urdf
from quad_hardware import CommandError
from quad_hardware.calibration.first_motion import check_joint, PERIOD
from quad_hardware.calibration.wizard import CancelledError
from quad_hardware.joints import JointServo, servo_of
from quad_hardware.protocol import Protocol, V1, V2

pytestmark = pytest.mark.slow

SERVOS = {each.name: servo_of(each) for each in movable_joints(robot_urdf())}


class Fingers:
    """Someone who presses the space bar, and lets go of it after a while."""

    def __init__(self, line: Line, *, hold: float = 60.0) -> None:
        self._line, self._until = line, line.now() + hold
        self._events = [(10 * PERIOD, KeyAction.PRESSED), (hold, KeyAction.RELEASED)]
        self._begin = line.now()

    def wait(self, timeout: float) -> list[KeyEvent]:
        """Let time pass, and return what the fingers do; long after the release, enter."""
        self._line.wait_until(self._line.now() + timeout)
        now = self._line.now()
        events = []
        while self._events and now - self._begin >= self._events[0][0]:
            events.append(KeyEvent('space', self._events.pop(0)[1], now))
        if not self._events and now > self._until + 1.0:
            events.append(KeyEvent('enter', KeyAction.PRESSED, now))
        return events


def checked(servo: JointServo, protocol: Protocol, *answers: str, hold: float = 60.0) -> Line:
    """Check a joint of a robot on a stand; return its line."""
    line = Line('--held', '--start', 'stand', protocol=protocol)
    line.wait_until(1.0)
    person = Script(*answers)
    check_joint(person, line, lambda: nullcontext(Fingers(line, hold=hold)), servo)
    return line


@pytest.mark.parametrize('protocol', [V1, V2], ids=['v1', 'v2'])
@pytest.mark.parametrize('joint', ['fl_hip_joint', 'br_thigh_joint'])
def test_a_joint_that_moves_as_it_should_is_right(joint: str, protocol: Protocol) -> None:
    """By ten degrees and no other joint, as the person agrees."""
    servo = SERVOS[joint]
    line = checked(servo, protocol, '+', '')
    assert line.swung == {servo.motor}


@pytest.mark.parametrize(
    ('sign', 'answers', 'words'),
    [
        (-1, ('-', ''), 'wrong sign.*calibrate joints --joint fl_thigh_joint'),
        (1, ('o',), 'another joint moved.*motor ids are exchanged'),
        (1, ('0',), 'not seen.*horn'),
    ],
)
def test_what_was_seen_otherwise_is_refused_with_its_remedy(
    sign: int, answers: tuple[str, ...], words: str
) -> None:
    """The check ends there, and nothing is written."""
    with pytest.raises(CommandError, match=words):
        checked(replace(SERVOS['fl_thigh_joint'], sign=sign), V2, *answers)


def test_a_key_that_is_let_go_stops_the_joint() -> None:
    """It stays where it is, and what was seen is judged."""
    line = checked(SERVOS['fl_thigh_joint'], V2, '+', '', hold=1.6)
    before = line.angles()
    line.wait_until(line.now() + 1.0)
    assert line.angles() == pytest.approx(before, abs=0.5)


def test_leaving_writes_nothing() -> None:
    """Escape ends the motion."""

    class Leaving(Fingers):
        def wait(self, timeout: float) -> list[KeyEvent]:
            return [*super().wait(timeout), KeyEvent('escape', KeyAction.PRESSED, 0.0)]

    line = Line('--held', '--start', 'stand', protocol=V2)
    with pytest.raises(CancelledError, match='nothing was written'):
        check_joint(Script(), line, lambda: nullcontext(Leaving(line)), SERVOS['fl_thigh_joint'])


def test_a_key_that_is_not_held_writes_nothing_and_blames_no_joint() -> None:
    """Enter comes before the joint has moved."""

    class Entering(Fingers):
        def wait(self, timeout: float) -> list[KeyEvent]:
            super().wait(timeout)
            return [KeyEvent('enter', KeyAction.PRESSED, 0.0)]

    line = Line('--held', '--start', 'stand', protocol=V2)
    with pytest.raises(CancelledError, match='the key was not held; nothing was written'):
        check_joint(Script(), line, lambda: nullcontext(Entering(line)), SERVOS['fl_thigh_joint'])


def test_a_scale_that_is_wrong_is_that_of_another_robot() -> None:
    """The person sees three times the angle."""
    with pytest.raises(CommandError, match='give --model lite or mini'):
        checked(SERVOS['fl_thigh_joint'], V2, '+', 'n', '30')
