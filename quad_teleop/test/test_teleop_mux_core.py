# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st
import pytest

from quad_teleop import CommandError
from quad_teleop.mux import Input, Inputs, Multiplexer

FORWARD = (0.1, 0.0, 0.0, 0.0, 0.0, 0.0)
STILL = (0.0,) * 6
NAVIGATION, KEYBOARD = 'navigation', 'keyboard'


def mux(*locks: Input) -> Multiplexer:
    """Make one with a planner below a keyboard."""
    sources = (Input(KEYBOARD, 'key_vel', 0.5, 90), Input(NAVIGATION, 'nav_vel', 0.5, 10))
    return Multiplexer(Inputs(sources, locks))


def test_source_that_falls_silent_is_stopped_once() -> None:
    """The robot does not go on until its own time-out: one zero; none after its own zero."""
    target = mux()
    target.velocity(KEYBOARD, FORWARD, 0.0)
    assert not target.zero_due(0.5)
    assert target.zero_due(0.51)
    assert not target.zero_due(0.6)
    target.velocity(KEYBOARD, FORWARD, 1.0)
    target.velocity(KEYBOARD, STILL, 1.1)
    assert not target.zero_due(5.0)


def test_lock_with_a_time_out_closes_by_silence() -> None:
    """A heartbeat that stops locks, and so does one that was never received."""
    target = mux(Input('heartbeat', 'heartbeat', 1.0, 255))
    assert not target.velocity(KEYBOARD, FORWARD, 0.0)
    target.lock('heartbeat', False, 1.0)
    assert target.velocity(KEYBOARD, FORWARD, 1.5)
    assert not target.velocity(KEYBOARD, FORWARD, 2.1)
    assert target.zero_due(2.1)


def test_source_without_a_time_out_keeps_its_place() -> None:
    """Time-out 0 never expires, but only once the source was received at all.

    Of two with the same priority the first by name is forwarded: it is always the same one.
    """
    sources = (Input('a', 'a', 0.0, 50), Input('b', 'b', 0.5, 50), Input('c', 'c', 0.5, 50))
    target = Multiplexer(Inputs(sources, locks=()))
    assert target.velocity('c', FORWARD, 0.0)
    assert target.velocity('b', FORWARD, 0.1)
    assert not target.velocity('c', FORWARD, 0.2)
    assert target.velocity('a', FORWARD, 1.0)
    assert not target.velocity('b', FORWARD, 1e6)
    assert not target.zero_due(1e6)


@pytest.mark.parametrize('number', [math.nan, -math.inf])
def test_no_number_is_refused(number: float) -> None:
    """NaN is not forwarded, is reported, and does not block other sources."""
    target = mux()
    with pytest.raises(CommandError, match='keyboard sends'):
        target.velocity(KEYBOARD, (number, *STILL[1:]), 0.0)
    assert target.velocity(NAVIGATION, FORWARD, 0.1)


STEPS = st.lists(
    st.tuples(
        st.sampled_from([KEYBOARD, NAVIGATION, 'pause', 'tick']),
        st.booleans(),
        st.sampled_from([0.0, 0.05, 0.2, 0.49, 0.51, 2.0]),
    ),
    max_size=60,
)


@given(STEPS)
def test_robot_is_never_left_moving(steps: list[tuple[str, bool, float]]) -> None:
    """Whatever comes: when all fall silent, the last word to the robot is zero."""
    target, now, moving = mux(Input('pause', 'pause', 0.0, 50)), 0.0, False
    for name, switch, gap in steps:
        now += gap
        if name == 'pause':
            target.lock(name, switch, now)
        elif name != 'tick' and target.velocity(name, FORWARD if switch else STILL, now):
            moving = switch
        if target.zero_due(now):
            moving = False
    if target.zero_due(now + 1.0):
        moving = False
    assert not moving


@given(STEPS)
def test_lower_priority_never_overrules(steps: list[tuple[str, bool, float]]) -> None:
    """The planner is not forwarded while the keyboard spoke within its time-out, or locked."""
    target, now, spoke, locked = mux(Input('pause', 'pause', 0.0, 50)), 0.0, -math.inf, False
    for name, switch, gap in steps:
        now += gap
        if name == 'pause':
            locked = switch
            target.lock(name, switch, now)
        elif name == KEYBOARD:
            spoke = now
            assert target.velocity(name, FORWARD, now)
        elif name == NAVIGATION:
            assert target.velocity(name, FORWARD, now) == (not locked and now - spoke > 0.5)
