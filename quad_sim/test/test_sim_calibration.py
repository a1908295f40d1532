# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``calibrate servos`` and ``first-motion`` at a simulated board, through its serial line."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import nullcontext
from dataclasses import replace
import os
from pathlib import Path
from subprocess import run
import sys

from processes import executable, RunningProcess
import pytest
from sim_serial import Line

from operator_input import KeyAction, Keyboard, KeyEvent
from quad_description import movable_joints, robot_urdf
from quad_hardware import CommandError
from quad_hardware.calibration.first_motion import check_joint, PERIOD
from quad_hardware.calibration.servos import calibrate_servos, ServoFit
from quad_hardware.calibration.wizard import CancelledError
from quad_hardware.joints import JointServo, servo_of
from quad_hardware.protocol import Protocol, V1, V2
from quad_pty_peer import Script
from quad_sim.plant import parse_servo

pytestmark = pytest.mark.slow

URDF = robot_urdf()
SERVOS = [servo_of(joint) for joint in movable_joints(URDF)]
HIDDEN = 'kp={},kv={},damping={},deadband=0.0015,backlash={},delay={},interpolation=0.02'


def calibrate(servo: str, protocol: Protocol, *arguments: str) -> tuple[ServoFit, list[str]]:
    """Identify the servos of a robot on a stand."""
    person = Script('')
    line = Line('--held', '--start', 'stand', '--servo', servo, *arguments, protocol=protocol)
    found = calibrate_servos(person, line, SERVOS, URDF, 'fl')
    assert line.swung == {12}  # that of the thigh
    return found, person.said


@pytest.mark.parametrize(
    ('protocol', 'servo'),
    [(V1, (3.4, 0.06, 0.04, 0.024, 0.045)), (V2, (2.45, 0.042, 0.05, 0.015, 0.02))],
    ids=['v1', 'v2'],
)
def test_hidden_servos_are_found(protocol: Protocol, servo: tuple[float, ...]) -> None:
    """Stiffness, gain, torque-speed line, free width and delay within 10 %, from bytes alone."""
    hidden = parse_servo(HIDDEN.format(*servo))
    found, said = calibrate(HIDDEN.format(*servo), protocol)
    assert found.stiffness == pytest.approx(hidden.stiffness, rel=0.1)
    assert found.damping == pytest.approx(hidden.damping, rel=0.1)
    assert found.velocity_gain == pytest.approx(hidden.velocity_gain, rel=0.2)
    assert found.free_width == pytest.approx(hidden.free_width, rel=0.1)
    assert found.delay == pytest.approx(hidden.delay, rel=0.1)
    (argument,) = (text.split()[-1] for text in said if '--servo kp' in text)
    printed = parse_servo(argument)
    assert printed.stiffness == pytest.approx(found.stiffness, rel=0.01)
    assert printed.free_width == pytest.approx(found.free_width, rel=0.01)
    assert any(f'servo_compensation.kp:={found.stiffness:.3g}' in text for text in said)


@pytest.mark.parametrize(
    ('arguments', 'reason'),
    [
        (('--fault', 'silence,at=15,for=0.7'), 'no report for 0.7'),
        (('--fault', 'limp,motor=12,at=12'), 'from those of any servo'),
    ],
    ids=['gap', 'let go on the way'],
)
def test_a_poor_recording_is_refused(arguments: tuple[str, ...], reason: str) -> None:
    """With what is wrong with it, instead of numbers."""
    with pytest.raises(CommandError, match=reason):
        calibrate('nominal', V2, *arguments)


SHORT = """
from quad_hardware.calibration import main, servos
servos.STEPS, servos.SWEEP_TIME = 16, 4.0
main.main()
"""


@pytest.mark.scenario  # in real time: with the priority of robots
def test_a_whole_calibration_over_a_port_ends_with_the_servos(tmp_path: Path) -> None:
    """Both programs, with a shorter motion: it asks first, and ends with what was measured.

    In real time a busy computer makes it rough; how exact it is, virtual time shows above.
    """
    hidden, port = parse_servo('nominal'), str(tmp_path / 'xgo')
    robot = [executable('quad_sim', 'fake_xgo'), '--no-ros', '--held', '--link', port]
    with RunningProcess([*robot, '--start', 'stand'], os.environ) as simulated:
        simulated.wait_for('fake_xgo: lite')
        command = [sys.executable, '-c', SHORT, 'servos', '--port', port]
        ended = run(command, input='\n', capture_output=True, text=True, timeout=120, check=False)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert 'keep hands away' in ended.stdout
    found = parse_servo(ended.stdout.partition('--servo ')[2].split()[0])
    assert 0.4 < found.stiffness / hidden.stiffness < 2.5


SERVO_OF = {each.joint: each for each in SERVOS}


class Fingers(Keyboard):
    """Someone who presses the space bar, and lets go of it after a while."""

    def __init__(self, line: Line, *, hold: float = 60.0) -> None:
        self._line, self._until = line, line.now() + hold
        self._events = [(10 * PERIOD, KeyAction.PRESSED), (hold, KeyAction.RELEASED)]
        self._begin = line.now()

    def wait(self, timeout: float, others: Iterable[int] = ()) -> list[KeyEvent]:
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
    servo = SERVO_OF[joint]
    line = checked(servo, protocol, '+', '')
    assert line.swung == {servo.motor}


@pytest.mark.parametrize(
    ('sign', 'answers', 'words'),
    [
        (-1, ('-', ''), 'wrong sign.*calibrate joints --joint fl_thigh_joint'),
        (1, ('o',), 'another joint moved.*motor ids are exchanged'),
        (1, ('0',), 'not seen.*horn'),
        (1, ('+', 'n', '30'), 'give --model lite or mini'),  # three times the angle
    ],
)
def test_what_was_seen_otherwise_is_refused_with_its_remedy(
    sign: int, answers: tuple[str, ...], words: str
) -> None:
    """The check ends there, and nothing is written."""
    with pytest.raises(CommandError, match=words):
        checked(replace(SERVO_OF['fl_thigh_joint'], sign=sign), V2, *answers)


def test_a_key_that_is_let_go_stops_the_joint() -> None:
    """It stays where it is, and what was seen is judged."""
    line = checked(SERVO_OF['fl_thigh_joint'], V2, '+', '', hold=1.6)
    before = line.angles()
    line.wait_until(line.now() + 1.0)
    assert line.angles() == pytest.approx(before, abs=0.5)


@pytest.mark.parametrize(
    ('key', 'words'),
    [('escape', 'nothing was written'), ('enter', 'the key was not held; nothing was written')],
)
def test_a_key_that_ends_the_motion_writes_nothing_and_blames_no_joint(
    key: str, words: str
) -> None:
    """Escape leaves, and enter comes before the joint has moved."""

    class Leaving(Fingers):
        def wait(self, timeout: float, others: Iterable[int] = ()) -> list[KeyEvent]:
            super().wait(timeout)
            return [KeyEvent(key, KeyAction.PRESSED, 0.0)]

    line = Line('--held', '--start', 'stand', protocol=V2)
    with pytest.raises(CancelledError, match=words):
        check_joint(Script(), line, lambda: nullcontext(Leaving(line)), SERVO_OF['fl_thigh_joint'])
