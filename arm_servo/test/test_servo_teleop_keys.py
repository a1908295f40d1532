# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Keys to motions, in simulated time."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from hypothesis import given
from hypothesis import strategies as st
import pytest

from arm_model import ArmNames
from arm_servo.core.requests import CommandType
from arm_servo.teleop import CartesianJog, Frame, JointJog, KeyboardTeleop, Scales
from arm_servo.teleop.jog import Jog, rest_of, ServoRequest, Steps
from arm_servo.teleop.keyboard_teleop import HELP, JOINTS, TOOL
from operator_input import (
    CommandStream,
    HeldKeys,
    KeyAction,
    KeyEvent,
    ProgramRequest,
    status_text,
)

PERIOD = 0.02
SIX = tuple(f'joint_{number}' for number in range(1, 7))


@dataclass
class Servo:
    """What is known of a servo."""

    names: ArmNames = field(default_factory=ArmNames)
    scales: Scales = field(default_factory=Scales)
    paused: bool = False
    has_subscriber: bool = True
    known: tuple[int, str] | None = (0, '')

    def report(self, now: float) -> tuple[int, str] | None:
        """Return what it reports."""
        return self.known if now < 1.0 else None


def make(speed: float = 0.5) -> KeyboardTeleop:
    """Make an idle one."""
    servo: Any = Servo()
    return KeyboardTeleop(servo, HeldKeys(), CommandStream(PERIOD, rest_of), speed, Steps())


def press(teleop: KeyboardTeleop, key: str, now: float = 0.0) -> list[object]:
    """Press a key."""
    return list(teleop.feed(KeyEvent(key, KeyAction.PRESSED, now)))


def release(teleop: KeyboardTeleop, key: str, now: float) -> None:
    """Release a key."""
    teleop.feed(KeyEvent(key, KeyAction.RELEASED, now))


def published(teleop: KeyboardTeleop, begin: float, end: float) -> list[tuple[float, Jog]]:
    """Serve as the program does: whenever it is due."""
    sent, now = [], begin
    while now <= end:
        jog = teleop.step(now)
        if isinstance(jog, Jog):
            sent.append((now, jog))
        now = max(min(teleop.due(now), now + PERIOD), now + 1e-4)
    return sent


@pytest.mark.parametrize(
    ('key', 'linear', 'angular'),
    [
        ('up', (0.5, 0, 0), (0, 0, 0)),
        ('down', (-0.5, 0, 0), (0, 0, 0)),
        ('right', (0, 0.5, 0), (0, 0, 0)),
        ('left', (0, -0.5, 0), (0, 0, 0)),
        (';', (0, 0, 0.5), (0, 0, 0)),
        ('.', (0, 0, -0.5), (0, 0, 0)),
        ('s', (0, 0, 0), (0.5, 0, 0)),
        ('c', (0, 0, 0), (0, -0.5, 0)),
        ('V', (0, 0, 0), (0, 0, -0.5)),
    ],
)
def test_keys_of_the_tool(key: str, linear: tuple[float, ...], angular: tuple[float, ...]) -> None:
    """The tutorial's keys move along its axes, ours turn."""
    teleop = make()
    press(teleop, key)
    jog = teleop.step(0.0)
    assert isinstance(jog, CartesianJog)
    assert (jog.linear, jog.angular, jog.frame) == (linear, angular, Frame.BASE)


def test_release_stops_with_rests_of_the_same_kind() -> None:
    """After the release three rests follow, then nothing; a joint's rest names the joint."""
    teleop = make()
    press(teleop, '3')
    moving = published(teleop, 0.0, 0.1)
    release(teleop, '3', 0.1)
    after = published(teleop, 0.1, 0.5)
    assert {jog for _, jog in moving} == {JointJog(2, 0.5)}
    assert [jog for _, jog in after] == [JointJog(2)] * 3


def test_frame_keys_and_reversal() -> None:
    """E is the tool's frame, W the base's, R turns the joint keys round; each stops a motion."""
    teleop = make()
    press(teleop, 'e')
    press(teleop, 'up')
    assert teleop.wanted(0.0) == CartesianJog((0.5, 0.0, 0.0), (0.0, 0.0, 0.0), Frame.TOOL)
    press(teleop, 'W')
    assert teleop.wanted(0.0) is None
    assert teleop.frame is Frame.BASE
    press(teleop, 'R')
    press(teleop, '1')
    assert teleop.wanted(0.0) == JointJog(0, -0.5)


def test_requests() -> None:
    """J and T choose the command type, P pauses, Q and Ctrl-C quit, ? helps."""
    teleop = make()
    assert press(teleop, 'j') == [CommandType.JOINT_JOG]
    assert press(teleop, 'T') == [CommandType.TWIST]
    assert press(teleop, 'p') == [ServoRequest.TOGGLE_PAUSE]
    assert press(teleop, 'q') == press(teleop, 'ctrl+c') == [ProgramRequest.QUIT]
    assert press(teleop, '?') == [HELP]


def test_speed_keys_have_limits() -> None:
    """Plus ends at full speed and says so, minus before standing still."""
    teleop = make()
    notes: list[object] = []
    for _ in range(30):
        notes += press(teleop, '+')
    assert teleop.speed == 1.0
    assert notes
    for _ in range(60):
        press(teleop, '-')
    assert 0.0 < teleop.speed <= 0.02


def test_joint_that_is_not_there() -> None:
    """On an arm of six joints, 7 moves nothing and says why."""
    teleop = make()
    teleop.robot.names = ArmNames(SIX)
    assert press(teleop, '7') == ['the arm has 6 joints: there is no joint 7']
    assert teleop.wanted(0.0) is None
    assert press(teleop, '6') == []
    assert teleop.wanted(0.0) == JointJog(5, 0.5)


@pytest.mark.slow
@given(
    key=st.sampled_from([*TOOL, *JOINTS]),
    speed=st.floats(0.05, 1.0),
    scales=st.builds(
        Scales,
        linear=st.floats(0.01, 2.0),
        rotational=st.floats(0.05, 3.0),
        joint=st.floats(0.05, 3.0),
        unitless=st.booleans(),
    ),
)
def test_a_step_is_a_step(key: str, speed: float, scales: Scales) -> None:
    """Speed times time of a stroke is the step, at any speed; it ends by itself."""
    teleop = make(speed)
    teleop.robot.scales = scales
    press(teleop, 'm')
    press(teleop, key)
    begin, end = 0.0, 0.0
    value = 0.0
    for now, jog in published(teleop, 0.0, 20.0):
        message = scales.to_message(jog)
        if isinstance(message, JointJog):
            size, scale = abs(message.velocity), scales.joint
        else:
            linear = max(map(abs, message.linear))
            size = linear or max(map(abs, message.angular))
            scale = scales.linear if any(TOOL[key].linear) else scales.rotational
        if size:
            value = size * (scale if scales.unitless else 1.0)
        elif not end:
            end = now
    wanted = Steps().linear if key in TOOL and any(TOOL[key].linear) else Steps().angular
    assert value * (end - begin) == pytest.approx(wanted, rel=1e-3)
    assert teleop.wanted(end) is None


def test_steps_do_not_pile_up() -> None:
    """The repeats of a held key in step mode are no further steps while one is under way."""
    teleop = make()
    press(teleop, 'm')
    press(teleop, 'up')
    for _ in range(5):
        teleop.feed(KeyEvent('up', KeyAction.REPEATED, 0.01))
    moving = [now for now, jog in published(teleop, 0.0, 2.0) if jog != CartesianJog()]
    assert moving[-1] < Steps().duration


def test_every_other_key_stops() -> None:
    """Space and unknown keys let go; Space publishes rests although nothing moves."""
    teleop = make()
    for key in ('space', 'z', 'f5'):
        press(teleop, 'up')
        press(teleop, key)
        assert teleop.wanted(0.0) is None
    fresh = make()
    assert press(fresh, 'k') == []
    assert press(fresh, 'space') == [ServoRequest.STOP_ROBOT], 'also what others move'
    assert [jog for _, jog in published(fresh, 0.0, 0.5)] == [CartesianJog()] * 3


def test_a_tap_without_releases_moves_a_fifth_of_the_way() -> None:
    """Half a second passes until a key counts as up; until it repeats it moves slowly."""
    teleop = make()
    teleop.feed(KeyEvent('up', KeyAction.TYPED, 0.0))
    tap = published(teleop, 0.0, 1.0)
    moving = [jog for _, jog in tap if isinstance(jog, CartesianJog) and jog.linear[0]]
    assert [jog.linear[0] for jog in moving] == pytest.approx([0.1] * len(moving))
    assert moving
    teleop = make()
    for number in range(10):
        now = 0.0 if not number else 0.45 + 0.03 * number
        teleop.feed(KeyEvent('1', KeyAction.TYPED, now))
        jog = teleop.wanted(now)
        assert isinstance(jog, JointJog)
        assert jog.velocity == pytest.approx(0.5 if number else 0.1)


def test_a_joint_that_there_is_not_is_reported_once_while_its_key_repeats() -> None:
    """Without releases each repeat is a stroke of its own; the help stays in sight."""
    teleop = make()
    teleop.robot.names = ArmNames(SIX)
    reported: list[object] = []
    for number in range(40):
        reported += teleop.feed(KeyEvent('7', KeyAction.TYPED, 0.05 * number))
    assert len(reported) == 1
    assert len(teleop.feed(KeyEvent('7', KeyAction.TYPED, 4.0))) == 1
    assert len(teleop.feed(KeyEvent('8', KeyAction.TYPED, 4.1))) == 1


def test_status_line() -> None:
    """The servo first, then the motion, frame, speed, and what is special."""

    def line() -> str:
        return status_text(teleop.status(0.0), colour=False)

    teleop, idle = make(), f'{"idle":<12}'
    servo: Any = teleop.robot
    assert line() == f'servo ok | {idle} | base frame, joints + | 50 %: 0.200 m/s'
    servo.known, servo.has_subscriber = (-3, 'collision'), False
    press(teleop, 'e')
    press(teleop, '3')
    assert (
        line() == 'collision | joint 3 + | tool frame, joints + | 50 %: 0.200 m/s | nobody listens'
    )
    servo.names, servo.paused, servo.has_subscriber = ArmNames(SIX), True, True
    press(teleop, 'r')
    press(teleop, '3')
    assert line() == 'paused | joint_3 - | tool frame, joints - | 50 %: 0.200 m/s'
    press(teleop, 's')
    assert ' | turn x + | ' in line()
    press(teleop, 'm')
    assert line().endswith(f' | {idle} | tool frame, joints - | 50 %: 0.200 m/s | steps')
    servo.paused, servo.known = False, None
    assert line().startswith('servo ? | ')
