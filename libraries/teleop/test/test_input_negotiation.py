# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
import pytest

from operator_input.key_decoder import Kitty, Report, ReportKind
from operator_input.terminal import (
    POP,
    PUSH,
    Stage,
    TerminalDialogue,
)

ATTRIBUTES = Report(ReportKind.DEVICE_ATTRIBUTES)
ALL = Kitty(31)


def flags(value: Kitty | int) -> Report:
    """Answer the question for the flags."""
    return Report(ReportKind.KITTY_FLAGS, Kitty(value))


@pytest.mark.parametrize('got', [Kitty.DISAMBIGUATE, Kitty.EVENT_TYPES, Kitty.ALL_KEYS])
def test_half_a_protocol_is_none(got: Kitty) -> None:
    """A terminal that does not report the releases of letters gets the protocol switched off."""
    dialogue = TerminalDialogue()
    dialogue.start()
    dialogue.take(flags(0))
    dialogue.take(ATTRIBUTES)
    assert dialogue.take(flags(got)) == POP
    assert dialogue.stage is Stage.ABSENT


REPORTS = st.one_of(
    st.integers(0, 31).map(flags), st.just(ATTRIBUTES), st.just(Report(ReportKind.STATUS))
)


@given(st.lists(REPORTS, max_size=12))
def test_every_push_is_popped(reports: list[Report]) -> None:
    """Whatever a terminal answers, in the end nothing is left switched on, nor taken twice."""
    dialogue = TerminalDialogue()
    written = dialogue.start()
    for report in reports:
        written += dialogue.take(report)
    written += dialogue.stop()
    assert written.count(PUSH) == written.count(POP)
    assert written.count(PUSH) <= 1
