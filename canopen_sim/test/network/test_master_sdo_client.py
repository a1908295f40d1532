# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The SDO client byte by byte, and against servers that the codecs of the package did not make."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
import gc
from typing import Any

from hypothesis import given
from hypothesis import strategies as st
import pytest
from sdo_byte_server import NO_OBJECT, SdoByteServer

from arm_canopen import BusError, SdoAbortError, SdoError, SdoTimeoutError
from arm_canopen.can import Frame
from arm_canopen.master.scheduler import Promise, Scheduler
from arm_canopen.master.sdo_client import SdoClient
from arm_canopen.standard import DataType, ObjectDictionary, ObjectEntry
from canopen_sim.objects.object_store import ObjectStore
from canopen_sim.services.sdo_server import SdoServer

NODE = 5
REQUEST, RESPONSE = 0x600 + NODE, 0x580 + NODE
TIMEOUT = 0.05  # [s]
ABORTED = '80 {place} 00 00 04 05'  # SDO protocol timed out


class Line:
    """A client whose device is the test.

    Attributes:
        sent: Requests that nobody has answered yet.
        refusal: Why the bus takes no frames; None while it does.
    """

    def __init__(self) -> None:
        """Connect the client."""
        self.scheduler = Scheduler()
        self.defects: list[BaseException] = []
        self.scheduler.on_defect = self.defects.append
        self.sent: list[bytes] = []
        self.refusal: BusError | None = None
        self.client = SdoClient(NODE, 'joint1', self.scheduler, self._take)

    def _take(self, frame: Frame) -> BusError | None:
        assert frame.can_id == REQUEST
        assert len(frame.data) == 8
        if self.refusal is None:
            self.sent.append(frame.data)
        return self.refusal

    def receive(self, answer: bytes | str) -> None:
        """Let the client receive a frame, given as bytes or as hexadecimal text."""
        data = bytes.fromhex(answer) if isinstance(answer, str) else answer
        self.client.receive(Frame(RESPONSE, data))

    def expect(self, request: str) -> None:
        """Check the one request that is open."""
        assert [data.hex(' ') for data in self.sent] == [bytes.fromhex(request).hex(' ')]
        self.sent.clear()

    def pass_time(self, duration: float) -> None:
        """Let time pass in [s]."""
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


Transcript = list[tuple[str, str]]

UPLOADS: dict[str, tuple[Transcript, bytes]] = {
    'expedited, 1 byte': (
        [('40 18 10 01 00 00 00 00', '4F 18 10 01 2A 00 00 00')],
        b'\x2a',
    ),
    'expedited, 4 bytes': (
        [('40 18 10 01 00 00 00 00', '43 18 10 01 01 02 03 04')],
        b'\1\2\3\4',
    ),
    'expedited, length not announced': (
        [('40 18 10 01 00 00 00 00', '42 18 10 01 01 02 03 04')],
        b'\1\2\3\4',
    ),
    'segmented, 10 bytes': (
        [
            ('40 18 10 01 00 00 00 00', '41 18 10 01 0A 00 00 00'),
            ('60 00 00 00 00 00 00 00', '00 30 31 32 33 34 35 36'),
            ('70 00 00 00 00 00 00 00', '19 37 38 39 00 00 00 00'),
        ],
        b'0123456789',
    ),
    'segmented, 7 bytes, length not announced': (
        [
            ('40 18 10 01 00 00 00 00', '40 18 10 01 00 00 00 00'),
            ('60 00 00 00 00 00 00 00', '01 30 31 32 33 34 35 36'),
        ],
        b'0123456',
    ),
    'segmented, empty': (
        [
            ('40 18 10 01 00 00 00 00', '41 18 10 01 00 00 00 00'),
            ('60 00 00 00 00 00 00 00', '0F 00 00 00 00 00 00 00'),
        ],
        b'',
    ),
}

DOWNLOADS: dict[str, tuple[Transcript, bytes]] = {
    'expedited, 1 byte': ([('2F 01 20 00 2A 00 00 00', '60 01 20 00 00 00 00 00')], b'\x2a'),
    'expedited, 3 bytes': ([('27 01 20 00 01 02 03 00', '60 01 20 00 00 00 00 00')], b'\1\2\3'),
    'segmented, 5 bytes': (
        [
            ('21 01 20 00 05 00 00 00', '60 01 20 00 00 00 00 00'),
            ('05 30 31 32 33 34 00 00', '20 00 00 00 00 00 00 00'),
        ],
        b'01234',
    ),
    'segmented, 15 bytes': (
        [
            ('21 01 20 00 0F 00 00 00', '60 01 20 00 00 00 00 00'),
            ('00 30 31 32 33 34 35 36', '20 00 00 00 00 00 00 00'),
            ('10 37 38 39 61 62 63 64', '30 00 00 00 00 00 00 00'),
            ('0D 65 00 00 00 00 00 00', '20 00 00 00 00 00 00 00'),
        ],
        b'0123456789abcde',
    ),
    'empty': (
        [
            ('21 01 20 00 00 00 00 00', '60 01 20 00 00 00 00 00'),
            ('0F 00 00 00 00 00 00 00', '20 00 00 00 00 00 00 00'),
        ],
        b'',
    ),
}


@pytest.mark.parametrize(('transcript', 'value'), UPLOADS.values(), ids=UPLOADS)
def test_upload_transcripts(transcript: Transcript, value: bytes) -> None:
    """Each frame of a read is the one of the standard."""
    line = Line()
    promise = read(line)
    for request, answer in transcript:
        line.expect(request)
        line.receive(answer)
    assert promise.result() == value
    assert not line.sent
    assert line.client.counters.done == 1


@pytest.mark.parametrize(('transcript', 'value'), DOWNLOADS.values(), ids=DOWNLOADS)
def test_download_transcripts(transcript: Transcript, value: bytes) -> None:
    """Each frame of a write is the one of the standard."""
    line = Line()
    promise = write(line, value)
    for request, answer in transcript:
        assert not promise.done
        line.expect(request)
        line.receive(answer)
    assert promise.done
    assert promise.error is None
    assert not line.sent


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


@given(st.binary(max_size=100))
def test_any_value_survives_a_round_trip_with_the_simulated_device(value: bytes) -> None:
    """The client and the server of this package agree, too."""
    domain = ObjectEntry(0x2002, 0, 'Blob', DataType.DOMAIN)
    store = ObjectStore(ObjectDictionary([domain]))
    line = Line()
    server = SdoServer(REQUEST, RESPONSE, store, lambda frame: line.receive(frame.data))

    def hand_over(request: bytes) -> None:
        server.receive(Frame(REQUEST, request), line.scheduler.now)

    written = write(line, value, 0x2002)
    line.serve(hand_over)
    assert written.error is None
    assert store.find(0x2002).value == value
    back = read(line, 0x2002, 0)
    line.serve(hand_over)
    assert back.result() == value


def test_a_refusal_is_said_with_place_and_meaning() -> None:
    """An abort names the device, the object and the code in words, and keeps the code."""
    line = Line()
    server = SdoByteServer()
    promise = read(line, 0x6098, 2)
    line.serve(server.answer)
    with pytest.raises(
        SdoAbortError, match=r'joint1 \(node 5\) refused object 0x6098:02: object does not exist'
    ) as caught:
        promise.result()
    assert caught.value.code == NO_OBJECT
    assert line.client.counters.aborted == 1


def test_an_abort_with_index_0_counts() -> None:
    """Some servers leave the object out of their aborts."""
    line = Line()
    promise = read(line)
    line.receive('80 00 00 00 00 00 02 06')
    assert isinstance(promise.error, SdoAbortError)


def test_an_abort_of_an_unknown_code_is_said_all_the_same() -> None:
    """A vendor's code is shown as a number."""
    line = Line()
    promise = read(line)
    line.receive('80 18 10 01 EF BE AD DE')
    with pytest.raises(SdoAbortError, match='0xDEADBEEF'):
        promise.result()


def test_an_abort_in_the_middle_of_segments_ends_the_transfer() -> None:
    """The next one in the queue is not disturbed by it."""
    line = Line()
    first, second = write(line, b'0123456789'), read(line)
    line.receive('60 01 20 00 00 00 00 00')
    line.receive('80 01 20 00 20 00 00 08')
    assert isinstance(first.error, SdoAbortError)
    line.receive('4F 18 10 01 2A 00 00 00')
    assert second.result() == b'\x2a'


def test_silence_ends_in_a_time_out_that_is_reported_to_the_server() -> None:
    """Not before the time-out; the server gets an abort, the caller the place and the time."""
    line = Line()
    promise = write(line, b'x')
    line.sent.clear()
    line.pass_time(TIMEOUT * 0.99)
    assert not promise.done
    line.pass_time(TIMEOUT * 0.02)
    with pytest.raises(SdoTimeoutError, match=r'joint1 .*0x2001:00 within 50 ms'):
        promise.result()
    line.expect(ABORTED.format(place='01 20 00'))
    assert line.client.counters.timed_out == 1


def test_a_request_that_the_bus_refuses_is_no_silence_of_the_device() -> None:
    """The error says so, and no answer is awaited that could be taken for a later one."""
    line = Line()
    line.refusal = BusError('the transmit queue is full')
    promise = write(line, b'\x01', 0x1018, 1)
    line.pass_time(TIMEOUT)
    with pytest.raises(SdoTimeoutError, match='was not sent: the transmit queue is full'):
        promise.result()
    line.refusal = None
    read(line)
    line.expect('40 18 10 01 00 00 00 00')


def test_a_request_that_the_bus_refuses_for_a_moment_is_sent_later() -> None:
    """Once, also one that must not be repeated, as it has not left before."""
    line = Line()
    line.refusal = BusError('the transmit queue is full')
    promise = write(line, b'\x01', 0x1018, 1)
    line.pass_time(0.2 * TIMEOUT)
    line.refusal = None
    line.pass_time(0.2 * TIMEOUT)
    line.expect('2F 18 10 01 01 00 00 00')
    line.receive('60 18 10 01 00 00 00 00')
    promise.result()


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


def test_the_time_out_begins_when_the_transfer_does() -> None:
    """A transfer that waits in the queue does not time out there."""
    line = Line()
    first, second = read(line, 0x1000, 0), read(line)
    line.pass_time(TIMEOUT)
    assert isinstance(first.error, SdoTimeoutError)
    line.pass_time(TIMEOUT * 0.9)
    assert not second.done
    line.receive('4F 18 10 01 2A 00 00 00')
    assert second.result() == b'\x2a'


def test_transfers_go_one_after_another_in_their_order() -> None:
    """The second request leaves when the first is answered, not before."""
    line = Line()
    order: list[int] = []

    def note(index: int, _: Promise[bytes]) -> None:
        order.append(index)

    for index in (0x1000, 0x1001, 0x1002):
        read(line, index, 0).when_done(partial(note, index))
    for index in (0x1000, 0x1001, 0x1002):
        line.expect(f'40 {index & 0xFF:02X} 10 00 00 00 00 00')
        line.receive(f'4F {index & 0xFF:02X} 10 00 00 00 00 00')
    assert order == [0x1000, 0x1001, 0x1002]


def test_a_transfer_may_be_requested_when_another_one_ends() -> None:
    """A callback that reads again finds the client ready."""
    line = Line()
    second: list[Promise[bytes]] = []
    read(line).when_done(lambda _: second.append(read(line, 0x1000, 0)))
    line.sent.clear()
    line.receive('4F 18 10 01 01 00 00 00')
    line.expect('40 00 10 00 00 00 00 00')
    line.receive('4F 00 10 00 02 00 00 00')
    assert second[0].result() == b'\2'


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


@pytest.mark.parametrize('late', LATE.values(), ids=LATE)
def test_a_late_answer_of_something_else_does_no_harm(late: str) -> None:
    """What does not answer the open request is counted and passed over."""
    line = Line()
    promise = read(line)
    line.receive(late)
    assert not promise.done
    assert line.client.counters.stale == 1
    line.receive('4F 18 10 01 2A 00 00 00')
    assert promise.result() == b'\x2a'


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


def test_a_lost_frame_costs_a_read_no_time_out() -> None:
    """The question is repeated, and a second answer does no harm."""
    line = Line()
    promise = read(line)
    line.sent.clear()
    line.pass_time(TIMEOUT / 2)
    line.expect('40 18 10 01 00 00 00 00')
    line.receive('4F 18 10 01 2A 00 00 00')
    assert promise.result() == b'\x2a'
    assert (line.client.counters.repeated, line.client.counters.timed_out) == (1, 0)


def test_only_writes_that_may_be_repeated_are() -> None:
    """A command must not be given twice because its confirmation was lost."""
    line = Line()
    write(line, b'1')
    line.client.write(0x2002, 0, b'1', 1.0, repeat=True)
    line.pass_time(TIMEOUT)
    line.sent.clear()
    line.pass_time(0.5)
    line.expect('2F 02 20 00 31 00 00 00')


def test_an_answer_without_a_question_is_counted() -> None:
    """Before, between and after transfers."""
    line = Line()
    line.receive('4F 18 10 01 2A 00 00 00')
    promise = read(line)
    line.receive('4F 18 10 01 2A 00 00 00')
    line.receive('4F 18 10 01 2A 00 00 00')
    assert promise.done
    assert line.client.counters.stale == 2


def test_a_segment_of_a_transfer_that_timed_out_is_not_taken_for_another() -> None:
    """The late segment of one object does not become data of the next."""
    line = Line()
    read(line, 0x1008, 0)
    line.receive('41 08 10 00 07 00 00 00')
    line.pass_time(TIMEOUT)
    line.sent.clear()
    second = read(line, 0x1009, 0)
    line.receive('01 4C 61 74 65 00 00 00')
    line.receive('41 09 10 00 07 00 00 00')
    line.receive('01 47 6F 6F 64 21 21 21')
    assert second.result() == b'Good!!!'


def test_a_wrong_toggle_bit_ends_the_transfer() -> None:
    """The server gets an abort."""
    line = Line()
    promise = read(line)
    line.receive('41 18 10 01 0A 00 00 00')
    line.sent.clear()
    line.receive('10 30 31 32 33 34 35 36')
    with pytest.raises(SdoAbortError, match='toggle bit'):
        promise.result()
    line.expect('80 18 10 01 00 00 03 05')


@pytest.mark.parametrize('size', [0, 3, 9, 200])
def test_a_length_that_does_not_fit_ends_the_transfer(size: int) -> None:
    """More or fewer bytes than were announced are no value."""
    line = Line()
    promise = read(line)
    line.receive(b'\x41\x18\x10\x01' + size.to_bytes(4, 'little'))
    line.receive('00 30 31 32 33 34 35 36')
    line.receive('19 37 38 39 00 00 00 00')
    with pytest.raises(SdoAbortError, match='length'):
        promise.result()
    assert line.sent[-1] == bytes.fromhex('80 18 10 01 10 00 07 06')


def test_a_device_that_never_comes_to_an_end_is_stopped() -> None:
    """More data than were announced are not collected for ever."""
    line = Line()
    promise = read(line)
    line.receive('41 18 10 01 0A 00 00 00')
    toggle = 0
    for _ in range(10):
        line.receive(bytes((toggle << 4,)) + bytes(7))
        toggle ^= 1
    assert isinstance(promise.error, SdoAbortError)


def test_a_device_that_announces_no_length_is_stopped_too(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
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


def test_more_than_a_device_can_have_is_not_begun() -> None:
    """A length of 4 GiB is a defect of the device."""
    line = Line()
    promise = read(line)
    line.receive('41 18 10 01 FF FF FF FF')
    with pytest.raises(SdoAbortError, match='4294967295 bytes announced'):
        promise.result()


def test_garbage_does_not_look_like_silence() -> None:
    """The time-out says that answers came which were none to this request."""
    line = Line()
    promise = read(line)
    for _ in range(3):
        line.receive('FF FF FF FF FF FF FF FF')
    line.pass_time(TIMEOUT)
    with pytest.raises(SdoTimeoutError, match=r'3 frames .* do not belong'):
        promise.result()


@pytest.mark.parametrize('progress', range(4))
def test_cancelling_ends_all_and_leaves_the_client_ready(progress: int) -> None:
    """Wherever the first transfer stands, all get the reason, and the next one works."""
    line = Line()
    server = SdoByteServer(values={(0x1018, 1): b'\x2a'})
    promises: list[Promise[Any]] = [write(line, b'0123456789'), read(line), read(line)]
    for _ in range(progress):
        if line.sent and (answer := server.answer(line.sent.pop(0))) is not None:
            line.receive(answer)
    line.sent.clear()
    line.client.cancel_all('the device restarted')
    assert [data[0] for data in line.sent] == [0x80], 'the device got no abort'
    for promise in promises[1:] if progress == 3 else promises:
        with pytest.raises(SdoError, match='joint1: the device restarted'):
            promise.result()
    line.sent.clear()
    line.receive('4F 18 10 01 63 00 00 00')
    after = read(line)
    assert not after.done, 'a late answer was taken for the new one'
    line.serve(server.answer)
    assert after.result() == b'\x2a'
    assert line.defects == []


@pytest.mark.parametrize(
    'progress', [0, 1, 2], ids=['requested', 'first segment', 'second segment']
)
def test_an_urgent_write_ends_what_runs_and_passes_what_waits(progress: int) -> None:
    """Those that wait come after it; the read that ran begins again before them."""
    line = Line()
    server = SdoByteServer(values={(0x1018, 1): b'0123456789abcdef', (0x1018, 2): b'*'})
    running, waiting = read(line), read(line, subindex=2)
    for _ in range(progress):
        answer = server.answer(line.sent.pop(0))
        assert answer is not None
        line.receive(answer)
    line.sent.clear()
    urgent = [
        line.client.write(0x6040, 0, data, TIMEOUT, urgent=True) for data in (b'\2\0', b'\0\0')
    ]
    assert not running.done
    assert [data[0] for data in line.sent] == [0x80, 0x2B], 'aborted, then written'
    assert not waiting.done
    line.serve(server.answer)
    assert all(promise.result() is None for promise in urgent)
    assert server.values[0x6040, 0] == b'\0\0', 'they changed places'
    assert (running.result(), waiting.result()) == (b'0123456789abcdef', b'*')
    assert line.defects == []


def test_a_write_that_makes_way_for_an_urgent_one_fails() -> None:
    """The device may have it already, and must not get it twice."""
    line = Line()
    running = write(line, b'0123456789')
    line.client.write(0x6040, 0, b'\2\0', TIMEOUT, urgent=True)
    with pytest.raises(SdoError, match='joint1: made way for an urgent SDO'):
        running.result()


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


def test_who_requests_again_when_cancelled_is_served_after_it() -> None:
    """A caller that repeats at once does not get lost in the clearing."""
    line = Line()
    again: list[Promise[bytes]] = []
    first = read(line)
    first.when_done(lambda _: again.append(read(line)))
    line.client.cancel_all('the device restarted')
    assert not again[0].done
    line.sent = line.sent[-1:]
    line.serve(SdoByteServer(values={(0x1018, 1): b'\x2a'}).answer)
    assert again[0].result() == b'\x2a'


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


def test_transfers_that_a_master_leaves_in_the_queue_are_no_lost_coroutines(
    recwarn: pytest.WarningsRecorder,
) -> None:
    """It ends with them, and Python finds nothing to warn of."""
    line = Line()
    for number in range(3):
        line.client.write(0x2000 + number, 0, b'1', TIMEOUT)
        line.client.read(0x2000 + number, 0, TIMEOUT)
    del line
    gc.collect()
    assert [str(warning.message) for warning in recwarn] == []
