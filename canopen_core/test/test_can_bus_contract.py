# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What every bus promises, checked on every implementation."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from functools import partial
import math
import socket
from threading import Thread, Timer
from time import monotonic, sleep
from typing import TypeAlias

from can_addresses import free_multicast, free_virtual
from can_receiving import DEADLINE, receive_count, unstamped
import pytest

from canopen_core import BusError
from canopen_core.can import Bus, can_interfaces, Frame, open_bus
from canopen_core.can.adapter import AdapterBus
from canopen_core.can.socket_bus import SocketBus

Open: TypeAlias = Callable[[], Bus]
VCAN = 'vcan0'


def _open_virtual() -> Open:
    name = free_virtual()
    return lambda: open_bus(name)


def _open_multicast() -> Open:
    name = free_multicast()
    return lambda: open_bus(name)


def _open_multicast_in_python() -> Open:
    name = free_multicast()

    def connect() -> Bus:
        bus = open_bus(name)
        assert isinstance(bus, SocketBus)
        bus._reader = None  # as without a C compiler
        return bus

    return connect


def _open_adapter() -> Open:
    channel = free_virtual()  # python-can's in-process interface, behind our adapter
    return lambda: AdapterBus(f'python-can {channel}', 'virtual', channel, None)


def _open_socketcan() -> Open:
    interface = can_interfaces().get(VCAN)
    if interface is None or not interface.is_up:
        pytest.skip(f'this host has no {VCAN} that is up')
    return lambda: open_bus(VCAN)


MAKERS = [
    pytest.param(_open_virtual, id='virtual'),
    pytest.param(_open_multicast, id='multicast'),
    pytest.param(_open_multicast_in_python, id='multicast, without a compiler'),
    pytest.param(_open_adapter, id='adapter'),
    pytest.param(_open_socketcan, id='socketcan', marks=pytest.mark.vcan),
]


@pytest.fixture(params=MAKERS)
def connect(request: pytest.FixtureRequest) -> Iterator[Open]:
    """Open any number of buses on one new wire; all are closed in the end."""
    opened = request.param()
    with ExitStack() as stack:
        yield lambda: stack.enter_context(opened())


FRAMES = [
    Frame(0x000, b'\x01\x00'),
    Frame(0x080),
    Frame(0x07F, b'\x00'),
    Frame(0x0FF, bytes(range(8))),
    Frame(0x181, b'\xff' * 8),
    Frame(0x7FF, b'\x05'),
    Frame(0x701, is_remote=True),
    Frame(0x000, b'abc', is_extended=True),
    Frame(0x1FFF_FFFF, b'12345678', is_extended=True),
    Frame(0x0001_0000, is_extended=True, is_remote=True),
]


def test_frames_arrive_unchanged_and_in_order(connect: Open) -> None:
    """Identifiers, lengths, both formats and remote requests all survive; each side counts."""
    sender, receiver = connect(), connect()
    for frame in FRAMES:
        sender.send(frame)
    assert unstamped(receive_count(receiver, len(FRAMES))) == FRAMES
    assert (sender.counters.sent, sender.counters.received) == (len(FRAMES), 0)
    assert (receiver.counters.sent, receiver.counters.received) == (0, len(FRAMES))
    assert (receiver.counters.lost, receiver.counters.malformed) == (0, 0)


def test_everybody_else_receives_and_the_sender_does_not(connect: Open) -> None:
    """A frame reaches all others once, and its own echo is never delivered."""
    buses = [connect() for _ in range(3)]
    for number, bus in enumerate(buses):
        bus.send(Frame(number))
    for number, bus in enumerate(buses):
        others = [Frame(other) for other in range(3) if other != number]
        assert unstamped(receive_count(bus, 2)) == others
        assert bus.receive(0.0) == []


def capacity(bus: Bus) -> int:
    """Return how many frames surely fit the receive buffer; the kernel takes 832 bytes for one."""
    if not isinstance(bus, SocketBus):
        return 100_000
    return bus._receiver.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF) // 1024


def test_a_burst_is_not_lost(connect: Open) -> None:
    """Two thousand frames at once, half a second of a fast arm, wait for a late reader.

    Where the kernel does not grant the buffer for as many, those that fit are not lost.
    """
    sender, receiver = connect(), connect()
    count = min(2000, capacity(receiver))
    burst = [Frame(number % 0x800, number.to_bytes(4, 'little')) for number in range(count)]
    for frame in burst:
        sender.send(frame)
    assert unstamped(receive_count(receiver, len(burst))) == burst
    assert receiver.counters.lost == 0


def test_time_stamps_are_steady_time_of_arrival(connect: Open) -> None:
    """Stamps never go back, and lie between sending and reading."""
    sender, receiver = connect(), connect()
    before = monotonic()
    for frame in FRAMES:
        sender.send(frame)
    frames = receive_count(receiver, len(FRAMES))
    after = monotonic()
    stamps = [frame.timestamp for frame in frames]
    assert stamps == sorted(stamps)
    skew = 1e-3  # [s] between the clock of the stamps and the steady one
    assert before - skew <= stamps[0]
    assert stamps[-1] <= after + skew


def test_a_timeout_is_waited_for_and_zero_only_looks(connect: Open) -> None:
    """An empty bus makes receive wait for its time-out; no time-out and negative ones return."""
    bus = connect()
    start = monotonic()
    assert bus.receive(0.0) == []
    assert bus.receive(-1.0) == []
    assert bus.receive(0.05) == []
    assert monotonic() - start >= 0.05


def test_receive_returns_what_is_there_although_it_could_wait(connect: Open) -> None:
    """A frame that has arrived ends the waiting."""
    sender, receiver = connect(), connect()
    sender.send(Frame(1))
    assert unstamped(receiver.receive(math.inf)) == [Frame(1)]


def test_a_wait_without_an_end_lasts_until_it_is_woken(connect: Open) -> None:
    """However far the receiver has come by then."""
    bus = connect()
    alarm = Timer(0.05, bus.wake)
    alarm.start()
    assert bus.receive(math.inf) == []
    alarm.join(DEADLINE)


def test_a_wake_before_the_wait_is_not_forgotten_and_counts_once(connect: Open) -> None:
    """The next receive returns, however often it was woken, and the one after waits again."""
    bus = connect()
    bus.wake()
    bus.wake()
    assert bus.receive(math.inf) == []
    start = monotonic()
    assert bus.receive(0.02) == []
    assert monotonic() - start >= 0.02


def test_threads_may_send_together(connect: Open) -> None:
    """Frames of several threads are neither lost nor mixed up, and each keeps its order."""
    sender, receiver = connect(), connect()
    threads, count = 4, 100

    def send(thread: int) -> None:
        for number in range(count):
            sender.send(Frame(thread, number.to_bytes(2, 'little')))

    workers = [Thread(target=send, args=(thread,)) for thread in range(threads)]
    for worker in workers:
        worker.start()
    frames = receive_count(receiver, threads * count)
    for worker in workers:
        worker.join(DEADLINE)
    assert sender.counters.sent == threads * count
    for thread in range(threads):
        numbers = [int.from_bytes(f.data, 'little') for f in frames if f.can_id == thread]
        assert numbers == list(range(count))


@pytest.mark.parametrize(
    'frame',
    [
        Frame(0x800),
        Frame(-1),
        Frame(0x2000_0000, is_extended=True),
        Frame(1, bytes(9)),
    ],
    ids=['11 bits', 'negative', '29 bits', 'payload'],
)
def test_what_is_no_can_frame_is_refused(connect: Open, frame: Frame) -> None:
    """A wrong identifier or payload is the caller's mistake, and nothing is sent."""
    sender, receiver = connect(), connect()
    with pytest.raises(ValueError, match=r'out of range|at most 8'):
        sender.send(frame)
    sender.send(Frame(1))
    assert unstamped(receive_count(receiver, 1)) == [Frame(1)]
    assert sender.counters.sent == 1


def test_closing_twice_is_no_error_and_a_closed_bus_says_so(connect: Open) -> None:
    """A closed bus refuses work by name, and the others go on."""
    bus, other, third = connect(), connect(), connect()
    bus.close()
    bus.close()
    bus.wake()
    with pytest.raises(BusError, match='closed'):
        bus.send(Frame(1))
    with pytest.raises(BusError, match='closed'):
        bus.receive(0.0)
    other.send(Frame(2))
    assert unstamped(receive_count(third, 1)) == [Frame(2)]


def use_until_closed(work: Callable[[], object]) -> None:
    """Use a bus again and again; only its end may end that."""
    with pytest.raises(BusError, match='closed'):
        deque(iter(work, 'no end'), maxlen=0)


def test_threads_may_close_and_open_buses_while_others_use_them(connect: Open) -> None:
    """A descriptor that is closed is another's at once: none of theirs is read or written."""
    served = []

    def serve(pause: float) -> None:
        bus = connect()
        works = partial(bus.receive, math.inf), partial(bus.send, Frame(0x181, bytes(8)))
        users = [Thread(target=use_until_closed, args=(work,)) for work in works]
        for user in users:
            user.start()
        sleep(pause)
        bus.close()
        pairs = [socket.socketpair() for _ in range(4)]  # these get its numbers
        for _, right in pairs:
            right.send(b'untouched')
        for user in users:
            user.join(DEADLINE)
            assert not user.is_alive()
        for left, right in pairs:
            assert left.recv(20, socket.MSG_DONTWAIT) == b'untouched'
            left.close()
            right.close()

    def serve_often() -> None:
        for number in range(60):
            serve(number % 4 * 1e-3)
        served.append(True)

    servers = [Thread(target=serve_often) for _ in range(3)]
    for server in servers:
        server.start()
    for server in servers:
        server.join(10 * DEADLINE)
    assert len(served) == len(servers)
