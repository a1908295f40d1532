# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Bus names, what every bus promises, and the end of a thread that owns one."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from functools import partial
import itertools
import logging
import math
import os
import socket
import subprocess
import sys
import threading
from threading import Thread, Timer
from time import monotonic, sleep
from typing import TypeAlias

from can_addresses import DEADLINE, free_multicast, free_virtual, receive_count, unstamped
import pytest

from canopen_core import BusError
from canopen_core.can import (
    Bus,
    BusThread,
    can_interfaces,
    CanInterface,
    Frame,
    open_bus,
    opening,
    resolve_name,
    VirtualBus,
    VirtualWire,
)
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
WRONG = [Frame(0x800), Frame(-1), Frame(0x2000_0000, is_extended=True), Frame(1, bytes(9))]


def test_frames_arrive_unchanged_and_in_order(connect: Open) -> None:
    """Identifiers, lengths, both formats and remote requests all survive; each side counts.

    A wrong identifier or payload is the caller's mistake, and nothing is sent. The stamps are
    steady time between sending and reading, and never go back.
    """
    sender, receiver = connect(), connect()
    for wrong in WRONG:
        with pytest.raises(ValueError, match=r'out of range|at most 8'):
            sender.send(wrong)
    before = monotonic()
    for frame in FRAMES:
        sender.send(frame)
    received = receive_count(receiver, len(FRAMES))
    after = monotonic()
    assert unstamped(received) == FRAMES
    assert (sender.counters.sent, sender.counters.received) == (len(FRAMES), 0)
    assert (receiver.counters.sent, receiver.counters.received) == (0, len(FRAMES))
    assert (receiver.counters.lost, receiver.counters.malformed) == (0, 0)
    stamps = [frame.timestamp for frame in received]
    skew = 1e-3  # [s] between the clock of the stamps and the steady one
    assert [before - skew, *stamps, after + skew] == sorted([before - skew, *stamps, after + skew])


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


def test_a_wait_ends_with_its_time_out_a_frame_or_a_wake(connect: Open) -> None:
    """No time-out and negative ones only look; a wake before the wait counts, and once."""
    bus, other = connect(), connect()
    start = monotonic()
    assert bus.receive(0.0) == []
    assert bus.receive(-1.0) == []
    assert bus.receive(0.05) == []
    assert monotonic() - start >= 0.05
    other.send(Frame(1))
    assert unstamped(bus.receive(math.inf)) == [Frame(1)]
    bus.wake()
    bus.wake()
    assert bus.receive(math.inf) == []
    start = monotonic()
    assert bus.receive(0.02) == []
    assert monotonic() - start >= 0.02
    alarm = Timer(0.05, bus.wake)
    alarm.start()
    assert bus.receive(math.inf) == []
    alarm.join(DEADLINE)


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
        for number in range(24):
            serve(number % 4 * 1e-3)
        served.append(True)

    servers = [Thread(target=serve_often) for _ in range(3)]
    for server in servers:
        server.start()
    for server in servers:
        server.join(10 * DEADLINE)
    assert len(served) == len(servers)


MULTICAST = f'udp_multicast:239.74.7.2:{43113 + os.getuid() % 10_000}'


@pytest.mark.parametrize(
    ('interface', 'expected'),
    [
        (None, MULTICAST),
        (CanInterface('vcan0', is_up=True, queue_length=1000), 'vcan0'),
        (CanInterface('vcan0', is_up=False, queue_length=1000), MULTICAST),
        (CanInterface('can0', is_up=True, queue_length=10), MULTICAST),
    ],
    ids=['none', 'vcan0', 'vcan0 down', 'real can0'],
)
def test_auto_takes_vcan0_when_it_is_up_and_never_real_hardware(
    monkeypatch: pytest.MonkeyPatch, interface: CanInterface | None, expected: str
) -> None:
    """Without a name nothing real is ever driven; other names mean themselves."""
    there = {interface.name: interface} if interface else {}
    monkeypatch.setattr(opening, 'can_interfaces', lambda: there)
    monkeypatch.setenv('ROS_DOMAIN_ID', '7')
    assert resolve_name('auto') == expected
    assert resolve_name('can0') == 'can0'


def test_users_and_domains_have_buses_of_their_own(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """And further ones for further robots: no two of them are the same; the choice is logged."""
    monkeypatch.setattr(opening, 'can_interfaces', dict)
    names: list[str] = []
    for user in (0, 1000, 1001):
        monkeypatch.setattr(os, 'getuid', lambda user=user: user)
        for domain in ('', '1', '232'):
            monkeypatch.setenv('ROS_DOMAIN_ID', domain)
            assert resolve_name('auto') == resolve_name('auto')
            names += itertools.islice(opening.auto_names(), 3)
    assert len(set(names)) == len(names)
    for name in names:
        with open_bus(name) as bus:
            assert bus.name == name
    with caplog.at_level(logging.INFO), open_bus('auto') as bus:
        assert f'auto is {bus.name}' in caplog.text


def test_names_of_nothing_are_refused() -> None:
    """An empty kind or channel names no bus, and the message says what would."""
    for name in ('', ':', ':x', 'virtual:', 'pcan:'):
        with pytest.raises(BusError, match='take can0, vcan0, udp_multicast or auto'):
            open_bus(name)


def test_virtual_buses_of_one_name_meet(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two channels in one process are two wires, and one of the same name is one.

    A queue that nobody reads has an end, so that a forgotten bus does not fill the memory.
    """
    monkeypatch.setattr('canopen_core.can.bus.QUEUE_FRAMES', 10)
    name = free_virtual()
    with open_bus(name) as sender, open_bus(name) as idle, open_bus(free_virtual()) as apart:
        for number in range(15):
            sender.send(Frame(number))
        assert idle.counters.lost == 5
        assert [frame.can_id for frame in idle.receive(0.0)] == list(range(10))
        assert apart.receive(0.0) == []


def test_opening_a_bus_of_ours_does_not_import_python_can() -> None:
    """python-can takes longer to import than a slave to start; only its adapters pay."""
    program = (
        'import sys; from canopen_core.can import open_bus; open_bus("virtual:x").close(); '
        'open_bus("udp_multicast:239.127.1.2:20199").close(); sys.exit("can" in sys.modules)'
    )
    subprocess.run(
        [sys.executable, '-c', program],
        check=True,
        timeout=60,
        env={'PYTHONPATH': ':'.join(sys.path)},
    )


TIMEOUT = 10.0  # [s] deadline for what takes milliseconds
CALLERS, CALLS = 3, 2000


@pytest.mark.slow
@pytest.mark.parametrize('attempt', range(3))  # what may go wrong does not do so each time
def test_all_that_is_handed_over_around_the_end_is_answered(
    attempt: int, request: pytest.FixtureRequest
) -> None:
    """Several threads refuse the work that is left, each of them what the others have not."""
    request.addfinalizer(partial(sys.setswitchinterval, sys.getswitchinterval()))
    sys.setswitchinterval(1e-6)
    begun, ending = threading.Event(), threading.Event()

    def serve() -> None:
        begun.wait(TIMEOUT)
        thread.do_work()
        ending.wait(TIMEOUT)

    def hand_over() -> list[Future[None]]:
        return [thread.call(lambda: None) for _ in range(CALLS)]

    thread = BusThread(VirtualBus('here', VirtualWire()), 'owner', serve, 'the owner')
    running: Future[None] = thread.run_later(lambda future: begun.set())
    thread.start()
    begun.set()
    with ThreadPoolExecutor(CALLERS) as pool:
        waiting = [future for _ in range(CALLERS) for future in hand_over()]
        callers = [pool.submit(hand_over) for _ in range(CALLERS)]
        ending.set()
        late = [future for caller in callers for future in caller.result()]
    thread.stop()
    for future in (running, *waiting, *late):
        assert future.exception(TIMEOUT) is None or isinstance(future.exception(), BusError)
    with pytest.raises(BusError, match='the owner has ended'):
        running.result(TIMEOUT)


def test_the_thread_does_not_wait_for_itself() -> None:
    """It would stand still for good, with all that it keeps going."""

    def serve() -> None:
        while not thread.stopping:
            thread.do_work()

    thread = BusThread(VirtualBus('here', VirtualWire()), 'owner', serve, 'the owner')
    thread.start()
    try:
        waits = thread.call(lambda: thread.call(lambda: None).result(TIMEOUT))
        with pytest.raises(BusError, match='cannot wait for itself'):
            waits.result(TIMEOUT)
    finally:
        thread.stop()


class DefectiveBus(VirtualBus):
    """A bus whose receiving fails twice."""

    failures = 2

    def receive(self, timeout: float) -> list[Frame]:
        """Fail, then read."""
        if self.failures:
            self.failures -= 1
            raise ZeroDivisionError
        return super().receive(timeout)


def test_a_defect_in_reading_the_bus_does_not_end_the_thread(
    caplog: pytest.LogCaptureFixture,
) -> None:
    """What its owner does each cycle goes on; it is reported once."""
    wire = VirtualWire()
    bus, other = DefectiveBus('here', wire), VirtualBus('there', wire)
    seen: list[Frame] = []

    def serve() -> None:
        while not seen:
            seen.extend(thread.receive(TIMEOUT))

    thread = BusThread(bus, 'owner', serve, 'the owner')
    other.send(Frame(0x181, b''))
    thread.start()
    thread._thread.join(TIMEOUT)
    assert [frame.can_id for frame in seen] == [0x181]
    assert [record.message for record in caplog.records] == ['a defect in reading here']
