# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Logs in candump's format: round trip, python-can and can-utils as readers."""

from __future__ import annotations

import io
from pathlib import Path
import shutil
import subprocess

import can
from can_strategies import frames
from hypothesis import given
from hypothesis import strategies as st
import pytest

from arm_canopen.can import Frame
from arm_canopen.can.adapter import from_message
from arm_canopen.exceptions import CodecError
from canopen_tools.candump_log import (
    CandumpLog,
    format_record,
    log_channel,
    LogRecord,
    parse_record,
    read_log,
)

EXAMPLES = [
    ('(1700000000.123456) can0 181#27060000', Frame(0x181, b'\x27\x06\x00\x00')),
    ('(1700000000.123456) can0 080#', Frame(0x080)),
    ('(1700000000.123456) can0 701#R', Frame(0x701, is_remote=True)),
    ('(1700000000.123456) can0 00000181#01', Frame(0x181, b'\x01', is_extended=True)),
    ('(1700000000.123456) can0 20000004#0004', Frame(0x4, b'\x00\x04', is_error=True)),
    ('(1700000000.123456) can0 1FFFFFFF#R', Frame(0x1FFFFFFF, is_extended=True, is_remote=True)),
]
times = st.integers(0, 4_000_000_000_000_000).map(lambda micro: micro / 1e6)
error_frames = st.tuples(st.integers(1, 0x1FFF_FFFF), st.binary(max_size=8)).map(
    lambda parts: Frame(*parts, is_error=True)
)


@pytest.mark.parametrize(('line', 'frame'), EXAMPLES)
def test_lines_are_those_of_candump(line: str, frame: Frame) -> None:
    """Each kind of frame is written as can-utils does, and read back."""
    record = LogRecord(1700000000.123456, 'can0', frame)
    assert format_record(record) == line
    assert parse_record(line) == record


@given(times, st.from_regex(r'[a-z]{1,8}[0-9]', fullmatch=True), st.one_of(frames(), error_frames))
def test_round_trip(time: float, channel: str, frame: Frame) -> None:
    """Reading inverts writing, to the microsecond."""
    record = parse_record(format_record(LogRecord(time, channel, frame)))
    assert record.time == pytest.approx(time, abs=1e-6)
    assert (record.channel, record.frame) == (channel, frame)


@given(st.lists(frames(), max_size=20))
def test_python_can_reads_our_logs(sent: list[Frame]) -> None:
    """python-can's reader gives the frames that were written."""
    text = io.StringIO()
    log = CandumpLog(text, 'can0', wall_offset=1.7e9)
    for number, frame in enumerate(sent):
        log.write(frame, timestamp=float(number))
    text.seek(0)
    messages = list(can.CanutilsLogReader(text))
    assert [from_message(message, 0.0) for message in messages] == sent
    assert [m.timestamp for m in messages] == [1.7e9 + n for n in range(len(sent))]


@given(frames())
def test_we_read_logs_of_python_can(frame: Frame) -> None:
    """The direction that python-can appends is tolerated."""
    message = can.Message(
        timestamp=1.5,
        arbitration_id=frame.can_id,
        is_extended_id=frame.is_extended,
        is_remote_frame=frame.is_remote,
        data=frame.data,
    )
    text = io.StringIO()
    writer = can.CanutilsLogWriter(text, channel='vcan0')
    writer.on_message_received(message)
    (record,) = read_log(text.getvalue().splitlines())
    assert record == LogRecord(1.5, 'vcan0', frame)


def test_steady_stamps_become_wall_clock_times() -> None:
    """A frame's own stamp is used unless another is given, plus the distance of the clocks."""
    text = io.StringIO()
    log = CandumpLog(text, 'can0', wall_offset=1000.0)
    log.write(Frame(1, timestamp=2.5))
    log.write(Frame(2), timestamp=3.0)
    assert [record.time for record in read_log(text.getvalue().splitlines())] == [1002.5, 1003.0]


@pytest.mark.parametrize(
    ('bus', 'channel'),
    [
        ('can0', 'can0'),
        ('vcan12', 'vcan12'),
        ('udp_multicast:239.1.2.3', 'vcan0'),
        ('a b', 'vcan0'),
    ],
)
def test_the_channel_is_a_name_that_canplayer_can_play_to(bus: str, channel: str) -> None:
    """A log of the multicast bus can be played to vcan0."""
    assert log_channel(bus) == channel


@pytest.mark.parametrize(
    'line',
    [
        '(1.0) can0 181',
        '(1.0) can0 1#00',
        '(1.0) can0 0181#00',
        '(1.0) can0 181#0',
        '(1.0) can0 181#zz',
        '(1.0) can0 181#000102030405060708',
        '(1.0) can0 181##100',
        '(1.0) can0 9FFFFFFF#00',
        '(1.0) can0 FFF#00',
        '(1) can0 181#00',
        '(1.0) 181#00',
    ],
)
def test_wrong_lines_are_named_with_their_number(line: str) -> None:
    """A damaged or CAN FD line is refused, telling where."""
    with pytest.raises(CodecError, match='line 3: '):
        list(read_log(['# a comment', '', line]))


@pytest.mark.parametrize('line', ['(1.0) can0 181#01.02.03', '(1.0)  can0\t181#010203 R\n'])
def test_what_can_utils_tolerates_is_tolerated(line: str) -> None:
    """Dots between bytes, more blanks and a direction mean nothing."""
    assert parse_record(line).frame == Frame(0x181, b'\x01\x02\x03')


@pytest.mark.skipif(shutil.which('log2asc') is None, reason='can-utils is not installed')
def test_log2asc_of_can_utils_converts_our_logs(tmp_path: Path) -> None:
    """can-utils' own converter reads every kind of line."""
    path = tmp_path / 'bus.log'
    with path.open('w', encoding='ascii') as file:
        log = CandumpLog(file, 'can0', wall_offset=1.7e9)
        for number, (_, frame) in enumerate(EXAMPLES):
            log.write(frame, timestamp=float(number))
    converted = subprocess.run(
        ['log2asc', '-I', str(path), 'can0'],
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    )
    lines = [line for line in converted.stdout.splitlines() if ' 1  ' in line]
    assert len(lines) == len(EXAMPLES)
    assert '181' in lines[0]
    assert '27 06 00 00' in lines[0]
