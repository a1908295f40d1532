# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Keys to motions, in simulated time."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
import pytest

from arm_servo.teleop import CartesianJog, Frame, JointJog, KeyboardTeleop, Scales
from arm_servo.teleop.exceptions import SettingError
from arm_servo.teleop.jog import Jog, rest_of
from arm_servo.teleop.key_map import HELP, JOINTS, TOOL
from arm_servo.teleop.requests import CommandType, StopRobot, SwitchType, TogglePause
from arm_servo.teleop.scales import Steps
from operator_input import CommandStream, HeldKeys, KeyAction, KeyEvent, Note, Quit

PERIOD = 0.02


def make(speed: float = 0.5) -> KeyboardTeleop:
    """Make an idle one."""
    return KeyboardTeleop(speed, Steps(), HeldKeys(), CommandStream(PERIOD, rest_of))


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
        if jog is not None:
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
    assert press(teleop, 'j') == [SwitchType(CommandType.JOINT_JOG)]
    assert press(teleop, 'T') == [SwitchType(CommandType.TWIST)]
    assert press(teleop, 'p') == [TogglePause()]
    assert press(teleop, 'q') == press(teleop, 'ctrl+c') == [Quit()]
    assert press(teleop, '?') == [Note(HELP)]


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
    with pytest.raises(SettingError, match=r'1\.5'):
        make(1.5)


def test_joint_that_is_not_there() -> None:
    """On an arm of six joints, 7 moves nothing and says why."""
    teleop = make()
    teleop.joints = 6
    assert press(teleop, '7') == [Note('the arm has 6 joints: there is no joint 7')]
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
    teleop.scales = scales
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
    assert press(fresh, 'space') == [StopRobot()], 'also what others move'
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
    teleop.joints = 6
    reported: list[object] = []
    for number in range(40):
        reported += teleop.feed(KeyEvent('7', KeyAction.TYPED, 0.05 * number))
    assert len(reported) == 1
    assert len(teleop.feed(KeyEvent('7', KeyAction.TYPED, 4.0))) == 1
    assert len(teleop.feed(KeyEvent('8', KeyAction.TYPED, 4.1))) == 1
