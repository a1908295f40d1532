# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a serial memory keeps and writes, what a log has when it is read, and what is a fault."""

from __future__ import annotations

import gc
import math
import os
from pathlib import Path
import pty
import re
import time
from typing import Any, TYPE_CHECKING

from diagnostic_msgs.msg import DiagnosticStatus
from hypothesis import given, HealthCheck, settings
from hypothesis import strategies as st
from processes import executable, RunningProcess
import pytest

from quad_description import ImuSample, RobotState
from quad_description.rotations import from_rpy
from quad_hardware import LinkError, RecordingError
from quad_hardware.link import LinkState, SerialPort
from quad_hardware.protocol import (
    Code,
    Fault,
    Frame,
    HOST_KINDS,
    Kind,
    Model,
    ROBOT_KINDS,
    STATE,
    StreamParser,
    V2,
)
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
from quad_node_rig import NodeRig

if TYPE_CHECKING:
    from isolation import Isolation


POSES = [[0.0, thigh, -0.3] * 4 for thigh in (0.2, 0.4, 0.6)]
"""It rests in each, so that a busy machine sees them all."""


def black_box(status: DiagnosticStatus) -> str:
    """Return what a status has of the black box."""
    return next((pair.value for pair in status.values if pair.key == 'black_box'), '')


def replay_command(log: Path, *arguments: str) -> list[str]:
    """Return the command that replays a log."""
    parameters = (f'log:={log}', 'diagnostics_period:=0.1', *arguments)
    words = [word for parameter in parameters for word in ('-p', parameter)]
    return [executable('quad_hardware', 'replay'), '--ros-args', *words]


def assert_replayed(rig: NodeRig, env: dict[str, str], log: Path) -> None:
    """Replay a log; the topics have what they had, and nobody takes commands."""
    live = {topic: list(messages) for topic, messages in rig.received.items()}
    for messages in rig.received.values():
        messages.clear()
    with RunningProcess(replay_command(log, 'loop:=true', 'rate:=2.0'), env) as player:
        rig.wait_for_status('serial link', DiagnosticStatus.OK, 'reports arrive')
        known = {tuple(message.position) for message in live['/joint_states']}
        states = rig.received['/joint_states']

        def moves() -> bool:
            return len(known & {tuple(message.position) for message in states}) >= 3

        rig.client.spin_until(moves, 20.0, 'a motion, to the bit as it was')
        player.wait_for('stale: no report')
        assert player.stop() == 0, player.output
    for topic in ('/imu', '/odom', '/battery_state', '/tf'):
        assert rig.received[topic], topic
    ours, theirs = rig.received['/imu'][-1], live['/imu'][-1]
    assert (ours.header.frame_id, ours.orientation) == (theirs.header.frame_id, theirs.orientation)


def assert_whole(path: Path, log: Path, commands: list[dict[int, float]]) -> None:
    """The box has robot, states, reports and commands; so has the log that was wanted."""
    entries = list(read_serial_log(path))
    opened, waiting = entries[:2]
    assert isinstance(opened, Opened)
    assert (opened.protocol, opened.baud, opened.firmware) == ('v2', V2.baud, 'L-2.0.0')
    assert isinstance(waiting, StateEntered)
    states = [entry.state for entry in entries if isinstance(entry, StateEntered)]
    running, stale = states.index(LinkState.RUNNING), states.index(LinkState.STALE)
    assert states[0] is LinkState.WAITING
    assert running < stale < len(states) - 1, states

    robot, host = StreamParser(V2, ROBOT_KINDS), StreamParser(V2, HOST_KINDS)
    reports: list[Frame] = []
    sent: list[Frame] = []
    for entry in entries:
        if isinstance(entry, Transfer):
            (sent if entry.sent else reports).extend(
                (host if entry.sent else robot).feed(entry.data)
            )
    assert robot.counters.damaged == robot.counters.skipped == host.counters.skipped == 0
    pushed = [frame for frame in reports if frame.kind is Kind.PUSH]
    assert len(pushed) > 50
    assert {frame.address for frame in pushed} == {STATE.address}
    servos = V2.functions[Code.SERVOS]
    targets = [servos.unpack(frame.payload) for frame in sent if frame.address == Code.SERVOS]
    angles = [dict(zip(map(int, t['motor']), t['angle'], strict=True)) for t in targets]
    assert angles == commands[: len(angles)]
    assert angles[-1] == commands[-1]

    report = (path.parent / 'report.txt').read_text('utf-8')
    assert 'L-2.0.0, protocol v2 at 2000000 baud' in report
    assert f'replay --ros-args -p log:={path}' in report
    assert 'running: reports arrive' in report.partition('reported:')[2]
    # the log on demand has all that the black box has, to the byte
    everything = [e for e in read_serial_log(log) if isinstance(e, Transfer)]
    kept = [entry.data for entry in entries if isinstance(entry, Transfer)]
    assert [entry.data for entry in everything[: len(kept)]] == kept


@pytest.mark.scenario
def test_a_fault_is_written_with_what_came_before_and_after(
    isolation: Isolation, tmp_path: Path
) -> None:
    """Log and /diagnostics have the path; both directions are in it, as they were on the line."""
    folder, log = tmp_path / 'boxes', tmp_path / 'all.log'
    arguments = ('-p', f'black_box_folder:={folder}', '-p', f'serial_log:={log}')
    with NodeRig(isolation, tmp_path, *arguments) as rig:
        for pose in POSES:
            rig.stream(pose, 0.5)
        assert black_box(rig.status('serial link')) == ''
        rig.peer.behaviour.silent = True
        rig.node.wait_for('stale: no report')  # at once: the box is written 3 s later
        rig.peer.behaviour.silent = False
        line = rig.node.wait_for(r'black box: .*serial\.log')
        found = re.search(r'black box: (\S+) \((.*)\)', line)
        assert found is not None
        path = Path(found[1])
        assert found[2].startswith('serial link: stale: no report')
        assert path.parent.parent == folder
        rig.client.spin_until(
            lambda: black_box(rig.status('serial link')) == str(path), 20.0, 'path in diagnostics'
        )
        commands = list(rig.peer.commands)
        with RunningProcess(replay_command(path), isolation.env) as refused:
            assert refused.wait(60.0) == 1, refused.output
            refused.wait_for('runs already.*__ns:=/replay')
        assert rig.node.stop() == 0
        assert_replayed(rig, isolation.env, path)

    assert_whole(path, log, commands)


times = st.integers(0, 2**31 * 10**6).map(lambda micro: micro / 1e6)
models = st.none() | st.sampled_from(Model)
entries = st.one_of(
    st.builds(Transfer, times, st.binary(min_size=1, max_size=300), st.booleans()),
    st.builds(StateEntered, times, st.sampled_from(LinkState), st.text()),
    st.builds(
        Opened, times, st.text(), st.integers(0, 4_000_000), st.text('v12'), st.text(), models
    ),
)


def line(entry: Entry) -> str:
    """Return the line of an entry."""
    if isinstance(entry, Transfer):
        return format_transfer(entry.time, entry.data, sent=entry.sent)
    return format_event(entry, entry.time)


@settings(max_examples=50, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(entries, max_size=5))
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


def test_a_log_file_replaces_none(tmp_path: Path) -> None:
    """A second one of that name is refused, and a folder that is not there."""
    (tmp_path / 'walk.log').touch()
    with pytest.raises(RecordingError, match='exists'):
        SerialLogFile(tmp_path / 'walk.log')
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


SILENT, BOTH = Fault.SERVO_SILENT, Fault.SERVO_SILENT | Fault.OVERHEATED


def test_each_fault_is_found_once_and_again_after_it_has_ended() -> None:
    """A bit of one damaged frame is none; a body that sways at the border falls once.

    The clock of the board shows a brown-out.
    """
    watch, now = FaultWatch(), 0.0
    for count, change, found in (
        (1, {}, []),
        (1, {'faults': SILENT}, []),
        (5, {}, []),
        (20, {'faults': SILENT}, ['servo silent']),
        (1, {'faults': SILENT | Fault.IMU}, []),
        (2, {'faults': BOTH}, []),
        (2, {}, []),
        (20, {'faults': BOTH}, ['overheated']),
        (5, {}, []),
        (5, {'faults': BOTH}, ['overheated', 'servo silent']),
        (5, {'roll': 1.2}, ['tilted by 69 deg']),
        (1, {'roll': 0.85}, []),
        (1, {'roll': 0.95}, []),
        (1, {'roll': 0.1}, []),
        (1, {'roll': 1.0}, ['tilted by 57 deg']),
        (3, {'problem': 'imu: dead'}, ['imu: dead']),
        (3, {'clock': -1.9}, ['the board has begun anew']),
    ):
        values: dict[str, Any] = {'faults': 0, 'roll': 0.0, 'problem': '', 'clock': 0.0, **change}
        attitude, problem = (math.degrees(values['roll']), 0.0, 0.0), values['problem']
        imu = None if problem else ImuSample(from_rpy(values['roll'], 0.0, 0.0), None, None)
        begun: list[str] = []
        for _ in range(count):
            now += 0.02
            report = Report(
                now, 0.0, attitude, None, {}, {},
                device_time=now + values['clock'], faults=values['faults'],
            )  # fmt: skip
            begun += watch.check(report, RobotState(imu=imu, imu_problem=problem))
        assert len(begun) == len(found), (change, begun)
        assert all(words in text for words, text in zip(found, begun, strict=True)), begun


def test_only_a_robot_that_was_there_is_lost() -> None:
    """A search for it is no fault; each loss is one, and a program that ends loses nothing."""
    watch = LossWatch()
    course = (
        'connecting connecting waiting running stale! connecting! connecting waiting refused! '
        'running failed! running stopped'
    )
    for step in course.split():
        assert watch.is_lost(LinkState(step.rstrip('!'))) is step.endswith('!'), step
