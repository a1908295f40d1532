# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A master by others: python-canopen configures, reads and drives our simulated device.

The first half runs in virtual time, the master's frames going straight into the device; the
state machine of python-canopen waits on the wall clock, so it gets threads and a real bus object.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
import threading
import time
from typing import Any

import can
from can_addresses import free_virtual
import canopen
from canopen.profiles.p402 import BaseNode402
from device_rig import drive_dictionary, EDS, NODE_ID, Rig
import pytest

from canopen_core.can import Frame, open_bus
from canopen_core.can.plugin import ArmCanopenBus
from canopen_sim import DeviceRunner

pytestmark = pytest.mark.slow

# python-canopen has no types
make_node: Any = BaseNode402
make_network: Any = canopen.Network
SYNC_PERIOD = 0.01  # [s]
ARRIVAL = 10.0  # [s] a deadline, no measure
MAPPING: dict[str, dict[int, list[tuple[int, int]]]] = {
    'tpdo': {1: [(0x6041, 0), (0x6061, 0)], 2: [(0x6064, 0), (0x606C, 0)]},
    'rpdo': {1: [(0x6040, 0), (0x6060, 0)], 2: [(0x607A, 0), (0x60FF, 0)]},
}
"""The PDOs of the article's bus.yml."""


class Wire:
    """python-can's side of a bus that ends in a device in virtual time."""

    def __init__(self, rig: Rig) -> None:
        """Send to a device."""
        self.rig = rig
        self.network = make_network()
        self.network.bus = self
        self._delivered = 0

    def send(self, message: can.Message, timeout: float | None = None) -> None:
        """Deliver a frame of python-canopen."""
        del timeout
        frame = Frame(
            message.arbitration_id, bytes(message.data), is_remote=message.is_remote_frame
        )
        self.rig.device.receive(frame, self.rig.now)
        self.deliver()

    def deliver(self) -> None:
        """Deliver the frames of the device to python-canopen."""
        while self._delivered < len(self.rig.sent):
            moment, frame = self.rig.sent[self._delivered]
            self._delivered += 1
            self.network.notify(frame.can_id, bytearray(frame.data), moment)

    def run(self, duration: float) -> None:
        """Advance the time."""
        self.rig.run(duration)
        self.deliver()


@pytest.fixture
def wire() -> Wire:
    """A device that was just switched on, and a network that received nothing of it."""
    rig = Rig()
    rig.sent.clear()
    return Wire(rig)


@pytest.fixture
def node(wire: Wire) -> Any:  # python-canopen has no types
    """python-canopen's view of the device, from the same EDS."""
    node = canopen.RemoteNode(NODE_ID, str(EDS))
    wire.network.add_node(node)
    return node


def configure(node: Any) -> None:
    """Write the article's PDOs the way python-canopen does."""
    node.pdo.read()
    for kind, pdos in MAPPING.items():
        for number, pdo in getattr(node, kind).items():
            pdo.clear()
            for index, subindex in pdos.get(number, []):
                pdo.add_variable(index, subindex)
            pdo.trans_type = 1 if kind == 'tpdo' else 255
            pdo.enabled = number in pdos
            pdo.save()


def test_every_object_reads_as_the_eds_says(wire: Wire, node: Any) -> None:
    """All values that the EDS gives arrive, decoded by python-canopen's own dictionary."""
    for entry in drive_dictionary().for_node(NODE_ID):
        if entry.default is None or (entry.index == 0x1003 and entry.subindex):
            continue
        if entry.index in {0x6041, 0x6502} or not entry.access.readable:
            continue
        variable = node.object_dictionary.get_variable(entry.index, entry.subindex)
        value = variable.decode_raw(node.sdo.upload(entry.index, entry.subindex))
        assert value == entry.default, str(entry)


def test_block_transfers_of_python_canopen(node: Any) -> None:
    """python-canopen reads a string and writes a number by the block protocol, CRC included."""
    with node.sdo.open(0x1008, 0, 'rb', block_transfer=True) as stream:
        assert stream.read() == b'Simulated CiA 402 drive'
    with node.sdo.open(0x6081, 0, 'wb', block_transfer=True, size=4) as stream:
        stream.write(b'\x10\x27\x00\x00')
    assert node.sdo.upload(0x6081, 0) == b'\x10\x27\x00\x00'


def test_pdos_are_configured_and_exchanged(wire: Wire, node: Any) -> None:
    """python-canopen maps PDOs, sends an RPDO, and reads the answer in the TPDO by name."""
    configure(node)
    node.nmt.state = 'OPERATIONAL'
    node.rpdo[1]['Controlword'].raw = 0x06
    node.rpdo[1]['Modes of operation'].raw = 8
    node.rpdo[1].transmit()
    node.rpdo[2]['Target position'].raw = -123456
    node.rpdo[2].transmit()
    wire.network.sync.transmit()
    assert node.tpdo[1]['Statusword'].raw & 0x6F == 0x21
    assert node.tpdo[1]['Modes of operation display'].raw == 8
    assert node.tpdo[2]['Position actual value'].raw == 0
    assert node.sdo[0x607A].raw == -123456


@contextmanager
def syncs(network: Any) -> Iterator[None]:
    """Send SYNC from a thread; python-canopen's own needs a bus of the kernel."""
    stop = threading.Event()

    def run() -> None:
        while not stop.wait(SYNC_PERIOD):
            network.sync.transmit()

    thread = threading.Thread(target=run)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()


@pytest.fixture
def drive() -> Iterator[Any]:
    """python-canopen's CiA 402 node, with the drive in threads on a bus in this process."""
    name = free_virtual()
    with open_bus(name) as bus:
        runner = DeviceRunner(bus)
        runner.host.add(NODE_ID, drive_dictionary())
        runner.start()
        network = make_network()
        network.NOTIFIER_CYCLE = 0.02
        network.bus = ArmCanopenBus(name)
        network.connect()
        node: Any = make_node(NODE_ID, str(EDS))
        network.add_node(node)
        node.sdo.RESPONSE_TIMEOUT = ARRIVAL
        try:
            configure(node)
            node.nmt.state = 'OPERATIONAL'
            with syncs(network):
                node.setup_402_state_machine()
                yield node
        finally:
            network.disconnect()
            runner.stop()


def wait(condition: Any) -> None:
    """Wait for a condition, with a deadline."""
    deadline = time.monotonic() + ARRIVAL
    while not condition():
        assert time.monotonic() < deadline, 'it did not come'
        time.sleep(SYNC_PERIOD / 2)


def test_state_machine_by_others(drive: Any) -> None:
    """BaseNode402 enables, moves, quick-stops and disables the drive, and resets a fault."""
    drive.op_mode = 'PROFILED POSITION'
    drive.state = 'OPERATION ENABLED'
    assert drive.op_mode == 'PROFILED POSITION'

    drive.rpdo[2]['Target position'].raw = 300
    drive.rpdo[2]['Target velocity'].raw = 0
    drive.rpdo[2].transmit()
    drive.controlword = 0x1F
    wait(lambda: drive.statusword & 0x1000)
    drive.controlword = 0x0F
    wait(lambda: drive.statusword & 0x1400 == 0x400)
    assert drive.tpdo[2]['Position actual value'].raw == pytest.approx(300, abs=10)

    drive.op_mode = 'PROFILED VELOCITY'
    drive.rpdo[2]['Target velocity'].raw = 800
    drive.rpdo[2].transmit()
    wait(lambda: drive.tpdo[2]['Velocity actual value'].raw == 800)
    drive.controlword = 0x02
    wait(lambda: drive.state == 'SWITCH ON DISABLED')
    drive.state = 'OPERATION ENABLED'
    drive.state = 'SWITCHED ON'
    drive.state = 'SWITCH ON DISABLED'


def test_fault_reset_by_others(drive: Any) -> None:
    """BaseNode402 sees a fault and brings the drive back to Operation enabled."""
    drive.state = 'OPERATION ENABLED'
    drive.sdo[0x6065].raw = 100
    drive.op_mode = 'CYCLIC SYNCHRONOUS POSITION'
    drive.rpdo[2]['Target position'].raw = 100_000
    drive.rpdo[2].transmit()
    wait(lambda: drive.state == 'FAULT')
    assert drive.sdo[0x603F].raw == 0x8611
    assert [error.code for error in drive.emcy.active] == [0x8611]
    drive.reset_from_fault()
    assert drive.state == 'OPERATION ENABLED'
    assert drive.emcy.active == []
