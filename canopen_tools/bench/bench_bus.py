#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a frame costs on our buses, beside python-can's own in the same run.

Sender and receiver are in one process and one thread, so the figures are CPU time per frame and
no race. A round trip is between two processes. All of them are printed, none is judged.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, ExitStack, suppress
from dataclasses import dataclass
from functools import partial
import itertools
import math
import multiprocessing
from multiprocessing.synchronize import Event
import os
from pathlib import Path
import statistics
from time import perf_counter, process_time
import warnings

import can

from arm_canopen import BusError
from arm_canopen.can import can_interfaces, Frame, LogWriter, open_bus
from arm_canopen.can.load import BusLoad
from arm_canopen.can.multicast_format import decode, encode
from canopen_tools.monitor import FrameDescriber

FRAMES = 20_000
BATCH = 100  # frames before they are read; all buffers hold as many
ROUND_TRIPS = 2000
BURSTS = (200, 500, 1000, 2000, 5000, 10_000)
PAYLOAD = bytes(range(8))

_ports = itertools.count(29000 + os.getpid() % 900)


@dataclass
class Peer:
    """A bus of either library with the same calls."""

    title: str  # what it is
    send: Callable[[], None]  # sends one frame of eight bytes
    drain: Callable[[], int]  # reads what is there and returns how many frames
    # returns how many frames it knows to be lost, None when it cannot know
    lost: Callable[[], int | None]


@contextmanager
def ours(name: str) -> Iterator[Peer]:
    """Open two of our buses on one name."""
    frame = Frame(0x185, PAYLOAD)
    with open_bus(name) as sender, open_bus(name) as receiver:

        def drain() -> int:
            return sum(len(frames) for frames in iter(lambda: receiver.receive(0.0), []))

        title = name.partition(':')[0]
        yield Peer(title, lambda: sender.send(frame), drain, lambda: receiver.counters.lost)


@contextmanager
def theirs(interface: str, **options: object) -> Iterator[Peer]:
    """Open two python-can buses of an interface."""
    message = can.Message(arbitration_id=0x185, data=PAYLOAD, is_extended_id=False)
    with (
        can.Bus(interface=interface, ignore_config=True, **options) as sender,  # type: ignore[arg-type]
        can.Bus(interface=interface, ignore_config=True, **options) as receiver,  # type: ignore[arg-type]
    ):

        def drain() -> int:
            count = sum(1 for _ in iter(lambda: receiver.recv(0), None))
            for _ in iter(lambda: sender.recv(0), None):  # its own echoes
                pass
            return count

        yield Peer(f'python-can {interface}', lambda: sender.send(message), drain, lambda: None)


def multicast_options() -> dict[str, object]:
    """Return a group of one's own in python-can's words."""
    return {'channel': '239.74.163.77', 'port': next(_ports)}


def multicast_name() -> str:
    """Return a group of one's own in our words."""
    return f'udp_multicast:239.74.163.78:{next(_ports)}'


def candidates() -> Iterator[Callable[[], AbstractContextManager[Peer]]]:
    """Yield what opens each bus to be compared."""
    yield partial(ours, 'virtual:bench')
    yield partial(theirs, 'virtual', channel='bench')
    yield partial(ours, multicast_name())
    yield partial(theirs, 'udp_multicast', **multicast_options())
    for name, interface in can_interfaces().items():
        if interface.is_up and name.startswith('vcan'):
            yield partial(ours, name)
            yield partial(theirs, 'socketcan', channel=name)


def bench_cost(peer: Peer) -> tuple[float, float]:
    """Return CPU time per frame to send and to receive in [us]."""
    sending = receiving = 0.0
    received = 0
    for _ in range(FRAMES // BATCH):
        start = process_time()
        for _ in range(BATCH):
            peer.send()
        middle = process_time()
        received += peer.drain()
        receiving += process_time() - middle
        sending += middle - start
    return sending / FRAMES * 1e6, receiving / max(received, 1) * 1e6


def bench_bursts(peer: Peer) -> list[str]:
    """Return what of each burst arrives at a late reader, and the losses that it knows of."""
    texts = []
    for burst in BURSTS:
        peer.drain()
        for _ in range(burst):
            peer.send()
        got = peer.drain()
        texts.append(f'{got}' if got == burst else f'{got}!')
    peer.send()  # the kernel reports the count with the next frame
    peer.drain()
    lost = peer.lost()
    texts.append('?' if lost is None else f'{lost}')
    return texts


def echo_ours(name: str, ready: Event) -> None:
    """Send every frame back, in a process of its own."""
    with open_bus(name) as bus:
        ready.set()
        while True:
            for frame in bus.receive(math.inf):
                if frame.can_id == 0:
                    return
                bus.send(Frame(frame.can_id + 1, frame.data))


def echo_theirs(channel: str, port: int, ready: Event) -> None:
    """Send every message back, in a process of its own."""
    with can.Bus(interface='udp_multicast', channel=channel, port=port) as bus:
        ready.set()
        while (message := bus.recv()) is None or message.arbitration_id:
            if message and message.arbitration_id == 1:
                message.arbitration_id = 2
                bus.send(message)


@contextmanager
def another(target: Callable[..., None], *arguments: object) -> Iterator[None]:
    """Run a function in another process until the block ends."""
    context = multiprocessing.get_context('spawn')
    ready = context.Event()
    process = context.Process(target=target, args=(*arguments, ready), daemon=True)
    process.start()
    try:
        if not ready.wait(30.0):
            raise RuntimeError('the other process did not start')
        yield
    finally:
        process.join(5.0)
        process.kill()


def round_trips_ours() -> list[float]:
    """Return times from frame to answer in [us]."""
    name = multicast_name()
    times = []
    with open_bus(name) as bus, another(echo_ours, name):
        for _ in range(ROUND_TRIPS):
            start = perf_counter()
            bus.send(Frame(1, PAYLOAD))
            bus.receive(1.0)
            times.append((perf_counter() - start) * 1e6)
        bus.send(Frame(0))
    return times


def round_trips_theirs() -> list[float]:
    """Return times from message to answer in [us]."""
    options = multicast_options()
    times = []
    with (
        can.Bus(interface='udp_multicast', ignore_config=True, **options) as bus,  # type: ignore[arg-type]
        another(echo_theirs, options['channel'], options['port']),
    ):
        for _ in range(ROUND_TRIPS):
            start = perf_counter()
            bus.send(can.Message(arbitration_id=1, data=PAYLOAD, is_extended_id=False))
            while (message := bus.recv(1.0)) and message.arbitration_id != 2:
                pass  # its own echo
            times.append((perf_counter() - start) * 1e6)
        bus.send(can.Message(arbitration_id=0, is_extended_id=False))
    return times


def cost(function: Callable[[], object], count: int = 100_000) -> float:
    """Return the CPU time of a call in [us]."""
    start = process_time()
    for _ in range(count):
        function()
    return (process_time() - start) / count * 1e6


def bench_pieces() -> None:
    """Print what the parts of the path cost."""
    frame = Frame(0x185, PAYLOAD, 1.0)
    datagram = encode(frame)
    load, describer = BusLoad(1_000_000, 0.0), FrameDescriber()
    log = LogWriter(Path(os.devnull), 'can0', 1.7e9)
    burst = [frame] * 100
    print('\npieces                                 us')
    for title, function in (
        ('encode a datagram', lambda: encode(frame)),
        ('decode a datagram', lambda: decode(datagram, 1.0)),
        ('count a frame for the bus load', lambda: load.count(frame)),
        ('describe a frame without bus.yml', lambda: describer.describe(frame)),
        ('write 100 frames to a log', lambda: log.write(burst)),
    ):
        print(f'  {title:<34} {cost(function):5.2f}')


def main() -> None:
    """Print all figures."""
    warnings.simplefilter('ignore')
    head = '  '.join(f'{burst:>6}' for burst in BURSTS)
    print('CPU time per frame of 8 bytes, and what arrives of a burst (! some lost)')
    print(f'{"bus":<26} {"send us":>8} {"recv us":>8} {"frames/s":>9}   {head}    lost')
    for candidate in candidates():
        with ExitStack() as stack:
            try:
                peer = stack.enter_context(candidate())
            except (BusError, can.CanError) as error:
                print(f'{"":<26} {error}')
                continue
            sending, receiving = bench_cost(peer)
            arrived = '  '.join(f'{text:>6}' for text in bench_bursts(peer))
            rate = 1e6 / (sending + receiving)
            print(f'{peer.title:<26} {sending:8.2f} {receiving:8.2f} {rate:9.0f}   {arrived}')
    print(f'\nround trip between two processes, {ROUND_TRIPS} times   p50 us   p99 us')
    for title, measure in (('ours', round_trips_ours), ('python-can', round_trips_theirs)):
        with suppress(can.CanError):
            times = measure()
            p99 = statistics.quantiles(times, n=100)[98]
            print(f'  udp_multicast, {title:<30} {statistics.median(times):8.0f} {p99:8.0f}')
    bench_pieces()


if __name__ == '__main__':
    main()
