# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Logs: round trip in every format, python-can and can-utils as readers."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
import io
from pathlib import Path
import shutil
import subprocess
import tempfile
import time

import can
from can_strategies import frames
from hypothesis import given
from hypothesis import strategies as st
import pytest

from canopen_core import CodecError
from canopen_core.can import bus, Frame, LogWriter, read_buses, read_log
from canopen_core.can.adapter import from_message, to_message
from canopen_core.can.candump_format import log_channel, parse_line, read_lines

EXAMPLES = [
    ('(1700000000.123456) can0 181#27060000', Frame(0x181, b'\x27\x06\x00\x00')),
    ('(1700000000.123456) can0 080#', Frame(0x080)),
    ('(1700000000.123456) can0 701#R', Frame(0x701, is_remote=True)),
    ('(1700000000.123456) can0 701#R3', Frame(0x701, is_remote=True, remote_length=3)),
    ('(1700000000.123456) can0 00000181#01', Frame(0x181, b'\x01', is_extended=True)),
    ('(1700000000.123456) can0 20000004#0004', Frame(0x4, b'\x00\x04', is_error=True)),
    ('(1700000000.123456) can0 1FFFFFFF#R', Frame(0x1FFFFFFF, is_extended=True, is_remote=True)),
]
times = st.integers(0, 4_000_000_000_000_000).map(lambda micro: micro / 1e6)
error_frames = st.tuples(st.integers(1, 0x1FFF_FFFF), st.binary(max_size=8)).map(
    lambda parts: Frame(*parts, is_error=True)
)


def written(sent: list[Frame], folder: Path, name: str = 'bus.log') -> Path:
    """Return a log of can0, written at the wall clock time 1.7e9 s plus the time stamps."""
    path = folder / name
    with closing(LogWriter(path, 'can0', 1.7e9)) as log:
        log.write(sent)
    return path


def test_lines_are_those_of_candump(tmp_path: Path) -> None:
    """Each kind of frame is written as can-utils does, with a direction behind, and read back."""
    path = written([frame._replace(timestamp=0.123456) for _, frame in EXAMPLES], tmp_path)
    for text, (line, frame) in zip(path.read_text('ascii').splitlines(), EXAMPLES, strict=True):
        assert text.removesuffix(' R') == line
        interface, found = parse_line(line)
        assert interface == 'can0'
        assert found._replace(timestamp=0.0) == frame


@given(times, st.one_of(frames(), error_frames))
def test_round_trip(time: float, frame: Frame) -> None:
    """Reading inverts writing, to the microsecond."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / 'bus.log'
        with closing(LogWriter(path, 'can0', 0.0)) as log:
            log.write([frame._replace(timestamp=time)])
        (found,) = read_log(path)
    assert found.timestamp == pytest.approx(time, abs=1e-6)
    assert found._replace(timestamp=frame.timestamp) == frame


@pytest.mark.parametrize('suffix', ['.log', '.asc', '.blf', '.BLF', '.txt'])
def test_every_format_keeps_frames_and_times(suffix: str, tmp_path: Path) -> None:
    """Data frames, remote requests and both lengths of identifiers, to the tenth of a ms."""
    sent = [
        frame._replace(timestamp=10.0 + 0.25 * number)
        for number, (_, frame) in enumerate(EXAMPLES)
        if not frame.is_error
    ]
    found = list(read_log(written(sent, tmp_path, f'bus{suffix}')))
    assert [frame._replace(timestamp=0.0) for frame in found] == [
        frame._replace(timestamp=0.0) for frame in sent
    ]
    assert [frame.timestamp - found[0].timestamp for frame in found] == pytest.approx(
        [frame.timestamp - sent[0].timestamp for frame in sent], abs=1e-4
    )


TPDO = Frame(0x181, b'\x27\x06')
LONG = Frame(0x18FF1234, b'\x01', is_extended=True)
REQUEST = Frame(0x701, is_remote=True, remote_length=1)
POSTED = {
    'candump -L': (
        '$ candump -L can0 can1\n(1.500000) can0 181#2706\n(2.500000) can1 18FF1234#01\n',
        [('can0', TPDO, 1.5), ('can1', LONG, 2.5)],
    ),
    "candump's screen": (
        (
            '  can0  181   [2]  27 06\n\n  can1  18FF1234   [1]  01\n'
            '  can0  701   [1]  remote request\n'
        ),
        [('can0', TPDO, 0.0), ('can1', LONG, 0.0), ('can0', REQUEST, 0.0)],
    ),
    'candump -t z -a, in colours': (
        (
            " (000.000000)  can0  \x1b[31m181\x1b[0m   [2]  27 06                     ''.'\n"
            ' (001.250000)  can0  080   [0] \n'
        ),
        [('can0', TPDO, 0.0), ('can0', Frame(0x80), 1.25)],
    ),
    'candump -t d': (
        (
            ' (000.000000)  can0  181   [2]  27 06\n (001.250000)  can0  080   [0]\n'
            ' (000.500000)  can0  080   [0]\n'
        ),
        [('can0', TPDO, 0.0), ('can0', Frame(0x80), 1.25), ('can0', Frame(0x80), 1.75)],
    ),
    'candump -x -e -t a': (
        (
            ' (1700000000.500000)  can0  RX - -  181   [2]  27 06\n'
            ' (1700000001.500000)  can0  RX - -  20000004   [2]  00 04   ERRORFRAME\n'
            '\tcontroller-problem{rx-error-warning}\n'
        ),
        [
            ('can0', TPDO, 1_700_000_000.5),
            ('can0', Frame(4, b'\0\4', is_error=True), 1_700_000_001.5),
        ],
    ),
    'PCAN 1.1': (
        (
            ';$FILEVERSION=1.1\n;$STARTTIME=25569.0\n;   Message Number\n'
            '     1)      1500.0  Rx         0181  2  27 06 \n'
            '     2)      2500.0  Tx     18FF1234  1  01 \n'
            '     3)      3500.0  Rx         0701  1  RTR \n'
        ),
        [('1', TPDO, 1.5), ('1', LONG, 2.5), ('1', REQUEST, 3.5)],
    ),
    'PCAN 2.1': (
        (
            ';$FILEVERSION=2.1\n;$STARTTIME=25569.0\n;$COLUMNS=N,O,T,B,I,d,R,L,D\n'
            '      1      1500.000 DT  1     0181 Rx  -  2    27 06\n'
            '      2      2500.000 DT  2 18FF1234 Rx  -  1    01\n'
        ),
        [('1', TPDO, 1.5), ('2', LONG, 2.5)],
    ),
    'SavvyCAN': (
        (
            'Time Stamp,ID,Extended,Dir,Bus,LEN,D1,D2,D3,D4,D5,D6,D7,D8\n'
            '1500000,00000181,false,Rx,0,2,27,06,\n2500000,18FF1234,true,Tx,1,1,01,\n'
        ),
        [('0', TPDO, 1.5), ('1', LONG, 2.5)],
    ),
    'python-can csv': (
        'timestamp,arbitration_id,extended,remote,error,dlc,data\n1.5,0x181,0,0,0,2,JwY=\n',
        [('', TPDO, 1.5)],
    ),
    'Vector, two channels and an error frame': (
        (
            'date Thu Jan 01 00:00:00.000 1970\nbase hex  timestamps absolute\n'
            'internal events logged\nBegin Triggerblock Thu Jan 01 00:00:00.000 1970\n'
            '   1.500000 1  181             Rx   d 2 27 06\n'
            '   2.500000 2  18FF1234x       Rx   d 1 01\n'
            '   3.500000 1  701             Rx   r 1\n'
            '   4.500000 1  ErrorFrame\nEnd TriggerBlock\n'
        ),
        [
            *(('1', TPDO, 1.5), ('2', LONG, 2.5)),
            *(('1', REQUEST, 3.5), ('1', Frame(0, is_error=True), 4.5)),
        ],
    ),
    'Vector, relative': (
        (
            'date Thu Jan 01 00:00:00.000 1970\nbase hex  timestamps relative\n'
            'no internal events logged\n'
            '   1.500000 1  181             Rx   d 2 27 06\n'
            '   1.000000 1  18FF1234x       Rx   d 1 01\n'
        ),
        [('1', TPDO, 1.5), ('1', LONG, 2.5)],
    ),
    'a silent bus': ('\n', []),
}


@pytest.fixture
def utc() -> Iterator[None]:
    """Set local time to UTC."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv('TZ', 'UTC')
        time.tzset()
        yield
    time.tzset()


@pytest.mark.usefixtures('utc')
@pytest.mark.parametrize('encoding', ['utf-8', 'utf-8-sig', 'utf-16'])
@pytest.mark.parametrize(('text', 'expected'), POSTED.values(), ids=POSTED)
def test_logs_are_read_as_people_post_them(
    text: str, expected: list[tuple[str, Frame, float]], encoding: str, tmp_path: Path
) -> None:
    """Whatever they are called: the buses, the times, and remote requests with their length."""
    path = tmp_path / 'posted.txt'
    path.write_text(text, encoding)
    found = list(read_buses(path))
    assert [(bus, frame._replace(timestamp=0.0)) for bus, frame in found] == [
        (bus, frame) for bus, frame, _ in expected
    ]
    times = [frame.timestamp for _, frame in found]
    assert times == pytest.approx([stamp for _, _, stamp in expected], abs=1e-6)


REFUSED = {
    'anything': ('Dear all,\nmy drive does not move.\n', "no log of a known format.*'Dear all,'"),
    'BUSMASTER': ('***BUSMASTER Ver 3.2.2***\n', r'BUSMASTER \.log is not read; read are candump'),
    'MDF': ('MDF     4.10    ', r'ASAM MDF \(\.mf4\) is not read'),
    'gzip': ('\x1f\x8b', 'gzip file is not read'),
    'pcap': ('\xd4\xc3\xb2\xa1' + 60 * '\0', 'pcap is not read; read are candump'),
    'pcapng': ('\x0a\x0d\x0d\x0a' + 60 * '\0', 'pcapng is not read; read are candump'),
    'a damaged BLF': ('LOGG' + 200 * '\0', r'Vector \.blf: damaged after 0 frames'),
    'FD in candump -L': ('(1.0) can0 181##12706\n', 'candump log: line 1: .*is a CAN FD frame'),
    'FD on the screen': ('  can0  181  [12]  27 06\n', "candump's screen: line 1: .*CAN FD"),
    'FD in .asc': (
        (
            'base hex  timestamps absolute\nno internal events logged\n'
            '  1.5 CANFD 1 Rx 181 1 0 9 12 00 01 02 03 04 05 06 07 08 09 0a 0b 0 0 3000 0\n'
        ),
        r'Vector \.asc: it has CAN FD frames',
    ),
    'FD in .trc': (
        (
            ';$FILEVERSION=2.0\n;$STARTTIME=25569.0\n;$COLUMNS=N,O,T,I,d,l,D\n'
            '      1      1500.000 FD     0181 Rx 12   00 01 02 03 04 05 06 07 08 09 0A 0B\n'
        ),
        r'PCAN \.trc: it has CAN FD frames',
    ),
    'cut bytes': ('  can0  181   [2]  27\n', 'line 1: .*has no 2 bytes in hexadecimal'),
    'bits': ('  can0  181   [1]  00100111\n', 'has no 1 bytes in hexadecimal'),
    'a damaged csv': ('Time Stamp,ID,Extended,Bus,LEN,D1\n1,181,0,0,1,xy\n', 'SavvyCAN csv: dam'),
}


@pytest.mark.parametrize(('text', 'words'), REFUSED.values(), ids=REFUSED)
def test_what_cannot_be_read_is_named(text: str, words: str, tmp_path: Path) -> None:
    """The file, its format, the place and what is read; never nothing at all."""
    path = tmp_path / 'posted.log'
    path.write_bytes(text.encode('latin-1'))
    with pytest.raises(CodecError, match=rf'posted\.log: .*{words}|posted\.log: {words}'):
        list(read_log(path))


def test_one_bus_of_a_log_is_read_as_one(tmp_path: Path) -> None:
    """Frames of two buses are not mixed: one is named, or the log is refused."""
    path = tmp_path / 'bus.log'
    path.write_text(POSTED['candump -L'][0])
    assert [frame.can_id for frame in read_log(path, 'can1')] == [LONG.can_id]
    with pytest.raises(CodecError, match='frames of can0 and can1; choose one'):
        list(read_log(path))


@pytest.mark.parametrize('milliseconds', [7, 70, 700])
def test_the_start_of_an_asc_has_three_digits(milliseconds: int, tmp_path: Path) -> None:
    """python-can writes .7 for 7 ms, up to 0.9 s from the truth: written right, and read both."""
    start = 1.7e9 + milliseconds / 1000
    path = tmp_path / 'bus.asc'
    with closing(LogWriter(path, 'can0', 0.0)) as log:
        log.write([TPDO._replace(timestamp=start)])
    assert f'.{milliseconds:03d} ' in path.read_text().splitlines()[3]
    (message,) = can.ASCReader(path, relative_timestamp=False)
    assert message.timestamp == pytest.approx(start, abs=1e-4)
    theirs = tmp_path / 'theirs.asc'
    with can.ASCWriter(theirs) as writer:
        writer.on_message_received(can.Message(arbitration_id=0x181, timestamp=start))
    for each in (path, theirs):
        (frame,) = read_log(each)
        assert frame.timestamp == pytest.approx(start, abs=1e-4)


def test_a_pause_between_two_clocks_does_not_move_a_log(monkeypatch: pytest.MonkeyPatch) -> None:
    """A process that stood still after reading one of them has not read the other in time."""
    now = [100.0]
    pauses = iter([0.0, 3.0, 0.0, 0.5, 0.0, 0.0])

    def steady() -> float:
        now[0] += next(pauses, 1e-6)
        return now[0]

    monkeypatch.setattr(bus, 'monotonic', steady)
    monkeypatch.setattr(bus, 'time', lambda: now[0] + next(pauses, 0.0) + 1.7e9)
    assert bus.wall_clock_offset() == pytest.approx(1.7e9, abs=1e-3)


@given(st.lists(frames(), max_size=20))
def test_python_can_reads_our_logs_and_we_read_its_logs(sent: list[Frame]) -> None:
    """python-can's reader gives the frames that were written.

    It leaves the length of a remote request out, and appends a direction.
    """
    stamped = [frame._replace(timestamp=float(number)) for number, frame in enumerate(sent)]
    with tempfile.TemporaryDirectory() as folder:
        messages = list(can.CanutilsLogReader(written(stamped, Path(folder))))
    assert [from_message(message, 0.0) for message in messages] == sent
    assert [m.timestamp for m in messages] == [1.7e9 + n for n in range(len(sent))]
    text = io.StringIO()
    writer = can.CanutilsLogWriter(text, channel='vcan0')
    for frame in stamped:
        writer.on_message_received(to_message(frame, frame.timestamp))
    found = [line.frame for line in read_lines(text.getvalue().splitlines())]
    assert found == [frame._replace(remote_length=0) for frame in stamped]


WRONG = ['181', '1#00', '0181#00', '181#0', '181#zz', '181#000102030405060708', '181##100']
WRONG += ['9FFFFFFF#00', 'FFF#00']


def test_wrong_lines_are_named_with_their_number() -> None:
    """A damaged or CAN FD line is refused, telling where.

    Dots between bytes, more blanks and a direction mean nothing, as to can-utils.
    """
    for line in ('(1) can0 181#00', '(1.0) 181#00', *(f'(1.0) can0 {frame}' for frame in WRONG)):
        with pytest.raises(CodecError, match='line 3: '):
            list(read_lines(['# a comment', '', line]))
    for line in ('(1.0) can0 181#01.02.03', '(1.0)  can0\t181#010203 R\n'):
        assert parse_line(line).frame == Frame(0x181, b'\x01\x02\x03', 1.0)


def test_only_what_canplayer_can_play_is_written(tmp_path: Path) -> None:
    """A log of the multicast bus can be played to vcan0; Wireshark opens logs of candump."""
    channels = {'can0': 'can0', 'vcan12': 'vcan12', 'udp_multicast:239.1.2.3': 'vcan0'}
    for name, channel in (channels | {'a b': 'vcan0'}).items():
        assert log_channel(name) == channel
    for suffix in ('.pcap', '.cap', '.pcapng'):
        with pytest.raises(CodecError, match='no capture is written'):
            written([], tmp_path, f'bus{suffix}')


@pytest.mark.skipif(shutil.which('log2asc') is None, reason='can-utils is not installed')
def test_log2asc_of_can_utils_converts_our_logs(tmp_path: Path) -> None:
    """can-utils' own converter reads every kind of line."""
    path = written(
        [frame._replace(timestamp=float(n)) for n, (_, frame) in enumerate(EXAMPLES)], tmp_path
    )
    command = ['log2asc', '-I', str(path), 'can0']
    converted = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    lines = [line for line in converted.stdout.splitlines() if ' 1  ' in line]
    assert len(lines) == len(EXAMPLES)
    assert '181' in lines[0]
    assert '27 06 00 00' in lines[0]
