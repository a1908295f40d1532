# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""candump as a person starts it: a process on a real bus."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import closing, ExitStack
from pathlib import Path
import signal
import subprocess
import sys
from typing import TypeAlias

from can_addresses import DEADLINE, free_multicast, free_virtual, unstamped
from config_samples import write_bus
import pytest
from tool_environment import ENVIRONMENT, Output, REPOSITORY

from arm_canopen import BusError
from canopen_core.can import Bus, Frame, LogWriter, open_bus, read_log
from canopen_tools import candump

pytestmark = pytest.mark.slow

Start: TypeAlias = Callable[..., 'subprocess.Popen[str]']

FRAMES = [
    Frame(0x000, b'\x01\x02'),
    Frame(0x080),
    Frame(0x182, b'\x37\x16'),
    Frame(0x602, bytes.fromhex('4041600000000000')),
    Frame(0x582, bytes.fromhex('4b41600037160000')),
    Frame(0x702, b'\x05'),
]


@pytest.fixture
def name() -> str:
    """Name a bus of one's own."""
    return free_multicast()


@pytest.fixture
def bus(name: str) -> Iterator[Bus]:
    """Open a sender on it."""
    with open_bus(name) as opened:
        yield opened


@pytest.fixture
def start() -> Iterator[Start]:
    """Start candump and wait until it listens; it is gone when the test ends."""
    with ExitStack() as stack:

        def run(*arguments: str) -> subprocess.Popen[str]:
            process = stack.enter_context(
                subprocess.Popen(
                    [sys.executable, '-m', 'canopen_tools.candump', *arguments],
                    env=ENVIRONMENT,
                    stdout=subprocess.PIPE,
                    stderr=subprocess.PIPE,
                    text=True,
                )
            )
            stack.callback(process.kill)
            assert process.stderr
            line = process.stderr.readline()
            assert 'listening on' in line, line + process.stderr.read()
            return process

        yield run


def test_frames_are_shown_with_names_and_counted(
    start: Start, bus: Bus, name: str, tmp_path: Path
) -> None:
    """With a bus.yml each frame has its device, its objects and their values.

    The parameters of the other nodes work here too.
    """
    config = write_bus(tmp_path)
    ros = ['-p', f'can_interface_name:={name}', '-p', f'bus_config:={config}']
    process = start('-n', '6', '-t', 'n', '--ros-args', *ros)
    for frame in FRAMES:
        bus.send(frame)
    output, errors = process.communicate(timeout=DEADLINE)
    status = 'Statusword=0x1637 Operation enabled'
    read = '0x6041:00 Statusword = 0x1637 Operation enabled'
    assert [line.rstrip() for line in output.splitlines()] == [
        '     000  [2]  01 02                    NMT        joint1     start',
        '     080  [0]                           SYNC',
        f'     182  [2]  37 16                    TPDO1      joint1     {status}',
        '     602  [8]  40 41 60 00 00 00 00 00  SDO >      joint1     read 0x6041:00 Statusword',
        f'     582  [8]  4B 41 60 00 37 16 00 00  SDO <      joint1     {read}',
        '     702  [1]  05                       heartbeat  joint1     operational',
    ]
    assert errors == 'candump: 6 frames, 0 lost\n'
    assert process.returncode == 0


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_cleanly(
    start: Start, bus: Bus, name: str, tmp_path: Path, number: signal.Signals
) -> None:
    """Ctrl-C prints the counters, leaves a whole log and no traceback."""
    log = tmp_path / 'bus.log'
    process = start(name, '--log', str(log), '--filter', 'sync')
    for frame in FRAMES:
        bus.send(frame)
    assert process.stdout
    assert 'SYNC' in process.stdout.readline()  # the batch is there; later ones may follow
    process.send_signal(number)
    _, errors = process.communicate(timeout=DEADLINE)
    assert process.returncode == 0
    assert errors.startswith('candump: ')
    assert errors.endswith(' lost\n')
    logged = unstamped(list(read_log(log)))
    assert logged == FRAMES[: len(logged)]
    assert len(logged) >= 2  # all frames, not only those shown


def test_a_reader_that_goes_away_ends_it(start: Start, bus: Bus, name: str) -> None:
    """As with `candump | head` there is no traceback."""
    process = start(name)
    assert process.stdout
    assert process.stderr
    process.stdout.close()
    while process.poll() is None:
        bus.send(Frame(0x080))
    assert process.returncode == 0
    errors = process.stderr.read()
    assert errors.startswith('candump: ')
    assert 'Traceback' not in errors


def run_main(capsys: Output, *arguments: str) -> tuple[int, str, str]:
    """Run it in this process: exit code, output and errors."""
    code = candump.main(arguments)
    captured = capsys.readouterr()
    return code, captured.out, captured.err


@pytest.mark.parametrize('suffix', ['.log', '.asc', '.blf', ''])
def test_a_log_is_shown_like_a_bus(suffix: str, capsys: Output, tmp_path: Path) -> None:
    """--read describes what was logged in any format, with the times of the log."""
    path = tmp_path / f'bus{suffix}'
    with closing(LogWriter(path, 'can0', 1.7e9)) as log:
        log.write(frame._replace(timestamp=float(n)) for n, frame in enumerate(FRAMES))
    for style, terms, times in (
        ('a', '^sync', ['1700000000.000000', '1700000002.000000']),
        ('z', '182', ['0002.000000']),  # from its begin: two can be compared
        ('d', '182', ['0000.000000']),  # since the line before of what is shown
    ):
        read = ['--read', str(path), '-t', style, '--filter', terms, '-n', '2']
        code, out, _ = run_main(capsys, *read)
        assert code == 0
        assert [line.split()[0] for line in out.splitlines()] == [f'({time})' for time in times]


def test_an_error_frame_of_a_log_has_the_long_identifier_of_a_live_one(
    capsys: Output, tmp_path: Path
) -> None:
    """Its identifier says what the error was."""
    path = tmp_path / 'bus.log'
    path.write_text('(1.000000) can0 20000004#0004000000000000\n')
    _, out, _ = run_main(capsys, '--read', str(path), '-t', 'n')
    assert out.split()[0] == '00000004'


TWO_BUSES = '(1.000000) can0 702#05\n(2.000000) vcan1 702#7F\n(3.000000) can0 182#3716\n'


def test_each_bus_of_a_log_has_a_column_or_is_chosen(capsys: Output, tmp_path: Path) -> None:
    """One that is not there is an error that names those that are."""
    path = tmp_path / 'two.log'
    path.write_text(TWO_BUSES)
    read = ['--read', str(path), '-t', 'n']
    _, out, _ = run_main(capsys, *read)
    assert [line.split()[:2] for line in out.splitlines()] == [
        ['can0', '702'],
        ['vcan1', '702'],
        ['can0', '182'],
    ]
    assert len({line.index('  [') for line in out.splitlines()}) == 1
    _, out, _ = run_main(capsys, *read, '--interface', 'can0')
    assert [line.split()[0] for line in out.splitlines()] == ['702', '182']
    code, out, err = run_main(capsys, *read, '--interface', 'can7')
    assert (code, out) == (1, '')
    assert 'has no frames of can7, but of can0, vcan1' in err


@pytest.mark.parametrize('suffix', ['.asc', '.blf', '.log'])
def test_a_log_is_converted(suffix: str, capsys: Output, tmp_path: Path) -> None:
    """With its times; of several buses one has to be named, and no log becomes itself."""
    source, target = tmp_path / 'screen.txt', tmp_path / f'bus{suffix}'
    source.write_text(
        ' (1700000000.250000)  can0  702   [1]  05\n (1700000001.000000)  can0  080   [0]\n'
    )
    code, out, err = run_main(capsys, '--read', str(source), '--log', str(target), '--quiet')
    assert (code, out) == (0, '')
    assert ('.asc does not keep what an error frame was about' in err) == (suffix == '.asc')
    frames = list(read_log(target))
    assert unstamped(frames) == [Frame(0x702, b'\x05'), Frame(0x080)]
    assert [frame.timestamp for frame in frames] == pytest.approx([1.7e9 + 0.25, 1.7e9 + 1.0])
    source.write_text(TWO_BUSES)
    before = target.read_bytes()
    code, _, err = run_main(capsys, '--read', str(source), '--log', str(target))
    assert (code, target.read_bytes()) == (1, before)
    assert 'can0, vcan1' in err
    assert '--interface' in err
    code, _, err = run_main(capsys, '--read', str(source), '--log', str(source))
    assert code == 1
    assert 'would be overwritten' in err
    assert source.read_text() == TWO_BUSES


def test_it_ends_after_its_time(capsys: Output) -> None:
    """--timeout ends it on a silent bus, with success."""
    code, out, err = run_main(capsys, free_virtual(), '--timeout', '0.01')
    assert (code, out) == (0, '')
    assert err.endswith('candump: 0 frames, 0 lost\n')


def test_quiet_prints_nothing_and_still_logs(
    start: Start, bus: Bus, name: str, tmp_path: Path
) -> None:
    """With --quiet the log is all there is, and -n still ends it."""
    log = tmp_path / 'bus.log'
    process = start(name, '-q', '--log', str(log), '-n', '6')
    for frame in FRAMES:
        bus.send(frame)
    output, _ = process.communicate(timeout=DEADLINE)
    assert (process.returncode, output) == (0, '')
    assert unstamped(list(read_log(log))) == FRAMES


def test_what_cannot_be_opened_is_one_line(capsys: Output) -> None:
    """A wrong bus or file ends it with exit code 1 and a sentence."""
    for command, reason in (
        ('udp_multicast:10.0.0.1', 'no multicast address'),
        ('paecan:x', 'no interface paecan'),
        ('--bus-config nowhere/bus.yml', 'nowhere/bus.yml'),
        ('--read nowhere.log', 'nowhere.log'),
        (f'--read {REPOSITORY / "LICENSE"}', 'no log of a known format'),
        ('udp_multicast:239.1.2.3 --log nowhere/bus.log', 'nowhere/bus.log'),
    ):
        code, out, err = run_main(capsys, *command.split())
        assert (code, out) == (1, '')
        assert err.startswith('candump: ')
        assert reason in err


def test_wrong_arguments_are_refused(capsys: Output) -> None:
    """Mistakes on the command line end with exit code 2, as everywhere."""
    for command in (
        *('--filter nonsense', '-n 0', '-n x', '--timeout 0', '--timeout nan', '-t x'),
        *('--ros-args -p x', 'one two'),
    ):
        with pytest.raises(SystemExit) as ending:
            candump.main(command.split())
        assert ending.value.code == 2
        assert 'usage: ' in capsys.readouterr().err


def test_an_interface_that_goes_away_is_reported(
    capsys: Output, monkeypatch: pytest.MonkeyPatch
) -> None:
    """When the bus dies the counters and the reason are printed, and the exit code is 1."""

    class Dying(candump.Listener):
        """Fails as an interface does that is taken away."""

        def batches(self) -> Iterator[list[Frame]]:
            yield [Frame(0x080)]
            raise BusError('CAN interface can0 is gone')

    monkeypatch.setattr(candump, 'Listener', Dying)
    code, out, err = run_main(capsys, free_virtual())
    assert code == 1
    assert 'SYNC' in out
    assert err.endswith('candump: 0 frames, 0 lost\ncandump: CAN interface can0 is gone\n')
