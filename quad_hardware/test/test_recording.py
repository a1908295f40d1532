# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a serial memory keeps and writes, what a log has when it is read, and what is a fault."""

from __future__ import annotations

import gc
import math
import os
from pathlib import Path
import pty
import time

from hypothesis import given, HealthCheck, settings
from hypothesis import strategies as st
import pytest

from quad_description import ImuSample, RobotState
from quad_description.rotations import from_rpy
from quad_hardware import LinkError, RecordingError
from quad_hardware.link import LinkState, SerialPort
from quad_hardware.protocol import Fault, Model
from quad_hardware.recording import (
    Entry,
    FaultWatch,
    format_event,
    format_transfer,
    HEADER,
    LossWatch,
    Opened,
    read_serial_log,
    SerialLogFile,
    SerialMemory,
    StateEntered,
    Transfer,
)
from quad_hardware.report import Report

times = st.integers(0, 2**31 * 10**6).map(lambda micro: micro / 1e6)
entries = st.one_of(
    st.builds(Transfer, times, st.binary(min_size=1, max_size=300), st.booleans()),
    st.builds(StateEntered, times, st.sampled_from(LinkState), st.text()),
    st.builds(
        Opened,
        times,
        st.text(),
        st.integers(0, 4_000_000),
        st.sampled_from(['v1', 'v2']),
        st.text(),
        st.one_of(st.none(), st.sampled_from(Model)),
    ),
)


def line(entry: Entry) -> str:
    """Return the line of an entry."""
    if isinstance(entry, Transfer):
        return format_transfer(entry.time, entry.data, sent=entry.sent)
    return format_event(entry, entry.time)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(entries, max_size=20))
def test_a_log_is_read_as_it_was_written(tmp_path: Path, given_entries: list[Entry]) -> None:
    """Whatever a firmware or a path is called; times to the microsecond."""
    path = tmp_path / 'serial.log'
    path.write_text(HEADER + ''.join(map(line, given_entries)), encoding='utf-8')
    read = list(read_serial_log(path))
    assert [type(entry) for entry in read] == [type(entry) for entry in given_entries]
    for found, expected in zip(read, given_entries, strict=True):
        assert found.time == pytest.approx(expected.time, abs=2e-6)
        assert line(found) == line(expected)


@pytest.mark.parametrize(
    'damage',
    ['(1.0) < 5', '(1.0) < zz', '(1.0) open {"port": "a"}', '(1.0) state {', '(1.0) ? 00', '(x)'],
)
def test_a_damaged_line_is_named(tmp_path: Path, damage: str) -> None:
    """By file and number; comments are passed over."""
    path = tmp_path / 'serial.log'
    path.write_text(f'{HEADER}comment\n(1.000000) < 55 00\n{damage}\n')
    with pytest.raises(RecordingError, match=r'serial\.log, line 4'):
        list(read_serial_log(path))


def test_the_window_is_written_with_the_robot_that_was_found_before(tmp_path: Path) -> None:
    """Older bytes are dropped; robot and state of then stand at the beginning."""
    memory = SerialMemory('/dev/ttyAMA0', 60.0)
    now = time.monotonic()
    memory.event(Opened(now - 100.0, '/dev/ttyAMA0', 115200, 'v1', 'M-1', Model.MINI))
    memory.event(StateEntered(now - 99.0, LinkState.WAITING, 'found'))
    memory.event(StateEntered(now - 98.0, LinkState.RUNNING, 'reports arrive'))
    for age in (90.0, 62.0, 59.0, 30.0, 1.0):
        memory.transfer(now - age, bytes([int(age)]), age == 30.0)
    memory.event(StateEntered(now - 20.0, LinkState.STALE, 'no report'))
    assert memory.size == 3
    assert 'M-1, protocol v1 at 115200 baud' in memory.about
    paused = []
    path = memory.save(tmp_path, lambda: paused.append(True))
    opened, entered, *rest = read_serial_log(path)
    assert paused
    assert (opened.firmware, opened.model) == ('M-1', Model.MINI)  # type: ignore[union-attr]
    assert entered.state is LinkState.RUNNING  # type: ignore[union-attr]
    wall = time.time()
    assert opened.time == pytest.approx(wall - 60.0, abs=5.0)
    assert [wall - entry.time for entry in rest] == pytest.approx([59, 30, 20, 1], abs=5.0)
    assert [(e.data, e.sent) for e in rest if isinstance(e, Transfer)] == [
        (b'\x3b', False),
        (b'\x1e', True),
        (b'\x01', False),
    ]
    assert isinstance(rest[2], StateEntered)
    assert str(path) in memory.usage(path)


def test_it_makes_no_work_for_the_garbage_collector() -> None:
    """What is kept are plain values, which the collector lets go of when it sees them."""
    memory = SerialMemory('/dev/ttyAMA0', 60.0)
    gc.collect()
    before = len(gc.get_objects())
    for number in range(4000):
        memory.transfer(float(number) * 0.01, bytes([number % 256]) * 90, False)
    gc.collect()
    assert len(gc.get_objects()) - before < 100


def test_bytes_are_stamped_before_they_leave_and_only_if_they_do() -> None:
    """Else an answer could stand before its question, or what the port refused in a log."""
    passed: list[tuple[float, bytes, bool]] = []
    master, slave = pty.openpty()
    try:
        with SerialPort(os.ttyname(slave), 115200) as port:
            port.recorders = [lambda *each: passed.append(each)]
            before = time.monotonic()
            port.write(bytes(10))
            after = time.monotonic()
            os.write(master, b'\x55')
            assert port.read() == b'\x55'
            with pytest.raises(LinkError, match='no more bytes'):
                port.write(bytes(10**6))
    finally:
        os.close(master)
        os.close(slave)
    assert [(data, sent) for _, data, sent in passed] == [(bytes(10), True), (b'\x55', False)]
    assert before <= passed[0][0] <= after


def test_a_log_file_has_all_that_passed_and_replaces_none(tmp_path: Path) -> None:
    """In its order, whole when it is closed; a second one of that name is refused."""
    path = tmp_path / 'walk.log'
    file = SerialLogFile(path)
    now = time.monotonic()
    file.event(StateEntered(now, LinkState.RUNNING, 'reports arrive'))
    for number in range(100):
        file.transfer(now + number * 1e-3, bytes([number]), number % 2 == 1)
    file.close()
    state, *transfers = read_serial_log(path)
    assert state.time == pytest.approx(time.time(), abs=10.0)
    assert [entry.data[0] for entry in transfers] == list(range(100))  # type: ignore[union-attr]
    with pytest.raises(RecordingError, match='exists'):
        SerialLogFile(path)
    with pytest.raises(RecordingError, match='cannot be written'):
        SerialLogFile(tmp_path / 'missing' / 'walk.log')


def test_a_full_disk_ends_the_log_and_nothing_is_kept_for_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """With a warning; what comes later takes no memory, and the program can end."""
    with Path('/dev/full').open('w', encoding='utf-8') as full:
        monkeypatch.setattr(Path, 'open', lambda *_, **__: full)
        file = SerialLogFile(tmp_path / 'walk.log')
        for number in range(100):
            file.transfer(float(number), bytes(90), False)
        file._thread.join(30.0)
    assert not file._thread.is_alive()
    (record,) = caplog.records
    assert 'walk.log: No space left on device; the serial log ends here' in record.getMessage()
    file.transfer(101.0, bytes(90), True)
    file.event(StateEntered(102.0, LinkState.STALE, 'no report'))
    assert file._lines.empty()
    file.close()
    assert file._lines.empty()


def looks(
    watch: FaultWatch,
    *,
    bits: int = 0,
    roll: float = 0.0,
    clock: tuple[float, float] = (0.0, 0.0),
    problem: str = '',
    count: int = 1,
) -> list[str]:
    """Return what begins in some reports; the clock is that of arrival and of the board [s]."""
    arrival, device = clock
    imu = ImuSample(from_rpy(roll, 0.0, 0.0), None, None)
    begun = []
    for number in range(count):
        report = Report(
            arrival + number * 0.02,
            0.0,
            (math.degrees(roll), 0.0, 0.0),
            None,
            {},
            {},
            device_time=device + number * 0.02,
            faults=bits,
        )
        state = RobotState(imu=None if problem else imu, imu_problem=problem)
        begun += watch.check(report, state)
    return begun


def test_a_fault_is_found_once_and_again_after_it_has_ended() -> None:
    """A bit of one damaged frame is none."""
    watch = FaultWatch()
    assert looks(watch) == []
    assert looks(watch, bits=Fault.SERVO_SILENT, clock=(0.1, 0.1)) == []
    assert looks(watch, clock=(0.12, 0.12), count=5) == []
    (found,) = looks(watch, bits=Fault.SERVO_SILENT, clock=(0.3, 0.3), count=20)
    assert 'servo silent' in found
    assert looks(watch, bits=Fault.SERVO_SILENT | Fault.IMU, clock=(0.7, 0.7)) == []
    both = Fault.SERVO_SILENT | Fault.OVERHEATED
    assert looks(watch, bits=both, clock=(0.72, 0.72), count=2) == []
    assert looks(watch, clock=(0.76, 0.76), count=2) == []
    (found,) = looks(watch, bits=both, clock=(0.8, 0.8), count=20)
    assert 'overheated' in found
    assert looks(watch, clock=(1.3, 1.3), count=5) == []
    assert len(looks(watch, bits=both, clock=(1.5, 1.5), count=5)) == 2


def test_a_fall_a_dead_imu_and_a_restart_are_faults() -> None:
    """A body that sways at the border falls once; the clock of the board shows a brown-out."""
    watch = FaultWatch()
    (fell,) = looks(watch, roll=1.2, count=5)
    assert '69 deg' in fell
    assert looks(watch, roll=0.85, clock=(0.2, 0.2)) == []
    assert looks(watch, roll=0.95, clock=(0.22, 0.22)) == []
    assert looks(watch, roll=0.1, clock=(0.24, 0.24)) == []
    assert len(looks(watch, roll=1.0, clock=(0.26, 0.26))) == 1
    assert looks(watch, problem='imu: dead', clock=(0.3, 0.3), count=3) == ['imu: dead']
    (restart,) = looks(watch, clock=(2.0, 0.1), count=3)
    assert 'begun anew' in restart


def test_only_a_robot_that_was_there_is_lost() -> None:
    """A search for it is no fault; each loss is one, and a program that ends loses nothing."""
    watch = LossWatch()
    course = [
        (LinkState.CONNECTING, False),
        (LinkState.CONNECTING, False),
        (LinkState.WAITING, False),
        (LinkState.RUNNING, False),
        (LinkState.STALE, True),
        (LinkState.CONNECTING, True),
        (LinkState.CONNECTING, False),
        (LinkState.WAITING, False),
        (LinkState.REFUSED, True),
        (LinkState.RUNNING, False),
        (LinkState.FAILED, True),
        (LinkState.RUNNING, False),
        (LinkState.STOPPED, False),
    ]
    assert [watch.is_lost(state) for state, _ in course] == [lost for _, lost in course]
