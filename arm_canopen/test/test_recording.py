# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The log of a black box, and a bus as the frames of a log show it."""

from __future__ import annotations

import gc
import math
from pathlib import Path
import struct
import threading
import time

import can
from can_strategies import frames
from config_samples import added, BUS, load_text, write_bus
from hypothesis import given
from hypothesis import strategies as st
import pytest

from arm_canopen import DriveState, Event, EventKind, load_bus, Severity
from arm_canopen.recording import BusRecording, BusReplay, unknown_scales
from black_box import BlackBox, BlackBoxSettings, LogPlayer
from canopen_core.can import Frame, FrameRing, read_log
from canopen_core.standard import CobId, NmtState

PERIOD = 0.01  # [s] of SYNC
ENABLED, FAULT = 0x1237, 0x1218  # statuswords
LOG_BUS = added(
    'defaults',
    """
    tpdo:
      1: {transmission: 1, mapping: [{index: 0x6041}, {index: 0x6061}]}
      2: {transmission: 1, mapping: [{index: 0x6064}, {index: 0x606C}]}
    rpdo:
      1: {mapping: [{index: 0x6040}, {index: 0x607A}]}
    """,
    added('joint1', 'heartbeat_producer: 100'),
)


class Log:
    """Frames of a bus with one drive, cycle by cycle, as a master and the drive make them."""

    def __init__(self, start: float = 1.7e9) -> None:
        self.frames: list[Frame] = []
        self.now = start  # of the last cycle in [s]
        self._cycles = 0

    def add(self, can_id: int, data: bytes, later: float = 0.0) -> None:
        """Add a frame some time in [s] after the beginning of the cycle."""
        self.frames.append(Frame(can_id, data, self.now + later))

    def cycles(
        self,
        count: int,
        *,
        word: int = ENABLED,
        position: int = 0,
        target: int = 0,
        silent: bool = False,
    ) -> None:
        """Add cycles in which the drive shows a state, and its heartbeat each 100 ms."""
        for _ in range(count):
            self.now += PERIOD
            self._cycles += 1
            self.add(0x080, b'')
            self.add(0x202, struct.pack('<Hi', 0x0F, target), 0.004)
            if silent:
                continue
            self.add(0x182, struct.pack('<Hb', word, 8), 0.001)
            self.add(0x282, struct.pack('<ii', position, 500), 0.002)
            if self._cycles % 10 == 0:
                self.add(0x702, b'\x05', 0.005)


class Watched:
    """A replay, and what it has reported."""

    def __init__(self, folder: Path, text: str = LOG_BUS) -> None:
        self.events: list[Event] = []
        self.cycles: list[float] = []  # times of the SYNCs whose TPDOs were taken
        self.bus = BusReplay(load_text(folder, text), self.events.append)
        self.bus.network.on_feedback = self.cycles.append

    def play(self, log: Log) -> None:
        """Give it all frames of a log, which is empty then."""
        for frame in sorted(log.frames, key=lambda frame: frame.timestamp):
            self.bus.receive(frame)
        log.frames.clear()

    def texts(self, severity: Severity) -> list[str]:
        """Return what was reported with a severity."""
        return [str(event) for event in self.events if event.severity is severity]


@pytest.fixture
def watched(tmp_path: Path) -> Watched:
    """Return a replay of the bus."""
    return Watched(tmp_path)


def test_a_drive_in_operation_is_seen_from_the_middle_of_a_log(watched: Watched) -> None:
    """Its boot is not in the log: state, units, set-point and following error are."""
    log = Log()
    log.cycles(30, position=1500, target=1600)
    watched.play(log)
    (axis,) = watched.bus.axes['joint1']
    status = axis.status()
    assert status.node.online
    assert status.node.nmt_state is NmtState.OPERATIONAL
    assert status.state is DriveState.OPERATION_ENABLED
    assert status.fresh
    assert (status.position, status.velocity) == (1.5, 0.5)
    assert status.setpoint == 1.6
    assert status.following_error == pytest.approx(0.1)
    assert watched.texts(Severity.ERROR) == []
    assert len(watched.cycles) >= 29
    assert watched.bus.network.missed_pdos == 0
    assert watched.bus.figures().jitter_max < 1e-5


def test_the_masters_own_frames_are_no_other_master(watched: Watched) -> None:
    """SYNC, heartbeat, SDO requests and NMT commands of a master make no drive either."""
    log = Log()
    log.add(0x000, b'\x01\x00')
    log.add(0x701, b'\x05')
    log.add(0x602, struct.pack('<BHB4x', 0x40, 0x1000, 0))
    log.cycles(20, silent=True)
    watched.play(log)
    assert watched.texts(Severity.WARNING) == []
    assert watched.bus.network.unknown_frames == 0
    (axis,) = watched.bus.axes['joint1']
    status = axis.status()
    assert not status.node.online
    assert status.state is DriveState.UNKNOWN
    assert math.isnan(status.position)


def test_a_fault_is_reported_as_the_master_does(watched: Watched) -> None:
    """EMCY and statusword in words; the error code that is read later, too; until it is reset."""
    log = Log()
    log.cycles(20)
    log.add(0x082, struct.pack('<HB5x', 0x4310, 0x09), 0.006)
    log.cycles(20, word=FAULT)
    watched.play(log)
    errors = watched.texts(Severity.ERROR)
    assert 'joint1: EMCY: 0x4310' in errors[0]
    assert 'joint1: FAULT: 0x1218' in errors[1]
    assert 'error 0x4310' in errors[1]
    assert len(errors) == 2
    (axis,) = watched.bus.axes['joint1']
    log.add(0x582, struct.pack('<BHBHxx', 0x4B, 0x603F, 0, 0x8611), 0.007)
    log.cycles(1, word=FAULT)
    watched.play(log)
    assert '0x8611' in axis.status().error
    log.cycles(5)
    watched.play(log)
    assert axis.status().error == ''


def test_a_heartbeat_that_is_missing_is_missed_at_its_time(watched: Watched) -> None:
    """The drive is lost, also where the log has no other frame; it is found again.

    After its boot-up message it is offline until it is in operation again.
    """
    log = Log()
    log.cycles(40)
    last = log.now
    watched.play(log)
    watched.bus.advance(last + 5.0)
    (lost,) = [event for event in watched.events if event.kind is EventKind.HEARTBEAT_LOST]
    assert 'heartbeat lost' in lost.text
    (axis,) = watched.bus.axes['joint1']
    assert not axis.status().node.online
    log.now = last + 6.0
    log.cycles(20, position=100)
    watched.play(log)
    assert axis.status().node.online
    assert axis.status().position == 0.1
    log.add(0x702, b'\0', 0.008)
    watched.play(log)
    assert 'restarted' in watched.texts(Severity.ERROR)[-1]
    assert not axis.status().node.online


def test_what_no_pdo_carries_is_taken_from_the_answers_of_the_drive(tmp_path: Path) -> None:
    """The master had polled it by SDO."""
    text = LOG_BUS.replace('{index: 0x6064}, ', '')
    watched = Watched(tmp_path, text)
    log = Log()
    for position in (700, 800):
        for _ in range(20):
            log.now += PERIOD
            log.add(0x080, b'')
            log.add(0x182, struct.pack('<Hb', ENABLED, 8), 0.001)
            log.add(0x282, struct.pack('<i', 0), 0.002)
        log.add(0x602, struct.pack('<BHB4x', 0x40, 0x6064, 0), 0.003)
        log.add(0x582, struct.pack('<BHBi', 0x43, 0x6064, 0, position), 0.004)
    log.cycles(1, silent=True)
    watched.play(log)
    (axis,) = watched.bus.axes['joint1']
    assert axis.status().position == 0.8


def test_axes_with_the_scales_of_their_drive_are_named(tmp_path: Path) -> None:
    """A log without the boot does not have them."""
    scaled = BUS.replace(
        '  dcf: drive.eds\n', '  dcf: drive.eds\n  scale_from_factor_group: true\n'
    )
    (tmp_path / 'a').mkdir()
    assert unknown_scales(load_text(tmp_path / 'a', BUS)) == []
    assert unknown_scales(load_text(tmp_path, scaled)) == ['joint1']


def test_a_log_that_is_repeated_goes_on_in_time(watched: Watched) -> None:
    """Each turn begins with unknown drives; nothing is missed between two turns."""
    log = Log()
    log.cycles(100, position=300)
    stop = threading.Event()
    frames = sorted(log.frames, key=lambda frame: frame.timestamp)
    playing = LogPlayer(
        watched.bus,
        lambda: ((frame.timestamp, frame) for frame in frames),
        name='bus.log',
        rate=100.0,
        start=0.0,
    )
    operational: list[Event] = []

    def note(sync_time: float) -> None:
        operational[:] = [event for event in watched.events if event.kind is EventKind.BOOT]
        if len(operational) == 3:
            stop.set()

    watched.bus.network.on_feedback = note
    playing.play(stop, loop=True)
    assert len(operational) == 3
    assert watched.texts(Severity.ERROR) == []


SENT = FrameRing.SENT
error_frames = st.tuples(st.integers(1, 0x1FFF_FFFF), st.binary(max_size=8)).map(
    lambda parts: Frame(*parts, is_error=True)
)


def contents(ring: FrameRing) -> list[tuple[Frame, bool]]:
    """Return all that a ring has."""
    return [(frame, sent) for chunk in ring.chunks() for frame, sent in chunk]


@given(st.lists(st.tuples(st.one_of(frames(), error_frames), st.booleans()), max_size=200))
def test_the_last_frames_come_back_as_they_were(given_frames: list[tuple[Frame, bool]]) -> None:
    """In their order, with time and direction, of whatever kind."""
    ring = FrameRing(70)
    expected = []
    for number, (frame, is_sent) in enumerate(given_frames):
        ring.record(frame, float(number), SENT if is_sent else 0)
        expected.append((frame._replace(timestamp=float(number)), is_sent))
    assert contents(ring) == expected[-70:]


def test_it_makes_no_work_for_the_garbage_collector() -> None:
    """However many frames were recorded, no object of them is left."""
    ring = FrameRing(5000)
    frame = Frame(0x181, bytes(8), 1.0)
    ring.record(frame, 1.0)
    gc.collect()
    before = len(gc.get_objects())
    for number in range(4000):
        ring.record(frame, float(number))
    assert len(gc.get_objects()) - before < 100


def test_a_reader_that_is_overtaken_gets_only_whole_and_newer_frames() -> None:
    """While another thread records, what is read is in order and not torn."""
    ring = FrameRing(300)
    stopping = threading.Event()

    def record() -> None:
        number = 0
        while not stopping.is_set():
            ring.record(Frame(0x181, number.to_bytes(8, 'little')), float(number))
            number += 1

    thread = threading.Thread(target=record)
    thread.start()
    try:
        while ring.count < 600:
            time.sleep(0.001)
        for _ in range(50):
            read = contents(ring)
            numbers = [int.from_bytes(frame.data, 'little') for frame, _ in read]
            assert numbers == [int(frame.timestamp) for frame, _ in read]
            assert numbers == sorted(numbers)
    finally:
        stopping.set()
        thread.join()


def test_the_log_is_in_order_and_of_the_window(tmp_path: Path) -> None:
    """Read back by our reader and by python-can's; a frame that is sent may overtake one."""
    config = load_bus(write_bus(tmp_path))
    recording = BusRecording(config, 'vcan0', window=60.0)
    taken: list[Frame] = []
    receive = recording.receiving(taken.append)
    now = time.monotonic()
    old, seen, late = (
        Frame(0x702, b'\x05', now - 100.0),
        Frame(0x182, b'\x37\x06', now - 1.0),
        Frame(0x183, b'\x37\x06', now - 0.5),
    )
    receive(old)
    receive(seen)
    send = recording.sending(lambda frame: None)
    send(Frame(0x202, b'\x0f\x00'))
    receive(late)  # the kernel had it before the other one was sent
    box = BlackBox('can_vcan0', recording, BlackBoxSettings(tmp_path / 'boxes', after=0.0))
    box.start()
    box.fault('joint1', 'lost')
    box.close()
    assert taken == [old, seen, late]
    assert box.last is not None
    ours = list(read_log(box.last))
    assert [frame.can_id for frame in ours] == [0x182, 0x183, 0x202]
    assert ours[1].timestamp - ours[0].timestamp == pytest.approx(0.5, abs=1e-5)
    assert abs(ours[0].timestamp - (time.time() - 1.0)) < 30.0
    theirs = list(can.CanutilsLogReader(str(box.last)))
    assert [(each.arbitration_id, each.is_rx) for each in theirs] == [
        (0x182, True),
        (0x183, True),
        (0x202, False),
    ]
    report = (box.last.parent / 'report.txt').read_text('utf-8')
    assert str(config.file) in report
    assert f'candump --read {box.last}' in report


def test_an_answer_does_not_stand_before_its_question(tmp_path: Path) -> None:
    """Although it may be there before the send has returned; what the bus refuses is not in it."""
    recording = BusRecording(load_bus(write_bus(tmp_path)), 'vcan0', window=1.0)
    receive = recording.receiving(lambda frame: None)

    def send(frame: Frame) -> None:
        if frame.can_id == CobId.SYNC:
            raise OSError('no room')
        receive(Frame(frame.can_id - 0x80, frame.data, time.monotonic()))

    with pytest.raises(OSError, match='no room'):
        recording.sending(send)(Frame(CobId.SYNC))
    recording.sending(send)(Frame(0x602, bytes(8)))
    path = recording.save(tmp_path, lambda: None)
    assert [frame.can_id for frame in read_log(path)] == [0x602, 0x582]
