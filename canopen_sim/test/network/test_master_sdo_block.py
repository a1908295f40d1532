# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Block transfers of the SDO client, against the simulated device's server and by hand."""

from __future__ import annotations

from binascii import crc_hqx
from collections.abc import Callable
import random

from hypothesis import given
from hypothesis import strategies as st
import pytest

from arm_canopen import BusError, SdoAbortError, SdoError, SdoTimeoutError
from arm_canopen.can import Frame
from arm_canopen.master.scheduler import Scheduler
from arm_canopen.master.sdo_block_client import BURST
from arm_canopen.master.sdo_client import BLOCK_MIN, SdoClient
from arm_canopen.standard import DataType, ObjectDictionary, ObjectEntry
from canopen_sim.objects.object_store import ObjectStore
from canopen_sim.services.sdo_server import SdoServer

pytestmark = pytest.mark.slow

NODE, BLOB = 5, 0x2002
REQUEST, RESPONSE = 0x600 + NODE, 0x580 + NODE
TIMEOUT = 0.1  # [s]


class BlockLine:
    """A client and a server with a line between that may lose and change frames.

    Attributes:
        frames: All frames that went over the line, as (from the client, data).
        spoil: Changes a frame on its way; None loses it.
        room: How many frames of the client may wait for the line; it refuses others.
    """

    def __init__(self) -> None:
        """Connect both."""
        blob = ObjectEntry(BLOB, 0, 'Blob', DataType.DOMAIN)
        self.scheduler = Scheduler()
        self.store = ObjectStore(ObjectDictionary([blob]))
        self.frames: list[tuple[bool, bytes]] = []
        self.spoil: Callable[[bytes], bytes | None] = lambda data: data
        self.room = 1000
        self._to_client: list[bytes] = []
        self._to_server: list[bytes] = []
        self._server = SdoServer(REQUEST, RESPONSE, self.store, self._answer)
        self.client = SdoClient(
            NODE, 'joint1', self.scheduler, lambda frame: self._put(frame, to_client=False)
        )

    def _put(self, frame: Frame, *, to_client: bool) -> BusError | None:
        if not to_client and len(self._to_server) >= self.room:
            return BusError('the transmit queue is full')
        self.frames.append((not to_client, frame.data))
        data = self.spoil(frame.data)
        if data is not None:
            (self._to_client if to_client else self._to_server).append(data)
        return None

    def _answer(self, frame: Frame) -> None:
        self._put(frame, to_client=True)

    def carry(self) -> None:
        """Carry a frame in each direction."""
        if self._to_server:
            self._server.receive(Frame(REQUEST, self._to_server.pop(0)), self.scheduler.now)
        if self._to_client:
            self.client.receive(Frame(RESPONSE, self._to_client.pop(0)))

    def run(self) -> None:
        """Carry frames and let time pass until nothing happens any more."""
        idle = 0
        while idle < 200:
            idle += 1
            while self._to_client or self._to_server:
                idle = 0
                self.carry()
            self.scheduler.advance(self.scheduler.now + 0.001)

    @property
    def value(self) -> object:
        """What the server holds."""
        return self.store.find(BLOB).value


@given(st.integers(BLOCK_MIN, 3000), st.randoms(use_true_random=False))
def test_any_long_value_survives_both_ways(size: int, source: random.Random) -> None:
    """Write and read in blocks, whatever its length leaves in the last segment."""
    line = BlockLine()
    value = source.randbytes(size)
    written = line.client.write(BLOB, 0, value, TIMEOUT)
    line.run()
    assert written.error is None
    assert line.value == value
    read = line.client.read(BLOB, 0, TIMEOUT, block=True)
    line.run()
    assert read.result() == value
    assert {data[0] >> 5 for client, data in line.frames if client} >= {5, 6}


@given(st.sets(st.integers(1, 250), max_size=6), st.booleans())
def test_lost_segments_are_sent_again(losses: set[int], write: bool) -> None:
    """What comes is the whole value or an error, never something else."""
    line = BlockLine()
    value = random.Random(7).randbytes(1200)
    carried = 0

    def lose(data: bytes) -> bytes | None:
        nonlocal carried
        carried += 1
        return None if carried in losses else data

    if write:
        line.spoil = lose
        written = line.client.write(BLOB, 0, value, TIMEOUT)
        line.run()
        assert written.done
        assert written.error is not None or line.value == value
        return
    line.store.find(BLOB).value = value
    line.spoil = lose
    read = line.client.read(BLOB, 0, TIMEOUT, block=True)
    line.run()
    assert read.done
    if read.error is None:
        assert read.result() == value
    else:
        assert isinstance(read.error, (SdoTimeoutError, SdoAbortError))


def test_one_lost_segment_costs_no_transfer() -> None:
    """Of a block with a gap the rest is requested again."""
    line = BlockLine()
    value = bytes(range(256)) * 4
    line.store.find(BLOB).value = value
    lost: list[bytes] = []

    def lose(data: bytes) -> bytes | None:
        if data[0] == 40 and not lost:
            lost.append(data)
            return None
        return data

    line.spoil = lose
    read = line.client.read(BLOB, 0, TIMEOUT, block=True)
    line.run()
    assert lost
    assert read.result() == value


def test_a_block_waits_for_room_in_the_transmit_queue() -> None:
    """No segment is lost in a full one, and the device is not taken for one without blocks."""
    line = BlockLine()
    line.room = BURST // 2
    value = bytes(range(256)) * 4
    written = line.client.write(BLOB, 0, value, TIMEOUT)
    line.run()
    written.result()
    assert line.value == value
    segments = [data[0] & 0x7F for client, data in line.frames if client][1:-1]
    assert segments == [n % 127 + 1 for n in range(len(segments))]


def test_changed_data_are_noticed_by_the_checksum() -> None:
    """Of a value whose CRC is wrong the server receives the reason; then it sends segments."""
    line = BlockLine()
    line.store.find(BLOB).value = bytes(300)
    line.spoil = lambda data: data[:1] + b'\1' + data[2:] if data[0] == 9 else data
    read = line.client.read(BLOB, 0, TIMEOUT, block=True)
    line.run()
    assert read.result() == bytes(300)
    assert (True, bytes.fromhex('80 02 20 00 04 00 04 05')) in line.frames


def test_a_write_whose_end_is_not_answered_is_not_repeated() -> None:
    """The device may have the value; a second write could do twice what is done once."""
    line = BlockLine()
    value = bytes(range(256)) * 2
    line.spoil = lambda data: None if data[0] == 0xA1 else data
    written = line.client.write(BLOB, 0, value, TIMEOUT)
    line.run()
    with pytest.raises(SdoError, match='read it back'):
        written.result()
    assert line.value == value
    assert (True, bytes.fromhex('21 02 20 00 00 02 00 00')) not in line.frames


def test_a_server_without_blocks_gets_segments() -> None:
    """Blocks are requested once, and then never again."""
    line = BlockLine()
    sent: list[bytes] = []
    client = SdoClient(NODE, 'joint1', line.scheduler, lambda frame: sent.append(frame.data))
    for _ in range(2):
        client.write(BLOB, 0, bytes(BLOCK_MIN), TIMEOUT)
        while sent:
            request = sent.pop(0)
            if request[0] >> 5 == 6:
                answer = '80 02 20 00 01 00 04 05'
            elif request[0] >> 5 == 1:
                answer = '60 02 20 00 00 00 00 00'
            else:
                answer = f'{0x20 | request[0] & 0x10:02X} 00 00 00 00 00 00 00'
            client.receive(Frame(RESPONSE, bytes.fromhex(answer)))
    assert (client.counters.done, client.counters.aborted) == (2, 1)


def test_golden_frames_of_a_write() -> None:
    """300 bytes: two blocks of at most 40 segments, then the end with length and checksum."""
    sent: list[bytes] = []
    scheduler = Scheduler()
    client = SdoClient(NODE, 'joint1', scheduler, lambda frame: sent.append(frame.data))
    value = bytes(number % 251 for number in range(300))
    done = client.write(BLOB, 0, value, TIMEOUT)
    assert sent == [bytes.fromhex('C6 02 20 00 2C 01 00 00')]
    client.receive(Frame(RESPONSE, bytes.fromhex('A4 02 20 00 28 00 00 00')))
    for _ in range(10):
        scheduler.advance(scheduler.now + 0.001)
    assert [data[0] for data in sent[1:]] == list(range(1, 41))
    client.receive(Frame(RESPONSE, bytes.fromhex('A2 28 28 00 00 00 00 00')))
    assert [data[0] for data in sent[41:]] == [1, 2, 0x83]
    assert b''.join(data[1:] for data in sent[1:]).rstrip(b'\0') == value.rstrip(b'\0')
    client.receive(Frame(RESPONSE, bytes.fromhex('A2 03 28 00 00 00 00 00')))
    crc = crc_hqx(value, 0).to_bytes(2, 'little')
    assert sent[-1] == bytes((0xC1 | 1 << 2,)) + crc + bytes(5)
    assert not done.done
    client.receive(Frame(RESPONSE, bytes.fromhex('A1 00 00 00 00 00 00 00')))
    assert done.done
    assert done.error is None


def test_a_reset_in_the_pause_between_two_bursts_ends_the_transfer() -> None:
    """No question is open then, and yet not one more segment goes to the rebooting device."""
    line = BlockLine()
    written = line.client.write(BLOB, 0, bytes(2000), TIMEOUT)
    while sum(client for client, _ in line.frames) < 1 + BURST:  # the initiation and a burst
        line.carry()
    begin = len(line.frames)
    line.client.cancel_all('the device restarted')
    with pytest.raises(SdoError, match='the device restarted'):
        written.result()
    line.run()
    sent = [data for client, data in line.frames[begin:] if client]
    assert [data[0] for data in sent] == [0x80]  # the abort, and nothing else
    value = line.client.read(BLOB, 0, TIMEOUT)
    line.run()
    assert value.error is None
