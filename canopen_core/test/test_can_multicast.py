# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The multicast bus: python-can as its peer, losses, foreign frames, loopback interface."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
import os
from pathlib import Path
import re
import socket
from threading import current_thread, Thread, Timer
from time import monotonic, sleep, time_ns

import can
from can.interfaces.udp_multicast.utils import pack_message
from can_addresses import DEADLINE, free_multicast, receive_count, unstamped
from can_strategies import frames
from hypothesis import example, given
from hypothesis import strategies as st
import msgpack
import pytest

from canopen_core import BusError, CodecError
from canopen_core.can import Bus, Frame, open_bus
from canopen_core.can.adapter import from_message, to_message
from canopen_core.can.multicast import _is_local, decode, encode, MulticastBus
from canopen_core.can.socket_bus import datagram_reader, library
from canopen_core.can.socketcan import pack

FRAMES = [
    Frame(0x000, b'\x01\x05'),
    Frame(0x080),
    Frame(0x181, bytes(range(8))),
    Frame(0x1FFF_FFFF, b'x', is_extended=True),
    Frame(0x705, is_remote=True),
]


@pytest.fixture
def name() -> str:
    """Name a group of one's own."""
    return free_multicast()


@pytest.fixture
def bus(name: str) -> Iterator[Bus]:
    """Open our bus."""
    with open_bus(name) as opened:
        yield opened


@pytest.fixture
def peer(name: str) -> Iterator[can.BusABC]:
    """Open python-can's own udp_multicast on the same group."""
    _, group, port = name.split(':')
    try:
        opened = can.Bus(interface='udp_multicast', channel=group, port=int(port))
    except can.CanInitializationError as error:
        pytest.skip(f'python-can finds no multicast route here: {error}')
    with opened:
        yield opened


def send_raw(name: str, datagram: bytes) -> None:
    """Send bytes to the group from this host, as any program could."""
    _, group, port = name.split(':')
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton('127.0.0.1'))
        sender.sendto(datagram, (group, int(port)))


def test_python_can_and_we_receive_each_other(bus: Bus, peer: can.BusABC) -> None:
    """What one side sends the other reads, in order and once."""
    for frame in FRAMES:
        bus.send(frame)
    messages = [peer.recv(DEADLINE) for _ in FRAMES]
    assert [from_message(message, 0.0) for message in messages if message] == FRAMES
    for frame in FRAMES:
        peer.send(to_message(frame))
    assert unstamped(receive_count(bus, len(FRAMES))) == FRAMES
    assert bus.receive(0.0) == []


def test_fd_frames_and_garbage_are_counted_and_dropped(bus: Bus, name: str) -> None:
    """What is no classic CAN frame costs a count, and what follows still arrives."""
    large = pack_message(can.Message(is_fd=True, data=bytes(64), is_extended_id=False))
    small = {'arbitration_id': 0x181, 'is_extended_id': False, 'is_fd': True, 'data': b'\x27'}
    wrong = (b'', b'garbage', bytes(5000), large, msgpack.packb(small), msgpack.packb([1, 2]))
    for datagram in (*wrong, b'\x80'):
        send_raw(name, datagram)
    with open_bus(name) as other:
        other.send(Frame(5))
    frames = receive_count(bus, 2)  # an empty map is a frame for python-can: all defaults
    assert unstamped(frames) == [Frame(0, is_extended=True), Frame(5)]
    assert bus.counters.malformed == len(wrong)


def test_other_groups_on_the_same_port_are_not_received(bus: Bus, name: str) -> None:
    """Two robots may share a port as long as their groups differ."""
    kind, group, port = name.split(':')
    head, _, last = group.rpartition('.')
    neighbour = f'{kind}:{head}.{int(last) % 250 + 3}:{port}'
    with open_bus(neighbour) as other, open_bus(name) as same:
        other.send(Frame(1))
        same.send(Frame(2))
    assert unstamped(receive_count(bus, 1)) == [Frame(2)]
    assert bus.receive(0.0) == []


def test_losses_are_counted_and_reported_once(name: str, caplog: pytest.LogCaptureFixture) -> None:
    """When the receive buffer is full the kernel drops, and the bus knows how many."""
    sent = 3000
    with open_bus(name) as sender, open_bus(name) as late:
        assert isinstance(late, MulticastBus)
        late._receiver.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 65536)
        for _ in range(sent):
            sender.send(Frame(1))
        got = len(late.receive(0.0))
        assert 0 < got < sent
        sender.send(Frame(2))  # the kernel reports the count with the next frame
        assert unstamped(receive_count(late, 1)) == [Frame(2)]
        assert late.counters.lost == sent - got
        for _ in range(sent):
            sender.send(Frame(1))
        receive_count(late, got)
        sender.send(Frame(2))
        receive_count(late, 1)
        assert late.counters.lost > sent - got
    (warning,) = [record.message for record in caplog.records if 'lost' in record.message]
    assert 'sysctl -w net.core.rmem_max' in warning


def test_frames_stay_on_the_loopback_interface(bus: Bus, name: str) -> None:
    """The sending socket names the loopback interface and gives no hop.

    No two buses share the address that a receiver blocks as its own. python-can opens the group
    on the network, so the address of a sender is checked.
    """
    with open_bus(name) as other:
        assert isinstance(bus, MulticastBus)
        assert isinstance(other, MulticastBus)
        assert bus._own_address[0] != other._own_address[0]
        for each in (bus, other):
            options = each._sender
            interface = options.getsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, 4)
            assert socket.inet_ntoa(interface) == '127.0.0.1'
            assert options.getsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL) == 0
            assert _is_local(each._own_address[0])
    assert not _is_local('192.0.2.77')  # TEST-NET-1, nobody's


def test_stamps_do_not_go_back_when_the_wall_clock_is_set(
    bus: Bus, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The kernel stamps with the wall clock; setting it neither ages nor rejuvenates a frame."""
    stamps = []
    with open_bus(name) as sender:
        for shift in (0, 3600, -7200):  # [s]
            monkeypatch.setattr(
                'canopen_core.can.bus.time_ns', lambda s=shift: time_ns() + s * 10**9
            )
            sender.send(Frame(1))
            stamps += [frame.timestamp for frame in receive_count(bus, 1)]
    assert len(stamps) == 3
    assert stamps == sorted(stamps)
    assert stamps[-1] <= monotonic()


def test_a_pause_while_clocks_are_compared_moves_no_stamp(
    bus: Bus, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A busy computer takes the processor away between the readings of two clocks."""

    def pause(seconds: float) -> int:
        sleep(seconds)
        return time_ns()

    with open_bus(name) as sender:
        monkeypatch.setattr('canopen_core.can.bus.time_ns', lambda: pause(0.05))
        before = monotonic()
        sender.send(Frame(1))
        (frame,) = receive_count(bus, 1)
    assert before - 1e-3 <= frame.timestamp <= before + 0.04


def test_wrong_groups_and_ports_are_refused_with_the_reason() -> None:
    """Each mistake in the name is reported, with what would be right."""
    ports = {f'239.1.2.3:{port}': 'no UDP port' for port in ('', '0', '65536', 'x')}
    for address, reason in {
        'ff15::1': 'IPv6',
        '[ff15::1]': 'no IP address',
        'ff15:7079:7468:6f6e:6465:6d6f:6d63:6173': 'IPv6',
        '10.0.0.1': 'no multicast address',
        'localhost': 'no IP address',
        **ports,
    }.items():
        wrong = f'udp_multicast:{address}'
        with pytest.raises(BusError, match=f'^{re.escape(wrong)}: .*{reason}'):
            open_bus(wrong)


def test_a_wake_writes_to_no_descriptor_that_was_closed(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It may be a file of somebody else by then: a thread hands work over while the bus ends."""
    opened, write, states = open_bus(name), os.eventfd_write, []
    closing = Thread(target=opened.close)

    def write_late(descriptor: int, value: int) -> None:
        if current_thread() is not closing:
            closing.start()
            closing.join(0.2)  # it must not get further while this thread has the descriptor
            states.append(os.fstat(descriptor))
        write(descriptor, value)

    monkeypatch.setattr(os, 'eventfd_write', write_late)
    opened.wake()
    monkeypatch.undo()
    closing.join(10.0)
    assert not closing.is_alive()
    assert len(states) == 1


@given(frames(), st.floats(0.0, 2e9), st.one_of(st.none(), st.text(), st.integers(0, 9)))
def test_bytes_equal_those_of_python_can(
    frame: Frame, stamp: float, channel: str | int | None
) -> None:
    """What was encoded comes back, with the receiver's stamp.

    Replayed python-can messages have a time and a channel, too, and mean the same.
    """
    assert encode(frame) == pack_message(to_message(frame))
    assert decode(encode(frame), stamp) == frame._replace(timestamp=stamp)
    message = to_message(frame, stamp)
    message.channel = channel
    assert decode(pack_message(message), 0.0) == frame


@given(frames(), st.randoms())
def test_the_order_of_the_keys_means_nothing(frame: Frame, shuffler: st.DataObject) -> None:
    """Another implementation may write the map in another order, or leave defaults out."""
    fields = list(msgpack.unpackb(encode(frame)).items())
    shuffler.shuffle(fields)  # type: ignore[attr-defined]  # a random.Random
    assert decode(msgpack.packb(dict(fields)), 0.0) == frame
    needed = {'arbitration_id', 'is_extended_id', 'is_remote_frame', 'dlc', 'data'}
    assert decode(msgpack.packb({k: v for k, v in fields if k in needed}), 0.0) == frame


@st.composite
def damaged(draw: st.DrawFn) -> bytes:
    """Return a datagram with another byte in one place."""
    datagram = bytearray(encode(draw(frames())))
    datagram[draw(st.integers(0, len(datagram) - 1))] = draw(st.integers(0, 255))
    return bytes(datagram)


@given(st.one_of(st.binary(max_size=200), damaged()))
@example(b'')
@example(b'\x8b')
@example(encode(Frame(0x181, bytes(8)))[:-1])
@example(encode(Frame(0x181, bytes(8))) + b'\0')
@example(b'\x93' * 200)
def test_any_bytes_are_a_possible_frame_or_refused(datagram: bytes) -> None:
    """Garbage and damage raise the one error that the bus counts."""
    try:
        frame = decode(datagram, 0.0)
    except CodecError:
        return
    encode(frame)


@pytest.mark.parametrize(
    ('datagram', 'reason'),
    [
        (msgpack.packb({'is_fd': True}), 'CAN FD'),
        (msgpack.packb({'arbitration_id': 'x'}), "identifier 'x'"),
        (msgpack.packb({'data': 'text'}), "payload 'text'"),
        (b'\xc1', 'no msgpack'),
    ],
)
def test_what_is_no_classic_frame_is_named(datagram: bytes, reason: str) -> None:
    """Each way to be wrong has its own message."""
    with pytest.raises(CodecError, match=reason):
        decode(datagram, 0.0)


@given(sent=st.lists(st.tuples(frames(), st.integers(-1, 170), st.binary(min_size=1, max_size=3))))
def test_compiled_and_python_reader_receive_the_same(
    sent: list[tuple[Frame, int, bytes]],
) -> None:
    """Whole frames, and datagrams of which bytes are replaced or that are cut short."""
    name = free_multicast()
    with open_bus(name) as compiled, open_bus(name) as reference:
        assert isinstance(compiled, MulticastBus)
        assert compiled._reader is not None  # machines for tests have a compiler
        assert isinstance(reference, MulticastBus)
        reference._reader = None
        for frame, at, damage in sent:
            datagram = encode(frame)
            if at >= 0:
                datagram = datagram[:at] + (damage + datagram[at + len(damage) :])[at % 5 * 60 :]
            send_raw(name, datagram)
        send_raw(name, encode(LAST))
        both = [_until_last(bus) for bus in (compiled, reference)]
        assert both[0] == both[1]
        assert compiled.counters == reference.counters


LAST = Frame(0x1FFF_FFF0, b'last', is_extended=True)


def _until_last(bus: Bus) -> list[Frame]:
    """Receive up to the last frame of a test; without time stamps, which may not go back."""
    received: list[Frame] = []
    while LAST not in unstamped(received[-1:]):
        received += bus.receive(DEADLINE)
    stamps = [frame.timestamp for frame in received]
    assert stamps == sorted(stamps)
    assert stamps[-1] == pytest.approx(monotonic(), abs=DEADLINE)
    return unstamped(received)


def test_a_batch_of_process_data_is_received_at_once(bus: Bus, name: str) -> None:
    """Receiving waits for as many PDOs as are expected, at most its time-out or until a wake.

    EMCY, SDO, heartbeat and SYNC are received at once.
    """
    bus.batch = 3
    with open_bus(name) as other:

        def send() -> None:
            for number in (0x181, 0x281, 0x381):
                sleep(0.02)
                other.send(Frame(number))

        sender = Thread(target=send)
        sender.start()
        assert len(bus.receive(DEADLINE)) == 3
        sender.join()
        other.send(Frame(0x182))
        begin = monotonic()
        assert len(bus.receive(0.05)) == 1
        assert monotonic() - begin >= 0.05
        assert len(bus.receive(0.0)) == 0
        other.send(Frame(0x181))
        waker = Timer(0.05, bus.wake)
        waker.start()
        assert unstamped(bus.receive(DEADLINE)) == [Frame(0x181)]
        waker.join()
        for urgent in (Frame(0x081), Frame(0x582), Frame(0x701), Frame(0x80)):
            other.send(Frame(0x181))
            other.send(urgent)
            received = receive_count(bus, 2, deadline=DEADLINE / 2)
            assert unstamped(received) == [Frame(0x181), urgent]


def test_a_failure_within_a_batch_follows_the_frames_before_it() -> None:
    """What has come is received; the next receive reports the error of the socket."""
    reader = datagram_reader()
    assert reader is not None
    frames: list[Frame] = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        peer = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        peer.bind(('127.0.0.1', 0))
        sock.connect(peer.getsockname())
        peer.connect(sock.getsockname())
        peer.send(pack(FRAMES[2]))

        def fail() -> None:
            peer.close()
            sock.send(b'refused')

        failing = Timer(0.05, fail)
        failing.start()
        descriptors = sock.fileno(), os.eventfd(0)
        receive = partial(reader.receive, descriptors, DEADLINE, 3, frames, lambda *_: None)
        try:
            assert receive() == 1
            with pytest.raises(ConnectionRefusedError):
                receive()
        finally:
            failing.join()
            os.close(descriptors[1])
    assert unstamped(frames) == [FRAMES[2]]


def test_without_a_compiler_there_is_one_warning(
    name: str, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, tmp_path: Path
) -> None:
    """And frames are received in Python."""
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path))
    monkeypatch.setenv('CC', '/bin/false')
    library.cache_clear()
    try:
        with open_bus(name) as bus, open_bus(name) as other:
            other.send(FRAMES[0])
            assert unstamped(receive_count(bus, 1)) == FRAMES[:1]
    finally:
        library.cache_clear()
    (warning,) = caplog.records
    assert 'CAN frames are read in Python' in warning.getMessage()
