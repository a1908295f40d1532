# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
import pytest

from operator_input import all_released, HeldKeys, KeyAction, KeyEvent
from operator_input.keyboard import is_local, OVERTAKEN, ReleaseMatcher, WINDOW

KEY_I, KEY_L, KEY_LEFTSHIFT = 23, 38, 42


def typed(key: str, time: float) -> KeyEvent:
    """Make what a terminal without releases says."""
    return KeyEvent(key, KeyAction.TYPED, time)


def actions(events: list[KeyEvent]) -> list[tuple[str, KeyAction]]:
    """Return the actions without their times."""
    return [(event.key, event.action) for event in events]


def test_character_gets_the_release_of_its_key() -> None:
    """Down, character, repeats, up: a press, repeats, and the release at once."""
    matcher = ReleaseMatcher()
    assert matcher.key_down(KEY_I, 1.0) == []
    assert actions(matcher.terminal(typed('i', 1.01))) == [('i', KeyAction.PRESSED)]
    assert actions(matcher.terminal(typed('i', 1.5))) == [('i', KeyAction.REPEATED)]
    assert actions(matcher.key_up(KEY_I, 1.6)) == [('i', KeyAction.RELEASED)]


def test_shift_is_not_taken_for_the_letter() -> None:
    """Shift types nothing: down before or after the letter, it is never the key."""
    matcher = ReleaseMatcher()
    matcher.key_down(KEY_L, 0.5)
    matcher.key_down(KEY_LEFTSHIFT, 0.51)
    matcher.terminal(typed('l', 0.52))
    assert actions(matcher.key_up(KEY_L, 0.6)) == [('l', KeyAction.RELEASED)]
    matcher.key_up(KEY_LEFTSHIFT, 0.7)
    matcher.key_down(KEY_LEFTSHIFT, 1.0)
    matcher.key_down(KEY_I, 1.1)
    assert actions(matcher.terminal(typed('I', 1.1))) == [('I', KeyAction.PRESSED)]
    assert matcher.key_up(KEY_LEFTSHIFT, 1.2) == []
    assert actions(matcher.key_up(KEY_I, 1.3)) == [('I', KeyAction.RELEASED)]


def test_keyboard_report_may_come_after_the_character() -> None:
    """The press follows when the keyboard's word comes a moment later."""
    matcher = ReleaseMatcher()
    assert matcher.terminal(typed('i', 1.0)) == [typed('i', 1.0)]
    late = matcher.key_down(KEY_I, 1.0 + OVERTAKEN / 2)
    assert actions(late) == [('i', KeyAction.PRESSED)]


def test_tap_that_was_over_before_its_character_came() -> None:
    """A slow terminal does not make a tap run on: its end is known."""
    matcher = ReleaseMatcher()
    matcher.key_down(KEY_I, 1.0)
    matcher.key_up(KEY_I, 1.05)
    events = matcher.terminal(typed('i', 1.1))
    assert actions(events) == [('i', KeyAction.PRESSED), ('i', KeyAction.RELEASED)]


def test_character_without_a_key_stays_typed() -> None:
    """Over the network, no key of this machine went down: the time-outs apply."""
    matcher = ReleaseMatcher()
    matcher.key_down(KEY_I, 1.0)
    late = typed('i', 1.0 + WINDOW + 0.01)
    assert matcher.terminal(late) == [late]


def test_focus_lost_forgets_the_match() -> None:
    """After the focus is lost, the key's release belongs to no key, and its character is new."""
    matcher = ReleaseMatcher()
    matcher.key_down(KEY_I, 1.0)
    matcher.terminal(typed('i', 1.0))
    matcher.terminal(all_released(1.1))
    assert matcher.key_up(KEY_I, 1.2) == []


STEPS = st.lists(
    st.tuples(
        st.sampled_from(['down', 'up', 'type']),
        st.sampled_from([(KEY_I, 'i'), (KEY_L, 'l')]),
        st.sampled_from([0.0, 0.01, 0.04, 0.1, 0.3, 0.7]),
    ),
    max_size=40,
)


@given(STEPS)
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
