# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Laws of the gate: nothing older than a stop passes, no stream goes on after it."""

from __future__ import annotations

from itertools import pairwise
import math
import threading

from hypothesis import example, given, settings
from hypothesis import strategies as st
import pytest

from robot_primitives import StreamGate, StreamRules

CHANNELS = ('jog', 'target', 'trajectory')
GONE, LET_GO, TOGETHER, MARGIN, ASK = 10.0, 2.0, 1.0, 0.2, 5.0
JOG = StreamRules('release first')
TOPIC = StreamRules('send none', together=TOGETHER, let_go=GONE, gone_after=GONE, begin_margin=ASK)
PAUSES = st.floats(0.0, GONE - 0.1)


def gate() -> StreamGate[str]:
    """Return a gate with both kinds of streams."""
    return StreamGate(CHANNELS, {'jog': JOG, 'trajectory': TOPIC})


Event = tuple[str, str, int]  # kind, channel, and which of the commands requested so far

EVENTS = st.lists(
    st.tuples(
        st.sampled_from(['request', 'request', 'check', 'check', 'stop', 'newer', 'interrupt']),
        st.sampled_from(CHANNELS),
        st.integers(0, 30),
    ),
    max_size=60,
)


@given(EVENTS)
@example([('request', 'jog', 0), ('stop', 'jog', 0), ('request', 'jog', 0), ('check', 'jog', 0)])
@example([('request', 'jog', 0), ('interrupt', 'jog', 0), ('check', 'jog', 0)])
def test_no_command_that_is_older_than_a_stop_ever_passes(events: list[Event]) -> None:
    """Whatever the interleaving; what was requested after the stop passes, on each channel."""
    gate_, numbers = gate(), list[int]()
    voided: dict[tuple[str, int], bool] = {}
    for kind, channel, which in events:
        before = list(range(len(numbers)))
        if kind == 'request':
            numbers.append(gate_.number())
            continue
        if kind == 'interrupt':
            gate_.interrupt('halted', 0.0)
            voided |= {(each, older): True for each in CHANNELS for older in before}
        elif kind == 'stop':
            gate_.stop([channel], 'stopped')
            voided |= {(channel, older): True for older in before}
        elif kind == 'newer' and numbers:
            newer = which % len(numbers)
            gate_.stop([channel], 'a jog took over', numbers[newer])
            voided |= {(channel, older): True for older in before[:newer]}
        for older in before:
            refusal = gate_.refusal(channel, numbers[older])
            assert bool(refusal) == ((channel, older) in voided)
            assert not refusal or refusal.startswith('stopped before it had begun: ')
    assert all(first < last for first, last in pairwise(numbers))


@settings(max_examples=20, deadline=None)
@given(st.integers(1, 4), st.integers(1, 40))
def test_a_stop_counts_from_its_call_in_any_thread(threads: int, commands: int) -> None:
    """A command whose number was taken before the call is refused once the call has returned."""
    gate_ = gate()
    begun, stopped = threading.Barrier(threads + 1), threading.Event()
    passed: list[int] = []
    taken: list[int] = []

    def request() -> None:
        begun.wait()
        numbers = []
        for _ in range(commands):
            numbers.append(gate_.number())
            if not stopped.is_set():
                taken.append(numbers[-1])
        stopped.wait()
        passed.extend(each for each in numbers if not gate_.refusal('jog', each))

    workers = [threading.Thread(target=request) for _ in range(threads)]
    for each in workers:
        each.start()
    begun.wait()
    before = gate_.number()
    gate_.stop(['jog'], 'stopped')
    stopped.set()
    for each in workers:
        each.join()
    assert gate_.refusal('jog', before)
    assert all(each > before for each in passed)


@given(st.floats(0.0, LET_GO), st.lists(PAUSES, max_size=20))
def test_no_pause_lets_a_jog_go_on(before: float, pauses: list[float]) -> None:
    """Whatever the pauses after the stop, and short ones before; a release does."""
    gate_, now = gate(), 100.0
    assert gate_.command('jog', 'stick', now) == ''
    now += before
    gate_.interrupt('halted', now)
    for pause in pauses:
        now += min(pause, GONE - LET_GO - 0.1)
        assert gate_.command('jog', 'stick', now) == 'halted; release first'
    assert gate_.command('jog', 'another', now) == ''
    gate_.release('jog', 'stick')
    assert gate_.command('jog', 'stick', now) == ''


@given(PAUSES, st.lists(PAUSES, max_size=20))
def test_no_pause_lets_a_stream_of_requests_go_on(before: float, pauses: list[float]) -> None:
    """Only silence with a person's request, or one so long that the sender is gone."""
    gate_, now = gate(), 100.0
    for _ in range(2):
        assert gate_.command('trajectory', 'topic', now) == ''
    last = now
    now += before
    gate_.interrupt('halted', now)
    for pause in pauses:
        now = max(now, last + pause)
        last = now
        assert gate_.command('trajectory', 'topic', now) == 'halted; send none'
        gate_.renew('trajectory', now, TOGETHER)  # it has just come
    assert gate_.command('trajectory', 'topic', now + GONE + 0.1) == ''


@pytest.mark.parametrize(('pause', 'ended'), [(0.9, True), (1.1, False)])
def test_single_requests_are_no_stream(pause: float, ended: bool) -> None:
    """Two that follow each other quickly are."""
    gate_ = gate()
    gate_.command('trajectory', 'topic', 1.0)
    gate_.command('trajectory', 'topic', 1.0 + pause)
    gate_.interrupt('halted', 3.0)
    assert bool(gate_.command('trajectory', 'topic', 3.1)) is ended


@pytest.mark.parametrize(
    ('channel', 'silence', 'is_let_in'),
    [('jog', -math.inf, True), ('trajectory', TOGETHER, True), ('trajectory', 2.0, False)],
)
def test_a_person_lets_everyone_in(channel: str, silence: float, is_let_in: bool) -> None:
    """A client that cannot release needs that; of the others only streams that are silent."""
    gate_ = gate()
    for now in (1.0, 1.1):
        gate_.command(channel, 'client', now)
    gate_.interrupt('halted', 1.2)
    gate_.renew(channel, 3.0, silence)
    assert (gate_.command(channel, 'client', 3.1) == '') is is_let_in


@given(st.floats(0.0, 7.0))
def test_silence_counts_from_when_a_command_has_expired(lasts: float) -> None:
    """A command that counts for long moves the robot for as long."""
    for late, held in ((-0.1, True), (0.1, False)):
        gate_ = gate()
        gate_.command('jog', 'keys', 1.0, 1.0 + lasts)
        gate_.interrupt('halted', 1.0 + lasts + LET_GO + late)
        assert bool(gate_.command('jog', 'keys', 1.0 + lasts + LET_GO + 0.2)) is held


def test_long_silence_is_letting_go() -> None:
    """A program that ended without a release, and begins another day."""
    gate_ = gate()
    gate_.command('jog', 'keys', 1.0)
    gate_.interrupt('halted', 1.1)
    assert gate_.command('jog', 'keys', 1.2)
    gate_.begin('begun', 1.3 + GONE)
    assert gate_.command('jog', 'keys', 1.3 + GONE) == ''


@given(st.floats(0.0, 1.0).filter(lambda ahead: abs(ahead - MARGIN) > 1e-9))
def test_a_robot_that_begins_to_follow_moves_for_a_new_jog_only(ahead: float) -> None:
    """The jog that gets the drives back is some cycles older than that."""
    gate_ = gate()
    gate_.command('jog', 'stick', 100.0)
    number = gate_.number()
    gate_.command('jog', 'stick', 100.0 + ahead)
    gate_.begin('begun', 100.0 + ahead)
    is_old = ahead > MARGIN
    assert bool(gate_.command('jog', 'stick', 100.0 + ahead)) is is_old
    assert bool(gate_.refusal('jog', number)) is is_old
    assert gate_.refusal('trajectory', number) == ''


def test_who_asks_for_the_robot_for_a_stream_counts_once() -> None:
    """The next time it begins to follow, it was for somebody else."""
    gate_ = gate()
    for _ in range(2):
        gate_.command('trajectory', 'topic', 1.0)
        gate_.ask('trajectory', 'topic', 1.0)
    gate_.begin('begun', 1.1)
    assert gate_.command('trajectory', 'topic', 1.1) == ''
    gate_.ask('trajectory', 'topic', 1.2)
    gate_.ask('trajectory', 'topic', -math.inf)  # there was nothing to ask for
    gate_.begin('begun', 1.3)
    assert gate_.command('trajectory', 'topic', 1.3) == 'begun; send none'
