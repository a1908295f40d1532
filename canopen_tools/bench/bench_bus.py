#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""CPU time per frame of our buses, compared with python-can's in the same run.

Sender and receiver share one process and thread, so that the figures are CPU time per frame. The
benchmark prints all figures without pass or fail.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
import math
import os
from pathlib import Path
from time import process_time
from typing import Any
import warnings

import can

from canopen_core import BusError
from canopen_core.can import can_interfaces, Frame, LogWriter, open_bus
from canopen_core.can.frame import BusLoad
from canopen_core.can.multicast import decode, encode
from canopen_tools.monitor import FrameDescriber

FRAMES = 20_000
BATCH = 100  # frames sent before they are read; all buffers are large enough
PAYLOAD = bytes(range(8))
PORT = 29000 + os.getpid() % 900


@dataclass
class Peer:
    """An open bus of either library behind one interface."""

    send: Callable[[int], None]  # sends a frame of eight bytes with this identifier
    receive: Callable[[float], list[int]]  # waits up to a timeout in [s]; returns identifiers


@dataclass(frozen=True)
class Candidate:
    """A bus to measure: one of ours by name, or an interface of python-can."""

    name: str
    options: Mapping[str, Any] = field(default_factory=dict)  # of python-can; empty: ours

    @property
    def title(self) -> str:
        """Title of the bus in the output."""
        return f'python-can {self.name}' if self.options else self.name.partition(':')[0]

    @contextmanager
    def opened(self) -> Iterator[Peer]:
        """Open the bus again."""
        if not self.options:
            with open_bus(self.name) as ours:
                yield Peer(
                    lambda can_id: ours.send(Frame(can_id, PAYLOAD)),
                    lambda timeout: [frame.can_id for frame in ours.receive(timeout)],
                )
            return
        with can.Bus(interface=self.name, ignore_config=True, **self.options) as theirs:

            def receive(timeout: float) -> list[int]:
                first = theirs.recv(None if math.isinf(timeout) else timeout)
                rest = iter(lambda: theirs.recv(0) if first else None, None)
                return [each.arbitration_id for each in (first, *rest) if each]

            def send(can_id: int) -> None:
                message = can.Message(arbitration_id=can_id, data=PAYLOAD, is_extended_id=False)
                theirs.send(message)

            yield Peer(send, receive)


def candidates() -> Iterator[Candidate]:
    """Yield the buses to compare."""
    yield Candidate('virtual:bench')
    yield Candidate('virtual', {'channel': 'bench'})
    yield Candidate(f'udp_multicast:239.163.78.1:{PORT}')  # each in its own multicast group
    yield Candidate('udp_multicast', {'channel': '239.163.77.1', 'port': PORT + 1})
    for name, interface in can_interfaces().items():
        if interface.is_up and name.startswith('vcan'):
            yield Candidate(name)
            yield Candidate('socketcan', {'channel': name})


def drain(receiver: Peer, sender: Peer) -> int:
    """Read all waiting frames, also echoes at the sender; return the receiver's."""
    while sender.receive(0.0):
        pass
    count = 0
    while received := receiver.receive(0.0):
        count += len(received)
    return count


def bench_cost(sender: Peer, receiver: Peer) -> tuple[float, float]:
    """Return CPU time per frame to send and to receive in [us]."""
    sending = receiving = 0.0
    received = 0
    for _ in range(FRAMES // BATCH):
        start = process_time()
        for _ in range(BATCH):
            sender.send(0x185)
        middle = process_time()
        received += drain(receiver, sender)
        receiving += process_time() - middle
        sending += middle - start
    return sending / FRAMES * 1e6, receiving / max(received, 1) * 1e6


def bench_pieces() -> None:
    """Print the cost of the single steps."""
    frame = Frame(0x185, PAYLOAD, 1.0)
    datagram = encode(frame)
    load, describer = BusLoad(1_000_000, 0.0), FrameDescriber()
    log = LogWriter(Path(os.devnull), 'can0', 1.7e9)
    burst = [frame] * 100
    print('\npieces                                 us')
    for title, function, count in (
        ('encode a datagram', lambda: encode(frame), 100_000),
        ('decode a datagram', lambda: decode(datagram, 1.0), 100_000),
        ('count a frame for the bus load', lambda: load.count(frame), 100_000),
        ('describe a frame without bus.yml', lambda: describer.describe(frame), 100_000),
        ('write 100 frames to a log', lambda: log.write(burst), 10_000),
    ):
        start = process_time()
        for _ in range(count):
            function()
        print(f'  {title:<34} {(process_time() - start) / count * 1e6:5.2f}')


def main() -> None:
    """Print all figures."""
    warnings.simplefilter('ignore')
    print('CPU time per frame of 8 bytes')
    print(f'{"bus":<26} {"send us":>8} {"recv us":>8} {"frames/s":>9}')
    for candidate in candidates():
        try:
            with candidate.opened() as sender, candidate.opened() as receiver:
                sending, receiving = bench_cost(sender, receiver)
        except (BusError, can.CanError) as error:
            print(f'{"":<26} {error}')
            continue
        rate = 1e6 / (sending + receiving)
        print(f'{candidate.title:<26} {sending:8.2f} {receiving:8.2f} {rate:9.0f}')
    bench_pieces()


if __name__ == '__main__':
    main()
