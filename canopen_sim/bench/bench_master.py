#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the master's work costs, beside python-canopen doing the same in the same run.

PDOs cost processor time only and need no bus. SDOs are read from seven simulated drives in a
process of their own, by both masters over the same multicast bus.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import math
import multiprocessing
from multiprocessing.synchronize import Event
import os
from pathlib import Path
import struct
import time
from time import process_time
from typing import Any

import can
import canopen

from arm_canopen.can import Bus, Frame, open_bus
from arm_canopen.can.plugin import ArmCanopenBus
from arm_canopen.config import load_eds, PdoConfig
from arm_canopen.master.process_image import ProcessImage, SyncRound
from arm_canopen.master.scheduler import Promise, Scheduler
from arm_canopen.master.sdo_client import SdoClient
from arm_canopen.standard import is_controlword, MappedObject
from canopen_sim import DeviceHost, DeviceRunner

EDS = Path(__file__).parents[2] / 'arm_canopen' / 'eds' / 'cia402_drive.eds'
NODE_ID = 2
NODE_IDS = range(2, 9)
PDOS = 20_000
READS = 1000
TIMEOUT = 1.0  # [s] of one SDO answer
TPDO, RPDO = 0x282, 0x302
FEEDBACK = ((0x6064, 'Position actual value'), (0x606C, 'Velocity actual value'))
COMMAND = ((0x607A, 'Target position'), (0x60FF, 'Target velocity'))

Row = tuple[str, float, float]


def image() -> ProcessImage:
    """Return the process image of a drive with the article's second TPDO and RPDO."""
    dictionary = load_eds(EDS).dictionary

    def pdo(cob_id: int, objects: tuple[tuple[int, str], ...]) -> PdoConfig:
        entries = [dictionary.get(index, 0) for index, _ in objects]
        mapping = tuple(MappedObject(e.index, 0, e.data_type) for e in entries if e is not None)
        return PdoConfig(2, True, cob_id, 1, mapping=mapping)

    return ProcessImage(
        (pdo(TPDO, FEEDBACK),),
        (pdo(RPDO, COMMAND),),
        SyncRound(lambda: None),
        send_last=is_controlword,
    )


def remote_node() -> Any:  # noqa: ANN401  # python-canopen has no types
    """Return python-canopen's view of the same drive, its frames going nowhere."""
    network: Any = canopen.Network()
    network.send_message = lambda *_args, **_kwargs: None
    node: Any = canopen.RemoteNode(NODE_ID, canopen.import_od(str(EDS), NODE_ID))
    node.associate_network(network)
    for pdos, cob_id, objects in ((node.tpdo, TPDO, FEEDBACK), (node.rpdo, RPDO, COMMAND)):
        pdos[2].clear()
        pdos[2].cob_id = cob_id
        for index, _ in objects:
            pdos[2].add_variable(index)
    return node


def microseconds(work: Callable[[int], object]) -> float:
    """Return the processor time of one call in [us]."""
    begin = process_time()
    for number in range(PDOS):
        work(number)
    return (process_time() - begin) / PDOS * 1e6


def decode_cost() -> Row:
    """Take a TPDO and read its two values."""
    entries, node = image(), remote_node()
    source = entries.tpdos[0]
    readers = [reader for index, _ in FEEDBACK if (reader := entries.reader(index)) is not None]
    frames = [Frame(TPDO, struct.pack('<ii', value, 3 * value)) for value in range(256)]
    payloads = [bytearray(frame.data) for frame in frames]
    received = node.tpdo[2]
    position, velocity = readers
    names = [name for _, name in FEEDBACK]

    def ours(number: int) -> object:
        source.receive(frames[number & 255])
        return position.value, velocity.value

    def theirs(number: int) -> object:
        received.on_message(TPDO, payloads[number & 255], float(number))
        return node.tpdo[names[0]].raw, node.tpdo[names[1]].raw

    if ours(7) != theirs(7) or ours(7) != (7, 21):
        raise RuntimeError('the two decoders disagree')
    return 'TPDO to two values [us]', microseconds(ours), microseconds(theirs)


def encode_cost() -> Row:
    """Write two values and make the frame of their RPDO."""
    entries, node = image(), remote_node()
    output = entries.rpdos[0]
    writers = [writer for index, _ in COMMAND if (writer := entries.writer(index)) is not None]

    def ours(number: int) -> bytes:
        for writer in writers:
            writer.write(number)
        return output.frame().data

    def theirs(number: int) -> bytes:
        for _, name in COMMAND:
            node.rpdo[name].raw = number
        node.rpdo[2].transmit()
        return bytes(node.rpdo[2].data)

    if ours(70_000) != theirs(70_000):
        raise RuntimeError('the two encoders disagree')
    return 'two values to RPDO [us]', microseconds(ours), microseconds(theirs)


def simulate(name: str, ready: Event, over: Event) -> None:
    """Run seven simulated drives, in a process of their own."""
    dictionary = load_eds(EDS).dictionary
    with open_bus(name) as bus:
        runner = DeviceRunner(bus)
        add_all(runner.host, dictionary)
        runner.start()
        ready.set()
        over.wait()
        runner.stop()


def add_all(host: DeviceHost, dictionary: Any) -> None:  # noqa: ANN401
    """Add a drive for each node id."""
    for node_id in NODE_IDS:
        host.add(node_id, dictionary)


@contextmanager
def simulated_drives(name: str) -> Iterator[None]:
    """Have the drives on a bus until the block ends."""
    context = multiprocessing.get_context('spawn')
    ready, over = context.Event(), context.Event()
    process = context.Process(target=simulate, args=(name, ready, over), daemon=True)
    process.start()
    try:
        if not ready.wait(30.0):
            raise RuntimeError('the simulated drives did not start')
        yield
    finally:
        over.set()
        process.join(5.0)
        process.kill()


class OurMaster:
    """Our SDO clients on a bus, without the rest of the master."""

    def __init__(self, bus: Bus) -> None:
        """Make a client for each drive."""
        self._bus = bus
        self._scheduler = Scheduler()
        self._scheduler.advance(time.monotonic())
        self._clients = {
            node_id: SdoClient(node_id, f'drive{node_id}', self._scheduler, bus.send)
            for node_id in NODE_IDS
        }

    def read(self, node_ids: list[int], *, at_once: bool) -> None:
        """Read the position of each drive in a list; ``at_once`` sends all requests together."""

        async def in_turn() -> None:
            for node_id in node_ids:
                await self._clients[node_id].read(0x6064, 0, TIMEOUT)

        async def together() -> None:
            promises = [self._clients[node_id].read(0x6064, 0, TIMEOUT) for node_id in node_ids]
            await self._scheduler.gather(promises)

        self._run(self._scheduler.spawn(together() if at_once else in_turn()))

    def _run(self, task: Promise[None]) -> None:
        while not task.done:
            frames = self._bus.receive(TIMEOUT)
            self._scheduler.advance(time.monotonic())
            for frame in frames:
                client = self._clients.get(frame.can_id - 0x580)
                if client is not None:
                    client.receive(frame)
            self._scheduler.advance(time.monotonic())
        task.result()


def reads_per_second(read: Callable[[list[int]], None], node_ids: list[int]) -> float:
    """Return the rate of SDO uploads in [1/s]."""
    read(node_ids[:7])
    begin = time.perf_counter()
    read(node_ids)
    return len(node_ids) / (time.perf_counter() - begin)


def sdo_rates() -> Iterator[Row]:
    """Read a position of four bytes again and again."""
    name = f'udp_multicast:239.74.163.79:{29000 + os.getpid() % 900}'
    one = [NODE_ID] * READS
    each = [node_id for _ in range(READS // 7) for node_id in NODE_IDS]
    with simulated_drives(name):
        with open_bus(name) as bus:
            master = OurMaster(bus)
            ours = [
                reads_per_second(lambda ids: master.read(ids, at_once=False), one),
                reads_per_second(lambda ids: master.read(ids, at_once=False), each),
                reads_per_second(lambda ids: master.read(ids, at_once=True), each),
            ]
        theirs = python_canopen_rates(name, [one, each])
    yield 'SDO reads/s, one drive', ours[0], theirs[0]
    yield 'SDO reads/s, seven drives in turn', ours[1], theirs[1]
    yield 'SDO reads/s, seven drives at once', ours[2], float('nan')


def python_canopen_rates(name: str, jobs: list[list[int]]) -> list[float]:
    """Let python-canopen do the same; it has no way to query several devices at once."""
    network: Any = canopen.Network(ArmCanopenBus(name))
    network.notifier = can.Notifier(network.bus, network.listeners, 0.1)
    try:
        nodes = {
            node_id: network.add_node(node_id, canopen.import_od(str(EDS), node_id))
            for node_id in NODE_IDS
        }

        def read(node_ids: list[int]) -> None:
            for node_id in node_ids:
                nodes[node_id].sdo.upload(0x6064, 0)

        return [reads_per_second(read, job) for job in jobs]
    finally:
        network.notifier.stop()
        network.bus.shutdown()


def main() -> None:
    """Print the table."""
    print(f'{"":36} {"here":>10} {"python-canopen":>16} {"ratio":>8}')
    for title, ours, theirs in (decode_cost(), encode_cost(), *sdo_rates()):
        cost = title.endswith('[us]')
        ratio = theirs / ours if cost else ours / theirs
        digits = 2 if cost else 0
        known = f'{theirs:16.{digits}f} {ratio:7.1f}x' if not math.isnan(theirs) else f'{"-":>16}'
        print(f'{title:36} {ours:10.{digits}f} {known}')


if __name__ == '__main__':
    main()
