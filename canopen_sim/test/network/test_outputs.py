# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""RPDOs of devices without a driver: nothing leaves unasked, and nothing is undone."""

from __future__ import annotations

from dataclasses import replace
import struct

from bus_rig import VirtualNetwork
from drive_samples import (
    bus_config,
    drive_config,
    drive_dictionary,
    every_mode,
    pdo,
    SCALE,
    sdo_write,
    with_defaults,
)
import pytest

from arm_canopen import BusError, CodecError, NodeConfig, OperationMode
from arm_canopen.config import PdoConfig, RPDO
from canopen_core.can import Frame
from canopen_core.standard import (
    AccessType,
    DataType,
    MappedObject,
    NmtCommand,
    ObjectDictionary,
    ObjectEntry,
)
from canopen_sim import Fault, FaultInjection

MODULE = 'module'
NODE_ID = 5
OUTPUTS = (0x6083, 0)  # stands for the outputs of a module
MASK = (0x6084, 0)
COB_ID, SYNC_COB_ID = 0x205, 0x305
JOINT, SPEEDS = 'joint', 0x502


def module(**changes: object) -> NodeConfig:
    """Return an I/O module with outputs in an event-driven and in a synchronous RPDO."""
    config = drive_config(MODULE, NODE_ID, driver='ros2_canopen::ProxyDriver', sdo_writes=())
    rpdos = (
        pdo(1, COB_ID, OUTPUTS, MASK, transmission=255),
        pdo(2, SYNC_COB_ID, (0x6071, 0), transmission=1),
    )
    return replace(config, rpdos=rpdos, tpdos=(), **changes)  # type: ignore[arg-type]


def booted(config: NodeConfig | None = None, **held: int) -> VirtualNetwork:
    """Boot the module, whose outputs hold something already."""
    config = config or module()
    values = {OUTPUTS: held.get('outputs', 0), MASK: held.get('mask', 0)}
    dictionary = with_defaults(drive_dictionary().for_node(NODE_ID), values)
    net = VirtualNetwork(bus_config(config), dictionaries={MODULE: dictionary})
    net.boot()
    return net


def read(net: VirtualNetwork, place: tuple[int, int]) -> int:
    """Return what an object of the device holds."""
    return int(net.result(net.network.nodes[MODULE].sdo.read(*place, 0.2))[0])


def publish(net: VirtualNetwork, place: tuple[int, int], value: int) -> None:
    """Publish an object as ``~/tpdo`` does."""
    net.network.publish_objects(net.network.nodes[MODULE], {place: value})


def test_what_is_published_leaves_once() -> None:
    """Two values are two frames at once: no edge is lost; before a SYNC the last one counts.

    Before that nothing leaves: a master that starts forces the outputs to no default.
    """
    net = booted(outputs=0x2A)
    net.run(1.0)
    assert net.frames(COB_ID) == net.frames(SYNC_COB_ID) == []
    assert read(net, OUTPUTS) == 0x2A
    for target, values in ((OUTPUTS, (1, 0)), ((0x6071, 0), (5, -7))):
        for value in values:
            publish(net, target, value)
    assert [data[0] for data in net.frames(COB_ID)] == [1, 0]
    net.run(0.5)
    assert [data[0] for data in net.frames(COB_ID)] == [1, 0]
    assert [struct.unpack('<h', data) for data in net.frames(SYNC_COB_ID)] == [(-7,)]


@pytest.mark.parametrize('written', [False, True], ids=['as it was', 'by bus.yml'])
def test_the_other_objects_of_the_frame_stay_as_the_device_has_them(*, written: bool) -> None:
    """The start-up has read what nobody published, after the configuration."""
    writes = (sdo_write(*OUTPUTS, 0x44),) if written else ()
    net = booted(module(sdo_writes=writes), outputs=0x11, mask=0x22)
    publish(net, MASK, 0x33)
    net.run(0.1)
    outputs = 0x44 if written else 0x11
    assert [struct.unpack('<II', data) for data in net.frames(COB_ID)] == [(outputs, 0x33)]


def test_an_sdo_write_is_not_undone() -> None:
    """The next frame carries what was written, for whichever object it is sent."""
    net = booted()
    publish(net, OUTPUTS, 1)
    net.result(net.network.nodes[MODULE].objects.write_object(*OUTPUTS, 0x55))
    net.run(0.3)
    assert read(net, OUTPUTS) == 0x55
    publish(net, MASK, 3)
    net.run(0.3)
    assert read(net, OUTPUTS) == 0x55


def drive_with_speed_mapped() -> VirtualNetwork:
    """Boot a drive that has its profile velocity of 10000 in an RPDO, which leaves each cycle."""
    config = drive_config(JOINT, 2)
    speeds = pdo(4, SPEEDS, (0x6081, 0))
    net = VirtualNetwork(bus_config(replace(config, rpdos=(*config.rpdos, speeds))))
    net.boot()
    return net


def speeds(net: VirtualNetwork, since: float) -> list[int]:
    """Return the profile velocities that the RPDO has carried."""
    return [struct.unpack('<I', data)[0] for data in net.frames(SPEEDS, since=since)]


def test_the_first_targets_of_a_drive_are_where_it_is() -> None:
    """A drive that comes back is booted, and its first RPDOs leave before its first TPDOs."""
    net = VirtualNetwork(bus_config(every_mode(drive_config('a', 2))))
    net.boot()
    net.enable(OperationMode.CYCLIC_POSITION, 'a')
    net.commands['a'].set_target(0.3)
    net.run(3.0)
    begin = net.now
    net.devices['a'].faults.inject(FaultInjection(Fault.DISCONNECT, duration=1.0), begin)
    net.run_until(lambda: not net.drives['a'].node.online, 1.0)
    net.run_until(net.all_ready, 5.0)
    (at,) = {round(0.3 * SCALE), *net.targets('a', since=begin)}
    assert at == round(net.drives['a'].view.position * SCALE)


@pytest.mark.parametrize('index', [0x207A, 0x20B0])
def test_an_object_of_the_vendor_is_no_target_nor_offset(index: int) -> None:
    """Its number shares the last digits with one; the RPDO carries what the device holds."""
    entry = ObjectEntry(
        index, 0, 'Gain', DataType.UNSIGNED32, access=AccessType.READ_WRITE, pdo_mappable=True
    )
    mapped = MappedObject(index, 0, entry.data_type)
    rpdo = PdoConfig(RPDO, 4, True, SPEEDS, 1, mapping=(mapped,), configured=True)
    config = drive_config(JOINT, 2)
    dictionary = ObjectDictionary([*config.dictionary, entry])
    config = replace(config, dictionary=dictionary, rpdos=(*config.rpdos, rpdo))
    held = ObjectDictionary([*drive_dictionary(), replace(entry, default=7)])
    net = VirtualNetwork(bus_config(config), dictionaries={JOINT: held})
    net.boot()
    net.run(0.1)
    assert set(speeds(net, 0.0)) == {7}


def test_a_boot_write_that_fits_no_type_is_refused() -> None:
    """An RPDO must not carry what the EDS has as default, while boot writes something else."""
    short = replace(sdo_write(*OUTPUTS, 0x44), data=b'\x44')
    with pytest.raises(CodecError, match=rf'{MODULE}: the write of 0x6083:00 at boot'):
        booted(module(sdo_writes=(short,)))


def test_the_rpdos_of_a_drive_carry_an_sdo_write_from_when_it_has_left() -> None:
    """The device may have taken it before it answers; one that waits in the queue has not left."""
    net = drive_with_speed_mapped()
    assert speeds(net, since=0.0)[-1] == 10_000
    node = net.network.nodes[JOINT]
    net.devices[JOINT].faults.inject(FaultInjection(Fault.SDO_DELAY, delay=0.1), net.now)
    node.objects.write_object(0x6081, 0, 2_000)
    promise = node.objects.write_object(0x6081, 0, 4_000)
    begin = net.now
    net.run(0.09)
    assert set(speeds(net, since=begin + 1e-6)) == {2_000}
    net.result(promise)
    assert net.now - begin > 0.2
    begin = net.now
    net.run(0.2)
    assert set(speeds(net, since=begin + 1e-6)) == {4_000}
    assert net.result(node.sdo.read(0x6081, 0, 0.2)) == struct.pack('<I', 4_000)


@pytest.mark.parametrize('fault', [Fault.SDO_ABORT, Fault.SDO_SILENCE])
def test_an_sdo_write_that_is_refused_leaves_the_rpdo_as_it_was(fault: Fault) -> None:
    """The device keeps its value, or the one that was published meanwhile."""
    net = drive_with_speed_mapped()
    node = net.network.nodes[JOINT]
    injection = FaultInjection(fault, object=(0x6081, 0))
    net.devices[JOINT].faults.inject(injection, net.now)
    promise = node.objects.write_object(0x6081, 0, 2_000)
    held = 10_000
    if fault is Fault.SDO_SILENCE:
        net.run(0.05)
        held = 3_000
        net.network.publish_objects(node, {(0x6081, 0): held})
    net.run_until(lambda: promise.done)
    assert promise.error is not None
    begin = net.now
    net.run(0.2)
    assert set(speeds(net, since=begin)) == {held}


def test_what_has_left_before_the_bus_refuses_the_rest_is_named(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of several RPDOs: their values stay, those of the others do not leave later."""
    config = module()
    rpdos = (
        pdo(1, COB_ID, OUTPUTS, transmission=255),
        pdo(3, 0x405, MASK, transmission=255),
        config.rpdos[1],
    )
    net = booted(replace(config, rpdos=rpdos))
    put, full = net.wire.put, True

    def refuses(now: float, sender: str, frame: Frame) -> None:
        if full and frame.can_id == 0x405:
            raise BusError('the transmit queue is full')
        put(now, sender, frame)

    monkeypatch.setattr(net.wire, 'put', refuses)
    node, torque = net.network.nodes[MODULE], (0x6071, 0)
    with pytest.raises(BusError, match=r'RPDO 1 was sent, the rest not: .*queue is full'):
        net.network.publish_objects(node, {torque: 3, OUTPUTS: 1, MASK: 2})
    full = False
    net.run(0.5)
    assert (read(net, OUTPUTS), read(net, MASK), read(net, torque)) == (1, 0, 0)
    publish(net, MASK, 4)
    publish(net, torque, 5)
    net.run(0.5)
    assert (read(net, OUTPUTS), read(net, MASK), read(net, torque)) == (1, 4, 5)


def test_a_value_that_the_bus_refuses_is_not_sent_later() -> None:
    """Its publisher gets the error, and the next value of another object leaves without it.

    One that waits for SYNC leaves when the bus takes frames again, as its publisher has the
    answer that it does; until then the one before counts as sent.
    """
    net, torque = booted(), (0x6071, 0)
    image = net.network.nodes[MODULE].image
    publish(net, OUTPUTS, 0x01)
    publish(net, torque, 1)
    net.run(0.1)
    net.wire.refuses = 'the transmit queue is full'
    with pytest.raises(BusError, match='transmit queue'):
        publish(net, OUTPUTS, 0x02)
    publish(net, torque, 7)
    net.run(0.05)
    assert image.sent(*torque) == 1
    net.wire.refuses = ''
    publish(net, MASK, 0x03)
    net.run(0.2)
    assert (read(net, OUTPUTS), read(net, MASK)) == (0x01, 0x03)
    assert [struct.unpack('<h', data) for data in net.frames(SYNC_COB_ID)] == [(1,), (7,)]
    assert image.sent(*torque) == 7


def test_a_device_that_restarts_is_read_again() -> None:
    """What was published to the one before is not sent to the new one."""
    net = booted(outputs=0x11)
    publish(net, OUTPUTS, 0x99)
    net.run(0.1)
    net.network.send_nmt(NmtCommand.RESET_NODE, NODE_ID)
    net.run(0.05)
    net.run_until(net.all_ready)
    begin = net.now
    net.run(0.5)
    assert net.frames(COB_ID, since=begin) == []
    publish(net, MASK, 1)
    assert struct.unpack('<II', net.frames(COB_ID)[-1]) == (0x11, 1)


def test_a_deadline_is_kept_once_something_was_published() -> None:
    """A device that watches its RPDO gets it again and again, but not before."""
    config = module()
    rpdo = replace(config.rpdos[0], event_time=0.1)
    net = booted(replace(config, rpdos=(rpdo,)))
    net.run(0.5)
    assert net.frames(COB_ID) == []
    publish(net, OUTPUTS, 1)
    begin = net.now
    net.run(1.0)
    times = [sent.time for sent in net.wire.log if sent.frame.can_id == COB_ID]
    gaps = [later - time for time, later in zip([begin, *times], times, strict=False)]
    assert len(times) > 10
    assert max(gaps) < 0.1
