# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""I/O modules (CiA 401) and encoders (CiA 406): the master's API, simulated devices, frames."""

from __future__ import annotations

import math
from pathlib import Path
import re
import shutil
import struct

from bus_rig import VirtualNetwork
import pytest

from arm_canopen import (
    BusConfig,
    CanopenDevice,
    CanopenError,
    CodecError,
    load_bus,
    ObjectError,
    SdoAbortError,
    SdoTimeoutError,
)
from arm_canopen.config import check_bus
from canopen_core.standard import NmtCommand
from canopen_sim import Fault, FaultInjection

BUS_YML = Path(__file__).parents[3] / 'arm_canopen' / 'eds' / 'io_bus.yml'
DIGITAL, ANALOG = 0x20A, 0x30A  # COB-IDs of the RPDOs
IO, ENCODER = 'node_id: 10', 'node_id: 11'
OUTPUT, INPUT = 'Digital outputs 1', 'Digital inputs 1'


@pytest.fixture
def net() -> VirtualNetwork:
    """Boot the module and the encoder of the example."""
    made = VirtualNetwork(load_bus(BUS_YML))
    made.boot()
    return made


@pytest.fixture
def io(net: VirtualNetwork) -> CanopenDevice:
    """Return the module."""
    return net.master.device('io')


def test_outputs_go_by_rpdo_and_inputs_come_by_tpdo(
    net: VirtualNetwork, io: CanopenDevice
) -> None:
    """Nothing leaves unasked; what is read by name is in no SDO, where a PDO carries it."""
    net.run(1.0)
    assert net.frames(DIGITAL) == net.frames(ANALOG) == []
    begin = net.now
    io.write(OUTPUT, 0b101)
    io.write('Write analogue output 16-bit/Analogue output 2', -300)
    io.write(0x6200, 0x80, 2)
    net.run(0.1)
    assert net.frames(DIGITAL) == [bytes((5, 0)), bytes((5, 0x80))]
    assert net.frames(ANALOG) == [struct.pack('<hh', 0, -300)]
    assert (io.read(INPUT), io.read(0x6000, 2), io.read('0x6401:02')) == (5, 0x80, -300)
    assert net.frames(0x60A, since=begin) == []
    assert io.sdo.read(INPUT) == 5
    assert len(net.frames(0x60A, since=begin)) == 1


def test_inputs_are_subscribed_by_name(net: VirtualNetwork, io: CanopenDevice) -> None:
    """Each TPDO calls back until that is ended; a callback that fails harms nobody else."""
    received: list[float] = []

    def fails(value: float) -> None:
        raise ValueError(value)

    io.subscribe(INPUT, fails)
    end = io.subscribe(INPUT, received.append)
    for value in (1, 2):
        io.write(OUTPUT, value)
        net.run(0.1)
    end()
    io.write(OUTPUT, 3)
    net.run(0.1)
    assert received == [1, 2]


def test_digital_inputs_that_do_not_change_are_read() -> None:
    """Their TPDO comes on change; analogue ones are not, as 0x6423 may keep them silent."""
    net = VirtualNetwork(load_bus(BUS_YML))
    net.lose(0x18A, 0x28A)
    net.boot()
    net.master.device('io').write(OUTPUT, 5)
    received: dict[str, list[float]] = {INPUT: [], 'Analogue input 1': []}
    for name, values in received.items():
        net.master.device('io').subscribe(name, values.append)
    net.run(1.0)
    assert received == {INPUT: [5], 'Analogue input 1': []}


REFUSED: list[tuple[str, object, type[Exception], str]] = [
    (OUTPUT, 256, CodecError, '0 to 255'),
    (OUTPUT, -1, CodecError, '0 to 255'),
    (OUTPUT, 1.5, CodecError, 'UNSIGNED8'),
    (OUTPUT, 'on', CodecError, 'UNSIGNED8'),
    (OUTPUT, float('nan'), CodecError, 'UNSIGNED8'),
    ('Analogue output 1', 40_000, CodecError, '-32768 to 32767'),
    ('Digital outputs', 1, ObjectError, '0x6200:01 .*0x6200:02 '),
    (INPUT, 1, SdoAbortError, 'read-only'),
]


def test_what_an_output_cannot_hold_is_refused(net: VirtualNetwork, io: CanopenDevice) -> None:
    """No device would answer to the RPDO; an ambiguous name has its candidates named.

    What no TPDO carries cannot be subscribed, and a module that left Operational ignores RPDOs.
    """
    for name, value, error, words in REFUSED:
        with pytest.raises(error, match=words):
            io.write(name, value)  # type: ignore[arg-type]
    with pytest.raises(ObjectError, match=f'no TPDO of io carries 0x6200:01 {OUTPUT}'):
        io.subscribe(OUTPUT, print)
    net.network.send_nmt(NmtCommand.ENTER_PRE_OPERATIONAL, 10)
    net.run(0.5)
    with pytest.raises(CanopenError, match='not operational'):
        io.write(OUTPUT, 1)
    assert net.frames(DIGITAL) == net.frames(ANALOG) == []


def test_each_request_has_its_own_time_out(net: VirtualNetwork, io: CanopenDevice) -> None:
    """One that a slow object needs, or one that a program can afford."""
    net.devices['io'].faults.inject(FaultInjection(Fault.SDO_DELAY, delay=0.5), net.now)
    begin = net.now
    with pytest.raises(SdoTimeoutError):
        io.sdo.read('Device type', timeout=0.05)
    assert net.now - begin < 0.45  # with its repetition
    net.run(2.0)
    assert io.sdo.read('Device type', timeout=1.0) == 0x000F0191
    io.sdo.write('Error value of outputs 1', 3, timeout=1.0)
    assert io.sdo.read(0x6207, 1, timeout=1.0) == 3


def test_a_lost_module_is_refused_and_sets_its_outputs(
    net: VirtualNetwork, io: CanopenDevice
) -> None:
    """0x6206 has the outputs that change, 0x6207 what they get, when the master is lost."""
    io.sdo.write('Error mode of outputs 1', 0x0F)
    io.sdo.write('Error value of outputs 1', 0x02)
    io.write(OUTPUT, 0x3C)
    net.run(0.5)  # until it has received a heartbeat of the master
    net.devices['io'].faults.inject(FaultInjection(Fault.DISCONNECT), net.now)
    net.run(3.0)
    store = net.devices['io'].store
    assert store.find(0x6200, 1).value == 0x32
    with pytest.raises(CanopenError, match='not operational'):
        io.write(OUTPUT, 1)


def test_an_encoder_turns_and_is_preset(net: VirtualNetwork) -> None:
    """Its position comes with each SYNC and wraps; 0x6003 sets it."""
    encoder = net.master.device('encoder')
    assert encoder.read('Speed value channel 1') == 512
    encoder.write('Preset value', 4096 * 4096 - 256)
    before = net.now
    net.run(1.0)
    expected = (4096 * 4096 - 256 + 512 * (net.now - before)) % (4096 * 4096)
    assert encoder.read('Position value') == pytest.approx(expected, abs=12)
    encoder.sdo.write('Simulated speed', -100)
    net.run(0.1)
    assert encoder.read(0x6030, 1) == -100


def edited(folder: Path, old: str, new: str) -> BusConfig:
    """Load the example with a piece of it replaced."""
    text = BUS_YML.read_text()
    assert old in text
    for eds in BUS_YML.parent.glob('cia40*.eds'):
        shutil.copy(eds, folder)
    (folder / 'bus.yml').write_text(text.replace(old, new))
    return load_bus(folder / 'bus.yml')


def test_check_names_what_the_topics_would_lack(tmp_path: Path) -> None:
    """One warning, by the profile; the example as it stands has none."""
    assert check_bus(load_bus(BUS_YML)).warnings == ()
    for old, new, said in (
        (IO, IO + '\n    tpdo: {1: {enabled: false}}', '0x6000:01, 0x6000:02: .*digital_inputs'),
        (IO, IO + '\n    rpdo: {2: {enabled: false}}', '0x6411:01, .* ~/analog_outputs'),
        (IO, IO + '\n    heartbeat_consumer: false', 'its outputs stay as they are'),
        (IO, IO + '\n    sdo: [{index: 0x6423, value: 0}]', 'TPDO 2 .* 0x6423 is FALSE'),
        ('sync_period: 10000', 'sync_period: 0', 'no SYNC, with which ~/joint_states'),
        (
            ' 1}',
            ' 1, mapping: [{index: 0x6030, sub_index: 1}]}',
            r'0x6004:00 \(position\): no ~/jo',
        ),
        (' 1}', ' 1, mapping: [{index: 0x6004}]}', r'0x6030:01 \(speed\): the velocity'),
    ):
        (warning,) = check_bus(edited(tmp_path, old, new)).warnings
        assert re.search(said, warning.message), new
        assert warning.remedy


def test_the_scale_of_an_encoder(tmp_path: Path) -> None:
    """Of bus.yml, else radians by the units per revolution that it has after the boot."""
    for keys, position, velocity in (
        ('', math.tau / 4096, math.tau / 4096),
        ('sdo: [{index: 0x6001, value: 1000}]', math.tau / 1000, math.tau / 1000),
        ('scale_pos_from_dev: 0.5', 0.5, 0.5),
        ('scale_vel_from_dev: 0.25', math.tau / 4096, 0.25),
    ):
        axis = edited(tmp_path, ENCODER, f'{ENCODER}\n    {keys}').node('encoder').drive
        assert axis.scale_pos_from_dev == pytest.approx(position), keys
        assert axis.scale_vel_from_dev == pytest.approx(velocity), keys
