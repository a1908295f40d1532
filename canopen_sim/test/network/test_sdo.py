# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The SDO client byte by byte, and against servers that the codecs of the package did not make."""

from __future__ import annotations

from binascii import crc_hqx
from collections.abc import Callable
from functools import partial
import random
from typing import Any

from hypothesis import example, given, settings
from hypothesis import strategies as st
import pytest
from scripted_device import SdoByteServer

from arm_canopen import (
    BusError,
    Promise,
    Scheduler,
    SdoAbortError,
    SdoClient,
    SdoError,
    SdoTimeoutError,
)
from arm_canopen.master.sdo_client import BLOCK_MIN, BURST
from canopen_core.can import Frame
from canopen_core.standard import DataType, ObjectDictionary, ObjectEntry
from canopen_sim.object_store import ObjectStore
from canopen_sim.sdo_server import SdoServer

NODE = 5
REQUEST, RESPONSE = 0x600 + NODE, 0x580 + NODE
TIMEOUT = 0.05  # [s]
BLOB = 0x2002
ABORTED = '80 {place} 00 00 04 05'  # SDO protocol timed out


class Line:
    """A client whose device is the test."""

    def __init__(self) -> None:
        self.scheduler = Scheduler()
        self.defects: list[BaseException] = []
        self.scheduler.on_defect = self.defects.append
        self.sent: list[bytes] = []  # requests that nobody has answered yet
        self.refusal: BusError | None = None  # why the bus takes no frames; None while it does
        self.client = SdoClient(NODE, 'joint1', self.scheduler, self._take)

    def _take(self, frame: Frame) -> BusError | None:
        assert frame.can_id == REQUEST
        assert len(frame.data) == 8
        if self.refusal is None:
            self.sent.append(frame.data)
        return self.refusal

    def receive(self, answer: bytes | str) -> None:
        """Deliver a frame to the client, given as bytes or as hexadecimal text."""
        data = bytes.fromhex(answer) if isinstance(answer, str) else answer
        self.client.receive(Frame(RESPONSE, data))

    def expect(self, request: str) -> None:
        """Check the one request that is open."""
        assert [data.hex(' ') for data in self.sent] == [bytes.fromhex(request).hex(' ')]
        self.sent.clear()

    def pass_time(self, duration: float) -> None:
        """Advance the time by a duration in [s]."""
        self.scheduler.advance(self.scheduler.now + duration)

    def serve(self, answer: Callable[[bytes], bytes | None]) -> None:
        """Answer until the client requests no more."""
        for _ in range(1000):
            if not self.sent:
                return
            response = answer(self.sent.pop(0))
            if response is not None:
                self.receive(response)
        raise AssertionError('the client does not come to an end')


def read(line: Line, index: int = 0x1018, subindex: int = 1) -> Promise[bytes]:
    """Begin to read an object."""
    return line.client.read(index, subindex, TIMEOUT)


def write(line: Line, data: bytes, index: int = 0x2001, subindex: int = 0) -> Promise[None]:
    """Begin to write an object."""
    return line.client.write(index, subindex, data, TIMEOUT)


SERVERS = st.builds(SdoByteServer, announces_size=st.booleans(), expedites=st.booleans())


@given(st.binary(max_size=100), SERVERS, st.integers(0, 0xFFFF), st.integers(0, 0xFF))
def test_any_value_survives_a_round_trip(
    value: bytes, server: SdoByteServer, index: int, subindex: int
) -> None:
    """What is written arrives as it is, and is read back as it is."""
    line = Line()
    written = write(line, value, index, subindex)
    line.serve(server.answer)
    assert written.error is None
    assert server.values == {(index, subindex): value}
    back = read(line, index, subindex)
    line.serve(server.answer)
    unknown_length = server.expedites and not server.announces_size and 1 <= len(value) <= 4
    assert back.result() == (value.ljust(4, b'\0') if unknown_length else value)


def test_a_refusal_is_said_with_place_and_meaning() -> None:
    """An abort names the device, the object and the code in words, and keeps the code."""
    for answer, words in (
        ('80 18 10 01 00 00 02 06', 'refused object 0x1018:01: object does not exist'),
        ('80 00 00 00 00 00 02 06', 'object does not exist'),  # some leave the object out
        ('80 18 10 01 EF BE AD DE', '0xDEADBEEF'),  # of a vendor
    ):
        line = Line()
        promise = read(line)
        line.receive(answer)
        with pytest.raises(SdoAbortError, match=rf'joint1 \(node 5\) .*{words}') as caught:
            promise.result()
        assert caught.value.code == int.from_bytes(bytes.fromhex(answer)[4:], 'little')
        assert line.client.counters.aborted == 1


@pytest.mark.parametrize('garbage', [0, 3])
def test_silence_ends_in_a_time_out_that_is_reported_to_the_server(garbage: int) -> None:
    """Not before the time-out; the server gets an abort, the caller place, time and what came."""
    line = Line()
    promise = write(line, b'x')
    line.sent.clear()
    for _ in range(garbage):
        line.receive('FF FF FF FF FF FF FF FF')
    line.pass_time(TIMEOUT * 0.99)
    assert not promise.done
    line.pass_time(TIMEOUT * 0.02)
    words = r'joint1 .*0x2001:00 within 50 ms'
    with pytest.raises(SdoTimeoutError, match=words) as caught:
        promise.result()
    assert ('3 frames' in str(caught.value)) is bool(garbage)
    line.expect(ABORTED.format(place='01 20 00'))
    assert line.client.counters.timed_out == 1


@pytest.mark.parametrize('moment', [0.2, 1.0])
def test_a_request_that_the_bus_refuses_is_no_silence_of_the_device(moment: float) -> None:
    """It leaves once, a moment later; after the time-out it is withdrawn, with an error."""
    line = Line()
    line.refusal = BusError('the transmit queue is full')
    promise = write(line, b'\x01', 0x1018, 1)
    line.pass_time(moment * TIMEOUT)
    line.refusal = None
    if moment < 1.0:
        line.pass_time(0.2 * TIMEOUT)
        line.expect('2F 18 10 01 01 00 00 00')
        line.receive('60 18 10 01 00 00 00 00')
        promise.result()
        return
    with pytest.raises(SdoTimeoutError, match='was not sent: the transmit queue is full'):
        promise.result()
    read(line)
    line.expect('40 18 10 01 00 00 00 00')


def test_the_time_out_counts_for_each_answer() -> None:
    """A long transfer may take longer than the time-out."""
    line = Line()
    server = SdoByteServer(values={(0x1018, 1): bytes(70)})
    promise = read(line)
    for _ in range(11):
        line.pass_time(TIMEOUT * 0.9)
        answer = server.answer(line.sent.pop())
        assert answer is not None
        line.receive(answer)
    assert promise.result() == bytes(70)


def test_transfers_go_one_after_another_in_their_order() -> None:
    """The next request leaves when one has its answer, its abort or its time-out, not before.

    Its own time-out begins then. One that is requested when another ends finds the client ready.
    """
    line = Line()
    order: list[int] = []

    def note(index: int, promise: Promise[Any]) -> None:
        order.append(index)
        if promise.error is not None:
            read(line, index + 0x10, 0).when_done(partial(note, index + 0x10))

    read(line, 0x1000, 0).when_done(partial(note, 0x1000))
    write(line, b'0123456789', 0x1001).when_done(partial(note, 0x1001))
    for index in (0x1002, 0x1003):
        read(line, index, 0).when_done(partial(note, index))
    line.expect('40 00 10 00 00 00 00 00')
    line.receive('4F 00 10 00 00 00 00 00')
    line.expect('21 01 10 00 0A 00 00 00')
    line.receive('60 01 10 00 00 00 00 00')
    line.receive('80 01 10 00 20 00 00 08')
    assert line.sent[-1] == bytes.fromhex('40 02 10 00 00 00 00 00')
    line.pass_time(TIMEOUT)
    assert line.sent[-1] == bytes.fromhex('40 03 10 00 00 00 00 00')
    line.pass_time(TIMEOUT * 0.9)
    assert order == [0x1000, 0x1001, 0x1002]
    line.receive('4F 03 10 00 2A 00 00 00')
    for index in (0x1011, 0x1012):
        assert line.sent[-1][:3] == bytes((0x40, index & 0xFF, 0x10))
        line.receive(f'4F {index & 0xFF:02X} 10 00 00 00 00 00')
    assert order == [0x1000, 0x1001, 0x1002, 0x1003, 0x1011, 0x1012]


@pytest.mark.parametrize('repeat', [True, False])
def test_a_lost_frame_costs_no_time_out_where_it_may_be_repeated(*, repeat: bool) -> None:
    """A question is repeated; a command must not be given twice because its answer was lost."""
    line = Line()
    promise = read(line) if repeat else write(line, b'1')
    line.client.write(0x2002, 0, b'1', 1.0, repeat=True)
    line.sent.clear()
    line.pass_time(TIMEOUT / 2)
    if repeat:
        line.expect('40 18 10 01 00 00 00 00')
        line.receive('4F 18 10 01 2A 00 00 00')
        assert promise.result() == b'\x2a'
    assert line.client.counters.repeated == repeat
    line.pass_time(TIMEOUT)
    line.sent.clear()
    line.pass_time(0.5)
    line.expect('2F 02 20 00 31 00 00 00')


SEGMENT = '30 31 32 33 34 35 36'
TOO_LONG = '10 00 07 06'
SPOILT: dict[str, tuple[str, tuple[str, ...]]] = {
    'toggle bit': ('00 00 03 05', ('0A 00 00 00', f'10 {SEGMENT}')),
    'length 0': (TOO_LONG, ('00 00 00 00', f'00 {SEGMENT}')),
    'length 3': (TOO_LONG, ('03 00 00 00', f'00 {SEGMENT}')),
    'length 200': (TOO_LONG, ('C8 00 00 00', f'01 {SEGMENT}')),
    'without end': (TOO_LONG, ('0A 00 00 00', *(f'00 {SEGMENT}', f'10 {SEGMENT}') * 5)),
    '4294967295 bytes announced': ('05 00 04 05', ('FF FF FF FF',)),
}
"""Code of the abort; the length that the server announces, and its segments."""


def test_a_transfer_that_is_spoilt_is_no_value() -> None:
    """It is ended, and the server gets the reason."""
    for case, (code, (length, *segments)) in SPOILT.items():
        line = Line()
        promise = read(line)
        for answer in (f'41 18 10 01 {length}', *segments):
            line.receive(answer)
        with pytest.raises(SdoAbortError):
            promise.result()
        aborts = [data.hex(' ') for data in line.sent if data[0] == 0x80]
        assert aborts == [f'80 18 10 01 {code}'], case


LATE: dict[str, str] = {
    'another object': '4F 00 10 00 2A 00 00 00',
    'a segment': '01 01 02 03 04 05 06 07',
    'the acknowledge of a segment': '20 00 00 00 00 00 00 00',
    'the acknowledge of a write': '60 18 10 01 00 00 00 00',
    'the abort of another object': '80 00 10 00 00 00 02 06',
    'a block transfer': 'A0 18 10 01 00 00 00 00',
    'nonsense': 'FF FF FF FF FF FF FF FF',
    'too short': '4F 18',
    'nothing': '',
}


def test_a_late_answer_of_something_else_does_no_harm() -> None:
    """What does not answer an open request, before, in and after it, is counted only."""
    for case, late in LATE.items():
        line = Line()
        line.receive('4F 18 10 01 2A 00 00 00')
        promise = read(line)
        line.receive(late)
        assert not promise.done, case
        line.receive('4F 18 10 01 2A 00 00 00')
        assert promise.result() == b'\x2a'
        line.receive('4F 18 10 01 2A 00 00 00')
        assert line.client.counters.stale == 3, case


def test_a_late_answer_is_not_taken_for_the_next_one_of_its_object() -> None:
    """Another object is read first: a server answers in order, so after that all is new."""
    line = Line()
    first, second = write(line, b'1'), write(line, b'2')
    line.pass_time(TIMEOUT)
    assert isinstance(first.error, SdoTimeoutError)
    assert line.sent.pop() == bytes.fromhex('40 00 10 00 00 00 00 00')
    line.receive('60 01 20 00 00 00 00 00')  # of the first
    assert not second.done
    line.sent.clear()
    line.receive('4F 00 10 00 00 00 00 00')
    line.expect('2F 01 20 00 32 00 00 00')
    line.receive('60 01 20 00 00 00 00 00')
    assert second.error is None
    assert second.done


def test_a_silent_device_is_not_written_to_blindly() -> None:
    """While its state is unknown, the next write of the object waits for an answer."""
    line = Line()
    promises = [write(line, b'1'), write(line, b'2')]
    line.pass_time(TIMEOUT)
    line.pass_time(TIMEOUT)
    for promise in promises:
        with pytest.raises(SdoTimeoutError, match='0x2001:00'):
            promise.result()
    assert [data[0] for data in line.sent if data[0] == 0x2F] == [0x2F]


@given(st.lists(st.sampled_from(['answer', 'late', 'silence']), min_size=1, max_size=6))
def test_every_answer_belongs_to_its_question(fates: list[str]) -> None:
    """Whatever comes late or never: a value that is returned was read after its request."""
    line = Line()
    late: list[bytes] = []
    for number, fate in enumerate(fates):
        server = SdoByteServer(values={(0x1018, 1): bytes((number,)), (0x1000, 0): b'\0'})
        promise = read(line)
        answers = [server.answer(request) or b'' for request in line.sent]
        line.sent.clear()
        for data in late:
            line.receive(data)
        late = answers if fate == 'late' else []
        if fate == 'answer':
            for data in answers:
                line.receive(data)
            line.serve(server.answer)
        for _ in range(3):
            line.pass_time(TIMEOUT / 2)
            if fate == 'answer':
                line.serve(server.answer)
            late += [server.answer(data) or b'' for data in line.sent if fate == 'late']
            line.sent.clear()
        assert promise.done
        if promise.error is None:
            assert promise.result() == bytes((number,))


def test_a_device_that_announces_no_length_is_stopped_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """An upload without end is ended."""
    monkeypatch.setattr('arm_canopen.master.sdo_client.UNANNOUNCED_MAX', 1000)
    line = Line()
    promise = read(line)
    line.receive('40 18 10 01 00 00 00 00')
    toggle = 0
    while not promise.done:
        line.receive(bytes((toggle << 4,)) + bytes(7))
        toggle ^= 1
    with pytest.raises(SdoAbortError, match=r'1001 bytes came'):
        promise.result()


@pytest.mark.parametrize('progress', range(4))
def test_cancelling_ends_all_and_leaves_the_client_ready(progress: int) -> None:
    """Wherever the first transfer stands, all get the reason, and the next ones work.

    Also one that is requested at once, in the clearing.
    """
    line = Line()
    server = SdoByteServer(values={(0x1018, 1): b'\x2a', (0x1018, 2): b'*'})
    promises: list[Promise[Any]] = [write(line, b'0123456789'), read(line), read(line)]
    for _ in range(progress):
        if line.sent and (answer := server.answer(line.sent.pop(0))) is not None:
            line.receive(answer)
    again: list[Promise[bytes]] = []
    promises[-1].when_done(lambda _: again.append(read(line, subindex=2)))
    line.sent.clear()
    line.client.cancel_all('the device restarted')
    assert line.sent[0][0] == 0x80, 'the device got no abort'
    for promise in promises[1:] if progress == 3 else promises:
        with pytest.raises(SdoError, match='joint1: the device restarted'):
            promise.result()
    line.receive('4F 18 10 01 63 00 00 00')
    after = read(line)
    assert not after.done, 'a late answer was taken for the new one'
    del line.sent[:1]
    line.serve(server.answer)
    assert (again[0].result(), after.result()) == (b'*', b'\x2a')
    assert line.defects == []


@pytest.mark.parametrize('writes', [False, True], ids=['read', 'write'])
@pytest.mark.parametrize(
    'progress', [0, 1, 2], ids=['requested', 'first segment', 'second segment']
)
def test_an_urgent_write_ends_what_runs_and_passes_what_waits(
    progress: int, *, writes: bool
) -> None:
    """Those that wait come after it; a read begins again, a write could come twice and fails."""
    line = Line()
    server = SdoByteServer(values={(0x1018, 1): b'0123456789abcdef', (0x1018, 2): b'*'})
    running: Promise[Any] = write(line, b'0123456789abcdefghi') if writes else read(line)
    waiting = read(line, subindex=2)
    for _ in range(progress):
        answer = server.answer(line.sent.pop(0))
        assert answer is not None
        line.receive(answer)
    line.sent.clear()
    urgent = [
        line.client.write(0x6040, 0, data, TIMEOUT, urgent=True) for data in (b'\2\0', b'\0\0')
    ]
    assert running.done is writes
    assert [data[0] for data in line.sent] == [0x80, 0x2B], 'aborted, then written'
    assert not waiting.done
    line.serve(server.answer)
    assert all(promise.result() is None for promise in urgent)
    assert server.values[0x6040, 0] == b'\0\0', 'they changed places'
    assert waiting.result() == b'*'
    if writes:
        with pytest.raises(SdoError, match='joint1: made way for an urgent SDO'):
            running.result()
    else:
        assert running.result() == b'0123456789abcdef'
    assert line.defects == []


def test_an_urgent_write_leaves_while_an_answer_to_the_same_object_is_outstanding() -> None:
    """The device may receive what it does not answer."""
    line = Line()
    for data, request in (
        (b'\2\0', '2B 40 60 00 02 00 00 00'),
        (b'\0\0', '2B 40 60 00' + '00' * 4),
    ):
        line.client.write(0x6040, 0, data, TIMEOUT, urgent=True)
        line.expect(request)
        line.pass_time(TIMEOUT)
        line.sent.clear()


@given(st.lists(st.binary(max_size=8), max_size=30))
def test_no_frames_whatever_break_the_client(garbage: list[bytes]) -> None:
    """Any answers lead to a value or to an SdoError, and the client serves the next request."""
    line = Line()
    promise = read(line)
    for data in garbage:
        line.receive(data)
    line.pass_time(TIMEOUT)
    line.pass_time(TIMEOUT)
    assert promise.done
    assert promise.error is None or isinstance(promise.error, SdoError)
    line.sent.clear()
    again = read(line)
    line.serve(SdoByteServer(values={(0x1018, 1): b'\x2a'}).answer)
    assert again.result() == b'\x2a'
    assert line.defects == []


class BlockLine:
    """A client and a server with a line between that may lose and change frames."""

    def __init__(self) -> None:
        blob = ObjectEntry(BLOB, 0, 'Blob', DataType.DOMAIN)
        self.scheduler = Scheduler()
        self.store = ObjectStore(ObjectDictionary([blob]))
        # all frames that went over the line, as (from the client, data)
        self.frames: list[tuple[bool, bytes]] = []
        # changes a frame on its way; None loses it
        self.spoil: Callable[[bytes], bytes | None] = lambda data: data
        self.room = 1000  # how many frames of the client may wait for the line; it refuses others
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


@settings(max_examples=40)
@given(st.sets(st.integers(1, 250), max_size=6), st.booleans())
@example({40}, False)
@example({40}, True)
def test_lost_segments_are_sent_again(losses: set[int], write: bool) -> None:
    """What comes is the whole value or an error, never something else; one costs no transfer."""
    line = BlockLine()
    value = random.Random(7).randbytes(1200)
    carried = 0

    def lose(data: bytes) -> bytes | None:
        nonlocal carried
        carried += 1
        return None if carried in losses else data

    if not write:
        line.store.find(BLOB).value = value
    line.spoil = lose
    client = line.client
    done: Promise[Any] = (
        client.write(BLOB, 0, value, TIMEOUT)
        if write
        else client.read(BLOB, 0, TIMEOUT, block=True)
    )
    line.run()
    assert done.done
    assert done.error is None or isinstance(done.error, (SdoTimeoutError, SdoAbortError, SdoError))
    if done.error is None:
        assert (line.value if write else done.result()) == value
    assert done.error is None or losses != {40}


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
    line = Line()

    def answer(request: bytes) -> bytes:
        if request[0] >> 5 == 6:
            return bytes.fromhex('80 02 20 00 01 00 04 05')
        if request[0] >> 5 == 1:
            return bytes.fromhex('60 02 20 00 00 00 00 00')
        return bytes((0x20 | request[0] & 0x10,)) + bytes(7)

    for _ in range(2):
        line.client.write(BLOB, 0, bytes(BLOCK_MIN), TIMEOUT)
        line.serve(answer)
    assert (line.client.counters.done, line.client.counters.aborted) == (2, 1)


def test_golden_frames_of_a_write() -> None:
    """300 bytes: two blocks of at most 40 segments, then the end with length and checksum."""
    line = Line()
    sent = line.sent
    value = bytes(number % 251 for number in range(300))
    done = line.client.write(BLOB, 0, value, TIMEOUT)
    assert sent == [bytes.fromhex('C6 02 20 00 2C 01 00 00')]
    line.receive('A4 02 20 00 28 00 00 00')
    for _ in range(10):
        line.pass_time(0.001)
    assert [data[0] for data in sent[1:]] == list(range(1, 41))
    line.receive('A2 28 28 00 00 00 00 00')
    assert [data[0] for data in sent[41:]] == [1, 2, 0x83]
    assert b''.join(data[1:] for data in sent[1:]).rstrip(b'\0') == value.rstrip(b'\0')
    line.receive('A2 03 28 00 00 00 00 00')
    crc = crc_hqx(value, 0).to_bytes(2, 'little')
    assert sent[-1] == bytes((0xC1 | 1 << 2,)) + crc + bytes(5)
    assert not done.done
    line.receive('A1 00 00 00 00 00 00 00')
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
