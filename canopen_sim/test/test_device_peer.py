# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What others make of a device: its EDS, a master of python-canopen, and one for our master.

The EDS is conforming, complete and true. Our master boots, configures and reads a LocalNode of
python-canopen: that answers SDOs, executes NMT commands and sends heartbeats; it has no boot-up
after a reset and sends no PDOs by itself, hence the test goes as far as it does.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
import time
from typing import Any

from can_addresses import free_virtual
import canopen
from canopen.profiles.p402 import BaseNode402
from device_rig import EDS, NODE_ID, Rig
from drive_samples import bus_config, drive_config, drive_dictionary, DRIVE_EDS
import pytest

from arm_canopen import CanopenMaster, DriveError
from canopen_core.can import open_bus
from canopen_core.can.plugin import ArmCanopenBus
from canopen_core.eds import load_eds
from canopen_core.standard import NmtCommand
from canopen_sim import DeviceRunner
from canopen_sim.drive.objects import DriveObjects
from canopen_sim.object_store import Integer, ObjectStore

TWO_AXES = EDS.with_name('cia402_two_axes.eds')
FILES = pytest.mark.parametrize('path', [EDS, TWO_AXES], ids=lambda path: path.stem)


@FILES
def test_others_read_the_same(path: Path) -> None:
    """python-canopen understands every object as our reader does, which has no warning."""
    assert load_eds(path).warnings == ()
    dictionary = load_eds(path).dictionary.for_node(NODE_ID)
    other: Any = canopen.import_od(str(path), node_id=NODE_ID)
    assert len(list(dictionary)) == sum(
        1 if isinstance(entry, canopen.objectdictionary.ODVariable) else len(entry)
        for entry in other.values()
        if entry.index >= 0x1000  # below are the data types for gaps
    )
    for entry in dictionary:
        variable = other.get_variable(entry.index, entry.subindex)
        assert (variable.data_type, variable.access_type, variable.pdo_mappable) == (
            entry.data_type,
            entry.access.value,
            entry.pdo_mappable,
        ), str(entry)
        assert variable.default == entry.default, str(entry)
        assert (variable.min, variable.max) == (entry.low_limit, entry.high_limit), str(entry)


def test_second_axis_mirrors_the_first() -> None:
    """Each object of the drive profile is there again 0x800 further on, the same in all else."""
    dictionary = load_eds(TWO_AXES).dictionary
    one, two = (
        {
            (entry.index - base, entry.subindex): (entry.data_type, entry.access, entry.default)
            for entry in dictionary
            if base <= entry.index < base + 0x800
        }
        for base in (0x6000, 0x6800)
    )
    assert one == two
    assert (0x40, 0) in two


def test_drive_finds_every_object_that_it_works_with() -> None:
    """Nothing of the drive model is hidden behind a made-up object."""
    store = ObjectStore(load_eds(EDS).dictionary)
    known = set(store)
    missing = [
        f'0x{variable.entry.index:04X}'
        for variable in vars(DriveObjects(store)).values()
        if isinstance(variable, Integer) and variable not in known
    ]
    assert missing == []


def test_default_pdos_work_as_they_come() -> None:
    """Without any configuration, CiA 402's default PDOs run a drive."""
    rig = Rig()
    rig.nmt(NmtCommand.START)
    assert rig.take(0x180 + NODE_ID) == [b'\x50\x02']
    rig.send(0x300 + NODE_ID, b'\x06\x00\x03')
    assert rig.take(0x280 + NODE_ID) == [b'\x31\x02\x03']
    rig.send(0x200 + NODE_ID, b'\x07\x00')
    rig.send(0x500 + NODE_ID, b'\x0f\x00\xf4\x01\x00\x00')
    rig.cycles(100)
    assert rig.take(0x480 + NODE_ID)[-1][2:] == b'\xf4\x01\x00\x00'
    rig.sync()
    assert len(rig.take(0x380 + NODE_ID)) == 1


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


@pytest.mark.slow
def test_every_object_reads_as_the_eds_says(node: Any) -> None:
    """All values that the EDS gives arrive, decoded by python-canopen's own dictionary.

    A string is read and a number written by the block protocol, too, CRC included.
    """
    for entry in drive_dictionary().for_node(NODE_ID):
        if entry.default is None or (entry.index == 0x1003 and entry.subindex):
            continue
        if entry.index in {0x6041, 0x6502} or not entry.access.readable:
            continue
        variable = node.object_dictionary.get_variable(entry.index, entry.subindex)
        value = variable.decode_raw(node.sdo.upload(entry.index, entry.subindex))
        assert value == entry.default, str(entry)
    with node.sdo.open(0x1008, 0, 'rb', block_transfer=True) as stream:
        assert stream.read() == b'Simulated CiA 402 drive'
    with node.sdo.open(0x6081, 0, 'wb', block_transfer=True, size=4) as stream:
        stream.write(b'\x10\x27\x00\x00')
    assert node.sdo.upload(0x6081, 0) == b'\x10\x27\x00\x00'


@pytest.fixture
def node() -> Iterator[Any]:
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
        node = make_node(NODE_ID, str(EDS))
        network.add_node(node)
        node.sdo.RESPONSE_TIMEOUT = ARRIVAL
        try:
            yield node
        finally:
            network.disconnect()
            runner.stop()


@pytest.fixture
def drive(node: Any) -> Iterator[Any]:
    """The node with the article's PDOs, in Operational."""
    configure(node)
    node.nmt.state = 'OPERATIONAL'
    node.network.sync.start(SYNC_PERIOD)
    node.setup_402_state_machine()
    yield node
    node.network.sync.stop()


def wait(condition: Any) -> None:
    """Wait for a condition, with a deadline."""
    deadline = time.monotonic() + ARRIVAL
    while not condition():
        assert time.monotonic() < deadline, 'it did not come'
        time.sleep(SYNC_PERIOD / 2)


@pytest.mark.slow
def test_state_machine_by_others(drive: Any) -> None:
    """BaseNode402 enables, moves, quick-stops and disables the drive, and resets a fault."""
    drive.op_mode = 'PROFILED POSITION'
    drive.state = 'OPERATION ENABLED'
    assert drive.op_mode == 'PROFILED POSITION'

    drive.rpdo[2]['Target position'].raw = -300
    drive.rpdo[2]['Target velocity'].raw = 0
    drive.rpdo[2].transmit()
    drive.controlword = 0x1F
    wait(lambda: drive.statusword & 0x1000)
    drive.controlword = 0x0F
    wait(lambda: drive.statusword & 0x1400 == 0x400)
    assert drive.tpdo[2]['Position actual value'].raw == pytest.approx(-300, abs=10)

    drive.op_mode = 'PROFILED VELOCITY'
    drive.rpdo[2]['Target velocity'].raw = 800
    drive.rpdo[2].transmit()
    wait(lambda: drive.tpdo[2]['Velocity actual value'].raw == 800)
    drive.controlword = 0x02
    wait(lambda: drive.state == 'SWITCH ON DISABLED')
    drive.state = 'OPERATION ENABLED'
    drive.state = 'SWITCHED ON'
    drive.state = 'SWITCH ON DISABLED'

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


@pytest.mark.slow
def test_master_boots_a_local_node_of_python_canopen() -> None:
    """Identity, configuration by SDO, heartbeat supervision and start go with a stranger."""
    name = free_virtual()
    network = make_network()
    network.NOTIFIER_CYCLE = 0.02
    network.bus = ArmCanopenBus(name)
    network.connect()
    stranger: Any = canopen.LocalNode(2, str(DRIVE_EDS))
    network.add_node(stranger)
    with open_bus(name) as bus, open_bus(name) as observer:
        master = CanopenMaster(bus_config(drive_config('stranger', 2)), bus)
        try:
            master.boot(2 * ARRIVAL)
            wait(lambda: stranger.nmt.state == 'OPERATIONAL')
            sdo = stranger.sdo
            assert (sdo[0x1017].raw, sdo[0x6081].raw, sdo[0x1A00][0].raw) == (100, 10_000, 2)
            observer.receive(0.0)
            heartbeats, deadline = 0, time.monotonic() + ARRIVAL
            while heartbeats < 10:  # three times as long as one may be missing
                assert time.monotonic() < deadline, f'{heartbeats} heartbeats came'
                heartbeats += sum(each.can_id == 0x702 for each in observer.receive(ARRIVAL))
            assert master.device('stranger').status().online
        finally:
            with pytest.raises(DriveError, match='no statusword yet'):  # it sends no PDOs
                master.close()
            network.disconnect()
