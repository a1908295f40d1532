# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A held button of a page."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from robot_viewer.page.live import Deadman, HEARTBEAT, RELEASED_AFTER


def test_a_held_button_counts_from_the_first_heartbeat_on() -> None:
    """Each one, as the browser's timer makes them."""
    deadman = Deadman()
    assert all(deadman.beat(1, 'hold', 10.0 + number * HEARTBEAT) for number in range(50))


@given(st.integers(2, 200), st.floats(0.0, 60.0))
def test_what_was_held_up_counts_once(count: int, delay: float) -> None:
    """A slow connection delivers it at once, when the button may be up already."""
    deadman = Deadman()
    assert deadman.beat(1, 'hold', 10.0)
    arrivals = [10.0 + HEARTBEAT + delay + number * 1e-4 for number in range(count)]
    assert sum(deadman.beat(1, 'hold', arrival) for arrival in arrivals) == 1


@given(st.lists(st.tuples(st.integers(1, 3), st.floats(0.0, 1.0), st.booleans()), max_size=60))
def test_one_page_at_a_time(steps: list[tuple[int, float, bool]]) -> None:
    """The first that holds has control; another takes it, while nothing is held."""
    deadman, now, holder, last = Deadman(), 10.0, 0, -1.0
    for number, (page, gap, takes) in enumerate(steps):
        now += gap
        button = 'hold' if page == holder else number  # one that was refused is pressed anew
        if takes:
            holder = page if now - last >= RELEASED_AFTER else holder
            assert deadman.take(page, now) is (holder == page)
        elif deadman.beat(page, button, now):
            assert page == (holder or page)
            holder = page
        if not takes and page == holder:
            last = now
        assert deadman.holder == (holder or None)


def test_a_page_that_is_closed_has_no_control() -> None:
    """Another one has it with its first heartbeat."""
    deadman = Deadman()
    assert deadman.beat(1, 'hold', 10.0)
    assert not deadman.beat(2, 'hold', 20.0)
    deadman.leave(1)
    assert not deadman.beat(2, 'hold', 20.1)  # it was refused: under a finger that waits
    deadman.release(2, 'hold', 20.2)
    assert deadman.beat(2, 'hold', 20.3)


def test_a_press_that_may_not_move_anything_has_to_be_made_anew() -> None:
    """What it was refused for may end while it is held."""
    deadman = Deadman()
    deadman.bar(1, 'hold')
    assert not deadman.beat(1, 'hold', 10.0)
    deadman.release(1, 'hold', 10.1)
    assert deadman.beat(1, 'hold', 10.2)


@given(
    st.integers(1, 90),
    st.lists(st.tuples(st.sampled_from([1, 2]), st.floats(HEARTBEAT, 9.0)), max_size=60),
)
def test_after_a_stop_a_button_has_to_be_pressed_anew(
    before: int, beats: list[tuple[int, float]]
) -> None:
    """Whatever the pauses of its heartbeats, which a stalled page makes, too."""
    deadman, now = Deadman(), 10.0
    for _ in range(before):
        now += HEARTBEAT
        deadman.beat(1, 'hold', now)
        deadman.beat(2, 'hold', now)
    deadman.stop()
    for page, gap in beats:
        now += gap
        assert not deadman.beat(page, 'hold', now)
    assert deadman.release(1, 'hold', now)
    assert not deadman.release(2, 'hold', now)
    assert deadman.beat(1, 'hold', now + RELEASED_AFTER)
    assert not deadman.beat(2, 'hold', now + RELEASED_AFTER)


def test_a_button_that_nobody_held_counts_after_a_stop_at_once() -> None:
    """It was let go before; what is late of it does not count."""
    deadman = Deadman()
    assert deadman.beat(1, 'hold', 10.0)
    deadman.release(1, 'hold', 10.1)
    assert not deadman.beat(1, 'hold', 10.1 + 0.1 * HEARTBEAT)
    deadman.stop()
    assert deadman.beat(1, 'hold', 11.0)


def test_a_button_that_was_taken_off_the_page_bars_no_other() -> None:
    """Its page cannot let it go any more; the one that came in its place was never held."""
    deadman = Deadman()
    assert deadman.beat(1, 'hold', 10.0)
    deadman.stop()
    assert not deadman.beat(1, 'hold', 11.0)
    assert deadman.beat(1, 'its successor', 11.0)


def test_a_press_whose_work_has_ended_is_held_no_more() -> None:
    """Its heartbeats go on under a finger that has not seen it; it has to be pressed anew."""
    deadman = Deadman()
    assert deadman.beat(1, 'hold', 10.0)
    deadman.end('another')
    assert deadman.held(10.0)
    deadman.end('hold')
    assert not deadman.held(10.0)
    assert not deadman.beat(1, 'hold', 10.1)
    deadman.release(1, 'hold', 10.2)
    assert deadman.beat(1, 'hold', 10.3)
