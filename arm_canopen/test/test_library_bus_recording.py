# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The ring of the last frames, and the log that a black box makes of it."""

from __future__ import annotations

import gc
from pathlib import Path
import threading
import time

import can
from can_strategies import frames
from config_samples import write_bus
from hypothesis import given
from hypothesis import strategies as st
import pytest

from arm_canopen import load_bus
from arm_canopen.recording import BusRecording
from black_box import BlackBox, BlackBoxSettings
from canopen_core.can import Frame, FrameRing, read_log

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


def test_a_ring_without_room_is_refused() -> None:
    """Its owner has computed nonsense."""
    with pytest.raises(ValueError, match='holds nothing'):
        FrameRing(0)


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
    """On a busy machine the answer is there before the send has returned."""
    recording = BusRecording(load_bus(write_bus(tmp_path)), 'vcan0', window=1.0)
    receive = recording.receiving(lambda frame: None)

    def send(frame: Frame) -> None:
        receive(Frame(frame.can_id - 0x80, frame.data, time.monotonic()))

    recording.sending(send)(Frame(0x602, bytes(8)))
    path = recording.save(tmp_path, lambda: None)
    assert [frame.can_id for frame in read_log(path)] == [0x602, 0x582]


def test_a_frame_that_the_bus_refuses_is_not_in_it(tmp_path: Path) -> None:
    """It never was on the bus."""

    def refuse(frame: Frame) -> None:
        raise OSError(f'no room for {frame.can_id}')

    recording = BusRecording(load_bus(write_bus(tmp_path)), 'vcan0', window=1.0)
    with pytest.raises(OSError, match='no room'):
        recording.sending(refuse)(Frame(0x80))
    assert recording.ring.count == 0
