# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
import pytest

from operator_input.terminal.liveness import Liveness, PERIOD, TIMEOUT
from operator_input.terminal.negotiation import KittyNegotiation, POP, PUSH, QUERY, Stage
from operator_input.terminal.reports import Kitty, Report, ReportKind

ATTRIBUTES = Report(ReportKind.DEVICE_ATTRIBUTES)
ALL = Kitty(31)


def flags(value: Kitty | int) -> Report:
    """Answer the question for the flags."""
    return Report(ReportKind.KITTY_FLAGS, Kitty(value))


def test_terminal_with_the_protocol() -> None:
    """It is switched on after the first answer, confirmed by the second, and taken back."""
    negotiation = KittyNegotiation()
    assert negotiation.start() == QUERY
    assert negotiation.take(flags(0)) == PUSH + QUERY
    assert negotiation.take(ATTRIBUTES) == ''
    stages = [negotiation.stage]
    assert negotiation.take(flags(ALL)) == ''
    assert [*stages, negotiation.stage] == [Stage.PUSHED, Stage.ACTIVE]
    assert negotiation.take(ATTRIBUTES) == ''
    assert not negotiation.is_waiting
    assert negotiation.stop() == POP


def test_terminal_without_the_protocol() -> None:
    """Nothing is switched on, nothing is taken back."""
    negotiation = KittyNegotiation()
    negotiation.start()
    assert negotiation.take(ATTRIBUTES) == ''
    assert negotiation.stage is Stage.ABSENT
    assert negotiation.stop() == ''


@pytest.mark.parametrize('got', [Kitty.DISAMBIGUATE, Kitty.EVENT_TYPES, Kitty.ALL_KEYS])
def test_half_a_protocol_is_none(got: Kitty) -> None:
    """A terminal that does not report the releases of letters gets the protocol switched off."""
    negotiation = KittyNegotiation()
    negotiation.start()
    negotiation.take(flags(0))
    negotiation.take(ATTRIBUTES)
    assert negotiation.take(flags(got)) == POP
    assert negotiation.stage is Stage.ABSENT


def test_terminal_that_stops_answering_the_flags() -> None:
    """Both attributes without the second flags: taken back."""
    negotiation = KittyNegotiation()
    negotiation.start()
    negotiation.take(flags(0))
    negotiation.take(ATTRIBUTES)
    assert negotiation.take(ATTRIBUTES) == POP
    assert negotiation.stage is Stage.ABSENT


REPORTS = st.one_of(
    st.integers(0, 31).map(flags), st.just(ATTRIBUTES), st.just(Report(ReportKind.STATUS))
)


@given(st.lists(REPORTS, max_size=12))
def test_every_push_is_popped(reports: list[Report]) -> None:
    """Whatever a terminal answers, in the end nothing is left switched on, nor taken twice."""
    negotiation = KittyNegotiation()
    written = negotiation.start()
    for report in reports:
        written += negotiation.take(report)
    written += negotiation.stop()
    assert written.count(PUSH) == written.count(POP)
    assert written.count(PUSH) <= 1


def test_silent_terminal_is_lost() -> None:
    """A terminal that answers no probe is given up after the time-out, and not before."""
    liveness = Liveness()
    assert liveness.probe_due(10.0)
    assert not liveness.probe_due(10.0 + PERIOD / 2)
    assert not liveness.is_lost(10.0 + TIMEOUT)
    assert liveness.is_lost(10.1 + TIMEOUT)


def test_sign_of_life_resets_the_timeout() -> None:
    """Any byte from the terminal counts."""
    liveness = Liveness()
    now = 10.0
    for _ in range(100):
        assert liveness.probe_due(now)
        liveness.received()
        now += PERIOD
        assert not liveness.is_lost(now)
