# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import math
from typing import Any

from hypothesis import given
from hypothesis import strategies as st
import pytest

from operator_input import AutoRepeat, CommandStream, HeldKeys, KeyAction, KeyEvent, ProgramRequest
from quad_teleop import BodyPose, Speeds, Velocity
from quad_teleop.mappings import (
    HELP,
    KeyboardTeleop,
    MODES,
    MOVES,
    NEUTRAL_KEYS,
    POSES,
    Request,
    SPEEDS,
    STOP_KEYS,
)
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


WAYS = {  # as the keys lie
    'u': (V, 0, W), 'i': (V, 0, 0), 'o': (V, 0, -W),
    'j': (0, 0, W), 'l': (0, 0, -W),
    'm': (-V, 0, -W), ',': (-V, 0, 0), '.': (-V, 0, W),
    'U': (V, V, 0), 'I': (V, 0, 0), 'O': (V, -V, 0),
    'J': (0, V, 0), 'L': (0, -V, 0),
    'M': (-V, V, 0), '<': (-V, 0, 0), '>': (-V, -V, 0),
}  # fmt: skip


def test_map_of_teleop_twist_keyboard() -> None:
    """Each key goes where it goes there, and no key has two meanings."""
    for key, way in WAYS.items():
        target = teleop()
        feed(target, key)
        assert target.step(0.0) == Velocity(*way), key
    tables = [set(MOVES), set(SPEEDS), set(MODES), set(POSES), set(NEUTRAL_KEYS), set(STOP_KEYS)]
    assert sum(map(len, tables)) == len(set().union(*tables))
    assert HELP.isascii()
    assert max(map(len, HELP.splitlines())) < 80


@pytest.mark.parametrize(
    ('key', 'requests'),
    [
        *((key, [mode]) for key, mode in MODES.items()),
        *((key, [ProgramRequest.QUIT]) for key in ('ctrl+c', 'ctrl+d', 'ctrl+\\')),
        ('ctrl+z', [ProgramRequest.SUSPEND]),
        ('?', [HELP]),
        ('space', [RobotRequest.STOP]),
        ('k', []),
        ('backspace', [RobotRequest.CLEAR_FAULT]),
    ],
)
def test_keys_that_request_something_do_so_once(key: str, requests: list[Request]) -> None:
    """A held key is one question; where the robot then stands still, the motion ends too."""
    target = teleop()
    feed(target, 'i', PRESSED)
    target.step(0.0)
    assert feed(target, key, PRESSED, 1.0) == requests
    assert feed(target, key, KeyAction.REPEATED, 1.1) == []
    assert feed(target, key, RELEASED, 1.2) == []
    goes_on = key == '?' or (key in MODES and MODES[key].moves)
    assert target.step(1.2) == (Velocity(V) if goes_on else ZERO)


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


@pytest.mark.parametrize(
    'key', ['s', 'p', 'enter', 'escape', 'f5', 'ctrl+a', 'ш', *sorted(STOP_KEYS)]
)
def test_any_other_key_stops(key: str) -> None:
    """A person who hits anything in fright stops the robot; when idle, it stays silent.

    A stop key says zero even then: something else may be driving the robot.
    """
    target = teleop()
    assert feed(target, key) == [RobotRequest.STOP] * (key == 'space')
    assert published(target, 0.0, 1.0) == [ZERO] * 3 * (key in STOP_KEYS)
    feed(target, 'i', PRESSED, 2.0)
    target.step(2.0)
    feed(target, key, TYPED, 3.0)
    assert target.step(3.0) == ZERO


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


def test_speed_keys_change_the_motion_that_goes_on() -> None:
    """Q and z change both by 10 %, w and x the linear one, e and c the angular one."""
    target = teleop()
    feed(target, 'o', PRESSED)
    target.step(0.0)
    for key, linear, angular in (
        ('q', 1.1, 1.1), ('z', 0.99, 0.99), ('x', 0.891, 0.99), ('c', 0.891, 0.891),
        ('w', 0.9801, 0.891), ('e', 0.9801, 0.9801),
    ):  # fmt: skip
        feed(target, key, PRESSED, 0.01)
        speeds = target.speeds
        assert (speeds.linear, speeds.angular) == pytest.approx((V * linear, W * angular)), key
        assert target.step(0.01) == Velocity(speeds.linear, 0.0, -speeds.angular), key


@given(st.lists(st.sampled_from(sorted(SPEEDS)), max_size=80))
def test_speeds_stay_within_their_limits(keys: list[str]) -> None:
    """However often: not above the limits, and never so slow that it is stuck at zero."""
    target = teleop()
    for key in keys:
        before = target.speeds
        assert bool(feed(target, key)) is (target.speeds == before), 'a limit is reported'
    assert 0.01 <= target.speeds.linear <= target.speeds.linear_limit
    assert 0.01 <= target.speeds.angular <= target.speeds.angular_limit


def test_pose_keys_move_step_by_step() -> None:
    """Each stroke is a step; the opposite key comes back to exactly neutral.

    Held at the limit, a key says that it does not go further.
    """
    target = teleop()
    assert feed(target, 't') == [BodyPose(height=0.005)]
    assert feed(target, 'h', PRESSED) == [BodyPose(height=0.005, roll=0.05)]
    feed(target, 'f')
    feed(target, 'b')
    assert target.pose == NEUTRAL
    answers = [feed(target, 'up', KeyAction.REPEATED) for _ in range(20)]
    assert target.pose.pitch == pytest.approx(-0.3)
    assert answers[-1] == ['the body does not go further']
    assert feed(target, 'g') == [NEUTRAL]
