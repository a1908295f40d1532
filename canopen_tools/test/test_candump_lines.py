# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Lines of candump: columns, times and colours."""

from __future__ import annotations

import re

import pytest

from arm_canopen.can import Frame
from canopen_tools.monitor import Description, FrameKind
from canopen_tools.monitor.line_format import LineFormat, TimeStyle

SAID = Description(FrameKind.PDO, 'TPDO1', 'joint1', 'Statusword=0')
OFFSET = 1_700_000_000.0  # [s]


def lines(style: TimeStyle, *stamps: float) -> list[str]:
    """Format frames of these times."""
    formatted = LineFormat(style, OFFSET)
    return [formatted.line(Frame(0x181, b'\x27\x06', stamp), SAID) for stamp in stamps]


@pytest.mark.parametrize(
    ('style', 'times'),
    [
        (
            TimeStyle.ABSOLUTE,
            ['(1700000010.500000) ', '(1700000010.750000) ', '(1700000012.000000) '],
        ),
        (TimeStyle.ZERO, ['(0000.000000) ', '(0000.250000) ', '(0001.500000) ']),
        (TimeStyle.DELTA, ['(0000.000000) ', '(0000.250000) ', '(0001.250000) ']),
        (TimeStyle.NONE, ['', '', '']),
    ],
)
def test_time_styles(style: TimeStyle, times: list[str]) -> None:
    """Times are absolute, since the first line, since the line before, or left out."""
    texts = lines(style, 10.5, 10.75, 12.0)
    rest = '     181  [2]  27 06                    TPDO1      joint1     Statusword=0'
    assert texts == [time + rest for time in times]


def test_the_date_is_local_time() -> None:
    """Date and time to the microsecond, whatever the time zone."""
    (text,) = lines(TimeStyle.DATE, 0.25)
    assert re.match(r'\(2023-11-1[3-5] \d\d:\d\d:20\.250000\) ', text)


def test_29_bits_and_remote_requests_have_their_columns() -> None:
    """The columns stay where they are for every kind of frame."""
    formatted = LineFormat(TimeStyle.NONE, 0.0)
    extended = formatted.line(Frame(0x181, b'\1', is_extended=True), SAID)
    remote = formatted.line(Frame(0x701, is_remote=True), SAID)
    assert extended.startswith('00000181  [1]  01   ')
    assert remote.startswith('     701  [0]  remote request   ')
    assert extended.index('TPDO1') == remote.index('TPDO1')


def test_colors_paint_the_meaning_and_alerts_are_red() -> None:
    """Escape codes appear only on request, and end with the line."""
    alert = Description(FrameKind.EMCY, 'EMCY', 'joint1', 'over current', is_alert=True)
    plain = LineFormat(TimeStyle.NONE, 0.0)
    colored = LineFormat(TimeStyle.NONE, 0.0, color=True)
    frame = Frame(0x81, bytes(8))
    assert '\x1b' not in plain.line(frame, alert)
    assert '\x1b[1;31mEMCY' in colored.line(frame, alert)
    assert colored.line(frame, alert).endswith('over current\x1b[0m')
    assert '\x1b[36mTPDO1' in colored.line(frame, SAID)
