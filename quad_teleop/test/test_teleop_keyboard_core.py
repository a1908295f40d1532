# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import math
from typing import Any

from hypothesis import given
from hypothesis import strategies as st
import pytest

from operator_input import (
    AutoRepeat,
    CommandStream,
    HeldKeys,
    KeyAction,
    KeyEvent,
    ProgramRequest,
)
from operator_input.key_decoder import KeyDecoder
from quad_teleop import BodyPose, Mode, SettingError, Speeds, Velocity
from quad_teleop.key_map import (
    HELP,
    MODES,
    MOVES,
    NEUTRAL_KEYS,
    POSES,
    Request,
    SPEEDS,
    STOP_KEYS,
)
from quad_teleop.keyboard_teleop import KeyboardTeleop
from quad_teleop.motion import NEUTRAL, PoseSteps, rest_of, RobotRequest, ZERO

NO_ROBOT: Any = None
V, W = 0.15, 0.6
PRESSED, TYPED, RELEASED = KeyAction.PRESSED, KeyAction.TYPED, KeyAction.RELEASED
ALL_KEYS = sorted({*MOVES, *SPEEDS, *MODES, *POSES, *NEUTRAL_KEYS, *STOP_KEYS, 's', 'ctrl+c'})
LONGEST = AutoRepeat().longest


def teleop() -> KeyboardTeleop:
    """Make one with the default settings."""
    stream = CommandStream(0.05, rest_of)
    return KeyboardTeleop(NO_ROBOT, HeldKeys(), stream, Speeds(), PoseSteps())


def feed(
    target: KeyboardTeleop, key: str, action: KeyAction = TYPED, time: float = 0.0
) -> list[Request]:
    """Feed one event."""
    return target.feed(KeyEvent(key, action, time))


def published(target: KeyboardTeleop, start: float, end: float) -> list[Velocity]:
    """Return what is published in a time."""
    steps = round((end - start) / 0.01)
    found = (target.step(start + 0.01 * index) for index in range(steps + 1))
    return [velocity for velocity in found if isinstance(velocity, Velocity)]


@pytest.mark.parametrize(
    ('key', 'x', 'y', 'yaw'),
    [
        ('i', V, 0, 0),
        ('o', V, 0, -W),
        ('j', 0, 0, W),
        ('l', 0, 0, -W),
        ('u', V, 0, W),
        (',', -V, 0, 0),
        ('.', -V, 0, W),
        ('m', -V, 0, -W),
        ('I', V, 0, 0),
        ('O', V, -V, 0),
        ('J', 0, V, 0),
        ('L', 0, -V, 0),
        ('U', V, V, 0),
        ('<', -V, 0, 0),
        ('>', -V, -V, 0),
        ('M', -V, V, 0),
    ],
)
def test_map_that_everybody_knows(key: str, x: float, y: float, yaw: float) -> None:
    """Each key of teleop_twist_keyboard goes where it goes there."""
    target = teleop()
    feed(target, key)
    assert target.step(0.0) == Velocity(x, y, yaw)


EVENTS = st.lists(
    st.tuples(
        st.sampled_from(ALL_KEYS),
        st.sampled_from(KeyAction),
        st.sampled_from([0.0, 0.01, 0.03, 0.1, 0.4, 0.6, 2.0]),
    ),
    max_size=50,
)


@given(EVENTS)
def test_after_release_and_time_out_always_stopped(
    events: list[tuple[str, KeyAction, float]],
) -> None:
    """Whatever was pressed: all up, the time-out over, and the last word was zero."""
    target, now, words = teleop(), 0.0, [ZERO]
    for key, action, gap in events:
        words += published(target, now, now + gap)
        now += gap
        feed(target, key, action, now)
    for key in ALL_KEYS:
        feed(target, key, RELEASED, now)
    words += published(target, now, now + LONGEST + 0.3)
    assert words[-1] == ZERO
    now += LONGEST + 0.3
    assert target.due(now) == math.inf, 'an idle program sleeps'
    assert published(target, now, now + 1.0) == []


@given(EVENTS)
def test_never_two_speeds(events: list[tuple[str, KeyAction, float]]) -> None:
    """Every word is one key's direction at the speeds that are set, or zero; never a sum."""
    target, now = teleop(), 0.0
    for key, action, gap in events:
        allowed = {ZERO} | {way.at(target.speeds) for way in MOVES.values()}
        assert set(published(target, now, now + gap)) <= allowed
        now += gap
        feed(target, key, action, now)


@given(st.lists(st.tuples(st.binary(max_size=30), st.sampled_from([0.0, 0.03, 0.3, 1.0]))))
def test_noise_of_an_old_terminal_never_leaves_it_moving(reads: list[tuple[bytes, float]]) -> None:
    """Any bytes at any pace, as from a broken line: when they end, so does the motion."""
    target, decoder, now = teleop(), KeyDecoder(), 0.0
    for data, gap in reads:
        now += gap
        for event in decoder.feed(data, now):
            if isinstance(event, KeyEvent):
                target.feed(event)
    assert target.wanted(now + LONGEST) is None


def test_tap_moves_and_stops_by_itself() -> None:
    """One character over SSH: motion for the first time-out, three zeros, silence."""
    target = teleop()
    feed(target, 'i')
    words = published(target, 0.0, 2.0)
    moving = words.count(Velocity(V, 0, 0))
    assert words == [Velocity(V, 0, 0)] * moving + [ZERO] * 3
    assert moving == pytest.approx(10, abs=1)


def test_true_release_stops_at_once() -> None:
    """Where the release is known, the zero does not wait for anything."""
    target = teleop()
    feed(target, 'i', PRESSED)
    assert target.step(30.0) == Velocity(V, 0, 0)
    feed(target, 'i', RELEASED, 30.01)
    assert target.step(30.01) == ZERO


@pytest.mark.parametrize('key', ['s', 'p', 'enter', 'escape', 'f5', 'ctrl+a', 'ш'])
def test_any_other_key_stops(key: str) -> None:
    """A person who hits anything in fright stops the robot; an idle one stays silent."""
    target = teleop()
    assert feed(target, key) == []
    assert target.step(0.0) is None
    feed(target, 'i', PRESSED, 1.0)
    target.step(1.0)
    feed(target, key, TYPED, 2.0)
    assert target.step(2.0) == ZERO


@pytest.mark.parametrize('key', ['space', 'k'])
def test_stop_key_says_zero_even_when_idle(key: str) -> None:
    """Something else may be driving the robot."""
    target = teleop()
    assert feed(target, key) == ([RobotRequest.STOP] if key == 'space' else [])
    assert published(target, 0.0, 1.0) == [ZERO] * 3


def test_stop_is_not_undone_by_a_key_that_is_still_down() -> None:
    """Space while i is held: the repeats of i move nothing, a new press does."""
    target = teleop()
    feed(target, 'i', PRESSED)
    feed(target, 'space', PRESSED, 1.0)
    feed(target, 'i', KeyAction.REPEATED, 1.1)
    assert target.wanted(1.1) is None
    feed(target, 'i', RELEASED, 1.2)
    feed(target, 'i', PRESSED, 1.3)
    assert target.wanted(1.3) == Velocity(V, 0, 0)


def test_speed_keys() -> None:
    """Q and z change both by 10 %, w and x the linear one, e and c the angular one."""
    target = teleop()
    feed(target, 'q')
    assert (target.speeds.linear, target.speeds.angular) == pytest.approx((0.165, 0.66))
    for key in 'zxc':
        feed(target, key)
    assert (target.speeds.linear, target.speeds.angular) == pytest.approx((0.13365, 0.5346))


def test_speed_changes_the_motion_that_goes_on() -> None:
    """With true releases, a faster step takes effect while the key is held."""
    target = teleop()
    feed(target, 'i', PRESSED)
    target.step(0.0)
    feed(target, 'w', PRESSED, 0.01)
    assert target.speeds.linear > V
    assert target.step(0.01) == Velocity(target.speeds.linear, 0.0, 0.0)


@given(st.lists(st.sampled_from(sorted(SPEEDS)), max_size=80))
def test_speeds_stay_within_their_limits(keys: list[str]) -> None:
    """However often: not above the limits, and never so slow that it is stuck at zero."""
    target = teleop()
    for key in keys:
        feed(target, key)
    assert 0.01 <= target.speeds.linear <= target.speeds.linear_limit
    assert 0.01 <= target.speeds.angular <= target.speeds.angular_limit


def test_limit_is_reported() -> None:
    """At the limit a key does nothing, and says so."""
    target = teleop()
    answers = [feed(target, 'w') for _ in range(20)]
    assert answers[0] == []
    assert answers[-1] == ['this speed is the limit']


@pytest.mark.parametrize(('key', 'mode'), MODES.items())
def test_mode_keys_ask_once(key: str, mode: Mode) -> None:
    """A held mode key is one question, not twenty a second."""
    target = teleop()
    assert feed(target, key, PRESSED) == [mode]
    assert feed(target, key, KeyAction.REPEATED) == []
    assert feed(target, key, RELEASED) == []


def test_standing_and_lying_end_the_motion() -> None:
    """Asked to stand or lie while walking: the velocity ends too, at once."""
    for key in '01':
        target = teleop()
        feed(target, 'i', PRESSED)
        target.step(0.0)
        feed(target, key, PRESSED, 1.0)
        assert target.step(1.0) == ZERO


def test_pose_keys_move_step_by_step() -> None:
    """Each stroke is a step; the opposite key comes back to exactly neutral."""
    target = teleop()
    assert feed(target, 't') == [BodyPose(height=0.005)]
    assert feed(target, 'h', PRESSED) == [BodyPose(height=0.005, roll=0.05)]
    feed(target, 'f')
    feed(target, 'b')
    assert target.pose == NEUTRAL


def test_pose_stays_within_its_limits_and_says_so() -> None:
    """Held at the limit, a key says that it does not go further."""
    target = teleop()
    answers = [feed(target, 'up', KeyAction.REPEATED) for _ in range(20)]
    assert target.pose.pitch == pytest.approx(-0.3)
    assert answers[-1] == ['the body does not go further']
    assert feed(target, 'g') == [NEUTRAL]


def test_leaving_keys() -> None:
    """Ctrl-C, Ctrl-D and Ctrl-backslash quit, Ctrl-Z suspends, the question mark helps."""
    target = teleop()
    for key in ('ctrl+c', 'ctrl+d', 'ctrl+\\'):
        assert feed(target, key) == [ProgramRequest.QUIT]
    assert feed(target, 'ctrl+z') == [ProgramRequest.SUSPEND]
    assert feed(target, '?') == [HELP]


def test_no_key_has_two_meanings() -> None:
    """The tables do not overlap."""
    tables = [set(MOVES), set(SPEEDS), set(MODES), set(POSES), set(NEUTRAL_KEYS), set(STOP_KEYS)]
    assert sum(map(len, tables)) == len(set().union(*tables))


def test_help_fits_the_narrowest_terminal() -> None:
    """79 columns, plain characters."""
    assert HELP.isascii()
    assert max(map(len, HELP.splitlines())) < 80


@pytest.mark.parametrize('quaternion_of', [NEUTRAL, BodyPose(0.01, 0.3, -0.2, 0.1)])
def test_quaternion_is_the_attitude(quaternion_of: BodyPose) -> None:
    """Roll, pitch and yaw come back from the quaternion by the textbook's formulas."""
    x, y, z, w = quaternion_of.quaternion()
    assert math.hypot(x, y, z, w) == pytest.approx(1.0)
    assert math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)) == pytest.approx(
        quaternion_of.roll
    )
    assert math.asin(2 * (w * y - z * x)) == pytest.approx(quaternion_of.pitch)
    assert math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)) == pytest.approx(
        quaternion_of.yaw
    )


@pytest.mark.parametrize(
    ('arguments', 'word'),
    [({'linear': 0.5}, 'speed'), ({'angular': 3.0}, 'turn'), ({'linear': 0.0}, 'speed')],
)
def test_speed_above_its_limit_is_refused(arguments: dict[str, float], word: str) -> None:
    """A start speed that is none, or above its limit, is refused by name."""
    with pytest.raises(SettingError, match=f'^{word} is'):
        Speeds(**arguments)


def test_pose_step_above_its_limit_is_refused() -> None:
    """A step that the limit does not allow is refused by name."""
    with pytest.raises(SettingError, match='angle_step'):
        PoseSteps(angle_step=0.5)
