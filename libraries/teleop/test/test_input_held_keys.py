# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st
import pytest

from operator_input import all_released, AutoRepeat, HeldKeys, KeyAction, KeyEvent
from operator_input.keyboard import is_local, OVERTAKEN, ReleaseMatcher, WINDOW

KEY_I, KEY_L, KEY_LEFTSHIFT = 23, 38, 42


def typed(key: str, time: float) -> KeyEvent:
    """Make what a terminal without releases says."""
    return KeyEvent(key, KeyAction.TYPED, time)


SIGNS = dict(zip(
    (KeyAction.PRESSED, KeyAction.REPEATED, KeyAction.RELEASED, KeyAction.TYPED), '+=-?',
    strict=True,
)) | {KeyAction.ALL_RELEASED: '*'}  # fmt: skip


@pytest.mark.parametrize(
    'story',
    [
        # down, character, repeats, up: a press, repeats, and the release at once
        '0.0 down i, 0.01 type i: +i, 0.5 type i: =i, 0.6 up i: -i',
        # Shift types nothing: down before or after the letter, it is never the key
        '0.0 down l, 0.01 down shift, 0.02 type l: +l, 0.1 up l: -l, 0.2 up shift',
        '0.0 down shift, 0.1 down i, 0.1 type I: +I, 0.2 up shift, 0.3 up i: -I',
        # the press follows when the keyboard's word comes a moment later
        f'0.0 type i: ?i, {OVERTAKEN / 2} down i: +i',
        # a slow terminal does not make a tap run on: its end is known
        '0.0 down i, 0.05 up i, 0.1 type i: +i -i',
        # over the network, no key of this machine went down: the time-outs apply
        f'0.0 down i, {WINDOW + 0.01} type i: ?i',
        # after the focus is lost, the key's release belongs to no key
        '0.0 down i, 0.0 type i: +i, 0.1 leave all: *, 0.2 up i',
    ],
)
def test_a_character_gets_the_release_of_its_key(story: str) -> None:
    """What the terminal and the keyboard report, and the keys that both are together."""
    matcher = ReleaseMatcher()
    codes = {'i': KEY_I, 'l': KEY_L, 'shift': KEY_LEFTSHIFT}
    for entry in story.split(', '):
        report, _, keys = entry.partition(':')
        time, kind, key = report.split()
        if kind == 'leave':
            events = matcher.terminal(all_released(float(time)))
        elif kind == 'type':
            events = matcher.terminal(typed(key, float(time)))
        else:
            change = matcher.key_down if kind == 'down' else matcher.key_up
            events = change(codes[key], float(time))
        assert [f'{SIGNS[event.action]}{event.key}' for event in events] == keys.split(), entry


RELEASE_STEPS = st.lists(
    st.tuples(
        st.sampled_from(['down', 'up', 'type']),
        st.sampled_from([(KEY_I, 'i'), (KEY_L, 'l')]),
        st.sampled_from([0.0, 0.01, 0.04, 0.1, 0.3, 0.7]),
    ),
    max_size=40,
)


@given(RELEASE_STEPS)
def test_all_keys_up_and_time_passed_means_stopped(
    steps: list[tuple[str, tuple[int, str], float]],
) -> None:
    """Whatever both sources report, and in whatever order: all up, and a second later nothing."""
    matcher, held, now = ReleaseMatcher(), HeldKeys(), 0.0
    for kind, (code, key), gap in steps:
        now += gap
        if kind == 'type':
            events = matcher.terminal(typed(key, now))
        else:
            events = (matcher.key_down if kind == 'down' else matcher.key_up)(code, now)
        for event in events:
            held.feed(event)
    for code in (KEY_I, KEY_L):
        for event in matcher.key_up(code, now):
            held.feed(event)
    assert held.current(now + 1.1) is None


@pytest.mark.parametrize(
    ('environment', 'tmux', 'local'),
    [
        ({}, '', True),
        ({'SSH_CONNECTION': '10.0.0.1 1 10.0.0.2 22'}, '', False),
        ({'SSH_TTY': '/dev/pts/1'}, '', False),
        ({'TMUX': '/tmp/tmux,1,0'}, '-SSH_CONNECTION\n', True),
        ({'TMUX': '/tmp/tmux,1,0'}, 'SSH_CONNECTION=10.0.0.1 1 10.0.0.2 22\n', False),
        ({'TMUX': '/tmp/tmux,1,0', 'SSH_TTY': '/dev/pts/1'}, '-SSH_CONNECTION\n', True),
        ({'TMUX': '/tmp/tmux,1,0'}, '', False),
        ({'STY': '1.pts'}, '', False),
    ],
)
def test_only_a_person_at_this_machine_is_local(
    environment: dict[str, str], tmux: str, local: bool
) -> None:
    """SSH is not local; inside tmux what counts is who is attached now; unknown is not local."""
    assert is_local(environment, lambda: tmux) is local


KEYS = 'ijkl'
STEPS = st.lists(
    st.tuples(
        st.sampled_from(KEYS),
        st.sampled_from(KeyAction),
        st.sampled_from([0.0, 0.02, 0.03, 0.05, 0.1, 0.15, 0.3, 0.5, 0.66, 1.5]),
    ),
    max_size=60,
)
ACTIONS = {
    'press': KeyAction.PRESSED,
    'type': KeyAction.TYPED,
    'repeat': KeyAction.REPEATED,
    'release': KeyAction.RELEASED,
}


def fed(text: str) -> tuple[HeldKeys, AutoRepeat]:
    """Feed events written as ``time action key``, separated by commas."""
    auto_repeat = AutoRepeat()
    keys = HeldKeys(auto_repeat)
    for entry in text.split(','):
        time, action, key = entry.split()
        keys.feed(KeyEvent(key, ACTIONS[action], float(time)))
    return keys, auto_repeat


@given(STEPS)
def test_typed_keys_are_up_after_the_longest_time_out(
    steps: list[tuple[str, KeyAction, float]],
) -> None:
    """Without a pressed key everything stops, however characters came, within a known time."""
    auto_repeat = AutoRepeat()
    keys, now = HeldKeys(auto_repeat), 100.0
    for key, action, gap in steps:
        now += gap
        keys.feed(KeyEvent(key, action, now))
    for key in KEYS:
        keys.feed(KeyEvent(key, KeyAction.RELEASED, now))
    assert keys.current(now) is None or now < keys.deadline(now) < math.inf
    assert keys.current(now + auto_repeat.longest) is None
    assert keys.deadline(now + auto_repeat.longest) == math.inf


@given(STEPS)
def test_released_key_is_never_current(steps: list[tuple[str, KeyAction, float]]) -> None:
    """What was released, or all released, does not move anything until it is struck again."""
    keys, now, up = HeldKeys(), 0.0, set(KEYS)
    for key, action, gap in steps:
        now += gap
        keys.feed(KeyEvent(key, action, now))
        if action is KeyAction.ALL_RELEASED:
            up = set(KEYS)
        elif action is KeyAction.RELEASED:
            up.add(key)
        elif action is not KeyAction.REPEATED:
            up.discard(key)
        assert not up & set(keys.held(now))


@given(STEPS)
def test_there_is_one_command_and_one_typed_key_at_most(
    steps: list[tuple[str, KeyAction, float]],
) -> None:
    """The newest struck key is the current one; typed keys never add up."""
    keys, now, pressed = HeldKeys(), 0.0, set[str]()
    for key, action, gap in steps:
        now += gap
        keys.feed(KeyEvent(key, action, now))
        if action is KeyAction.PRESSED:
            pressed.add(key)
        elif action is KeyAction.RELEASED:
            pressed.discard(key)
        elif action is KeyAction.ALL_RELEASED:
            pressed.clear()
        held = keys.held(now)
        assert len(held) == len(set(held))
        assert len(set(held) - pressed) <= 1
        if action is KeyAction.PRESSED or (action is KeyAction.TYPED and key not in pressed):
            assert keys.current(now) == key
        assert keys.current(now) == (held[-1] if held else None)


@pytest.mark.parametrize(
    ('events', 'time', 'key'),
    [
        # one character holds for the delay of the repeat
        ('0 type i', 0.49, 'i'),
        ('0 type i', 0.5, None),
        # repeats hold for a much shorter time
        ('0 type i, 0.4 type i, 0.43 type i', 0.57, 'i'),
        ('0 type i, 0.4 type i, 0.43 type i', 0.58, None),
        # where releases are known, the key below the newest takes over when that goes up
        ('0 press i, 1 press l', 1.0, 'l'),
        ('0 press i, 1 press l, 2 release l', 2.0, 'i'),
    ],
)
def test_what_is_held(events: str, time: float, key: str | None) -> None:
    """A typed key times out in two stages; one that was pressed is held until its release."""
    assert fed(events)[0].current(time) == key


TAPS = '0 type i, 0.3 type i, 0.6 type i, 0.75 type i, 1.1 type i, 1.3 type i'


@pytest.mark.parametrize(
    ('events', 'least', 'most'),
    [
        ('0 type i, 0.66 type i, 0.69 type i, 0.72 type i', 0.66, 0.8),
        ('0 type i, 0.25 type i, 0.28 type i, 0.31 type i', 0.25, 0.35),
        (TAPS, AutoRepeat().first, AutoRepeat().first),
    ],
)
def test_repeat_delay_of_the_keyboard_is_learned(events: str, least: float, most: float) -> None:
    """A slow one stutters once only, a tap ends after a fast one; taps teach nothing."""
    keys, auto_repeat = fed(events)
    assert least <= auto_repeat.first <= most
    keys.feed(KeyEvent('i', KeyAction.TYPED, 5.0))
    assert keys.current(5.0 + least - 1e-3) == 'i'
    assert keys.current(5.0 + auto_repeat.first) is None


def test_second_tap_within_the_delay_gets_the_long_time_out() -> None:
    """Once the delay is known, tap-and-hold does not stutter."""
    keys, auto_repeat = fed(
        '0 type i, 0.5 type i, 0.53 type i, 0.56 type i, 5 type i, 5.25 type i'
    )
    assert keys.current(5.25 + auto_repeat.first - 0.01) == 'i'


@pytest.mark.parametrize(('first', 'repeat'), [(0.1, 0.2), (0.5, 0.0), (0.0, 0.0)])
def test_senseless_time_outs_are_refused(first: float, repeat: float) -> None:
    """A second stage that is longer than the first, or none at all, is an error of the caller."""
    with pytest.raises(ValueError, match='time-outs'):
        AutoRepeat(first, repeat)
