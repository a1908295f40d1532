# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Several simulated devices in one process, and the thread that runs them.

It may have stood still, and gives no power where others have the node ids.
"""

from __future__ import annotations

from functools import partial
import logging
import math
from pathlib import Path
import threading
import time

from can_addresses import free_virtual
from device_rig import NODE_ID
from drive_samples import drive_dictionary, with_defaults
import pytest

from arm_canopen import BusError, CanopenError
from canopen_core.can import Bus, Frame, open_bus, VirtualBus, VirtualWire
from canopen_core.standard import CobId, nmt_frame, NmtCommand, NmtState, sdo, tpdo_default
from canopen_sim import DeviceHost, DeviceRunner, host, simulated_devices
from canopen_sim.host import newest_process_data, NodeIdCheck

ARRIVAL = 10.0  # [s] a deadline, no measure
IDS = range(2, 9)
READ_DEVICE_TYPE = b'\x40\x00\x10\x00\x00\x00\x00\x00'


def host_of(*node_ids: int) -> tuple[DeviceHost, list[Frame]]:
    """Return running devices in virtual time, and the list of what they send."""
    sent: list[Frame] = []
    host = DeviceHost(sent.append)
    for node_id in node_ids:
        host.add(node_id, drive_dictionary())
    host.advance(1.0)
    return host, sent


def write(host: DeviceHost, node_id: int, index: int, subindex: int, data: bytes) -> None:
    """Write an object of one device."""
    request = sdo.DownloadRequest(index, subindex, data, len(data)).encode()
    host.receive(Frame(0x600 + node_id, request), 1.0)


def test_all_boot_and_get_their_frames() -> None:
    """Each sends its boot-up frame and answers its own requests; all start at one command."""
    host, sent = host_of(*IDS)
    assert sent == [Frame(0x700 + node_id, b'\x00') for node_id in IDS]
    host.receive(Frame(0, b'\x01\x00'), 1.0)
    assert {device.nmt_state for device in host.devices} == {NmtState.OPERATIONAL}
    sent.clear()
    host.receive(Frame(0x604, READ_DEVICE_TYPE), 1.0)
    assert [frame.can_id for frame in sent] == [0x584]
    for node_id in (2, 0, 128, -1):  # given already, or not a node id
        with pytest.raises(ValueError, match='node id'):
            host.add(node_id, drive_dictionary())


def test_devices_receive_each_other() -> None:
    """A heartbeat of one device is watched by another one of the same process."""
    host, sent = host_of(2, 3)
    write(host, 2, 0x1017, 0, b'\x64\x00')
    write(host, 3, 0x1016, 1, b'\xc8\x00\x02\x00')
    now = 1.0
    while now < 3.0:
        now += 0.01
        host.advance(now)
    sent.clear()
    write(host, 2, 0x1017, 0, b'\x00\x00')
    for _ in range(50):
        now += 0.01
        host.advance(now)
    assert Frame(0x083, b'\x30\x81\x11\x02\x00\x00\x00\x00') in sent


def test_no_device_receives_its_own_frames() -> None:
    """A device's own TPDO does not come back to it, but reaches the others at once."""
    host, sent = host_of(2, 3, 4)
    for node_id in (2, 3, 4):
        write(host, node_id, 0x1400, 1, b'\x00\x02\x00\x80')
        write(host, node_id, 0x1400, 1, b'\x82\x01\x00\x00')
    sent.clear()
    host.receive(Frame(0, b'\x01\x00'), 1.0)
    assert Frame(0x182, b'\x50\x02') in sent  # the statusword of device 2
    words = [device.store.integer(0x6040).value for device in host.devices]
    assert words == [0, 0x250, 0x250]


def expect(bus: Bus, wanted: Frame) -> None:
    """Wait for a frame on a bus."""
    deadline = time.monotonic() + ARRIVAL
    while time.monotonic() < deadline:
        for frame in bus.receive(0.2):
            if (frame.can_id, frame.data) == (wanted.can_id, wanted.data):
                return
    pytest.fail(f'{wanted} did not come')


class FlakyBus(VirtualBus):
    """A bus that fails for some calls."""

    failures = 3

    def send(self, frame: Frame) -> None:
        """Refuse everything while failing."""
        if self.failures > 0:
            raise BusError('flaky is down')
        super().send(frame)

    def receive(self, timeout: float) -> list[Frame]:
        """Fail a few times."""
        if self.failures > 0:
            self.failures -= 1
            raise BusError('flaky is down')
        return super().receive(timeout)


def test_bus_that_goes_away_is_waited_for(caplog: pytest.LogCaptureFixture) -> None:
    """A failing bus is reported once; the devices serve it when it is back."""
    wire = VirtualWire()
    bus, other = FlakyBus('here', wire), VirtualBus('there', wire)
    runner = DeviceRunner(bus)
    runner.host.add(5, drive_dictionary())
    with caplog.at_level(logging.ERROR):
        runner.start()
        other.send(Frame(0x605, READ_DEVICE_TYPE))
        expect(other, Frame(0x585, b'\x43\x00\x10\x00\x92\x01\x02\x00'))
        runner.stop()
    assert [record.getMessage() for record in caplog.records] == ['flaky is down']


def test_defect_in_one_device_leaves_the_others_alive(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An exception in a device is logged with its traceback, and the next frame is served."""
    name = free_virtual()
    with open_bus(name) as bus, open_bus(name) as master:
        runner = DeviceRunner(bus)
        broken, _ = (runner.host.add(node_id, drive_dictionary()) for node_id in (5, 6))

        def fail(frame: Frame, now: float) -> None:
            raise ZeroDivisionError

        runner.start()
        expect(master, Frame(0x706, b'\x00'))
        monkeypatch.setattr(broken._sdo, 'receive', fail)
        with caplog.at_level(logging.ERROR):
            master.send(Frame(0x605, READ_DEVICE_TYPE))
            master.send(Frame(0x606, READ_DEVICE_TYPE))
            expect(master, Frame(0x586, b'\x43\x00\x10\x00\x92\x01\x02\x00'))
        runner.stop()
    assert 'ZeroDivisionError' in caplog.text


def test_calls_run_in_the_thread_of_the_devices() -> None:
    """A call gets at the devices and gives its result, or its exception."""
    with open_bus(free_virtual()) as bus:
        runner = DeviceRunner(bus)
        runner.host.add(5, drive_dictionary())
        early = runner.call(threading.get_ident)
        runner.start()
        states = runner.call(lambda: [device.nmt_state for device in runner.host.devices])
        assert states.result(ARRIVAL) == [NmtState.PRE_OPERATIONAL]
        assert early.result(ARRIVAL) == runner.call(threading.get_ident).result(ARRIVAL)
        assert early.result() != threading.get_ident()
        with pytest.raises(KeyError):
            runner.call(lambda: runner.host.device(6)).result(ARRIVAL)
        runner.stop()
        with pytest.raises(BusError, match='the simulation has ended'):
            runner.call(threading.get_ident).result(ARRIVAL)


def test_defect_that_stays_due_does_not_stop_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """A device that fails whenever it is advanced rests; the deadlines of others are kept."""
    defects: list[int] = []
    sent: list[Frame] = []
    host = DeviceHost(sent.append, lambda device, _error: defects.append(device.node_id))
    broken, _ = (host.add(node_id, drive_dictionary()) for node_id in (5, 6))

    def fail(now: float) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(broken, 'advance', fail)
    host.advance(1.0)
    assert sent == [Frame(0x706, b'\x00')]
    assert defects == [5]
    write(host, 6, 0x1017, 0, b'\x32\x00')
    sent.clear()
    while host.deadline < 2.0:
        host.advance(host.deadline)
    assert len(sent) in (19, 20, 21)
    assert 5 < len(defects) < 15


MASTER_ID = 1
WATCHED = 0.3  # [s]
EMERGENCY = CobId.EMCY + NODE_ID


def test_of_process_data_the_newest_is_kept_and_of_services_all() -> None:
    """In the order of arrival."""
    sync, old, new = Frame(0x080), Frame(0x205, b'\1'), Frame(0x205, b'\2')
    start, read, other = Frame(0x000, b'\1\5'), Frame(0x605, bytes(8)), Frame(0x7E5, bytes(8))
    batch = [sync, old, start, read, Frame(0x705, b'\5'), other]
    batch += [Frame(0x080), new, read, other, start]
    assert newest_process_data(batch) == [
        *(start, read, Frame(0x705, b'\5'), other),
        *(Frame(0x080), new, read, other, start),
    ]


def test_a_device_that_stood_still_does_not_live_through_what_it_missed(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """It answers one SYNC and not all of the past, and its log says how many it passed over."""
    monkeypatch.setattr(host, 'STALL', 0.0)
    name = free_virtual()
    with open_bus(name) as bus, open_bus(name) as master:
        devices = DeviceRunner(bus)
        dictionary = with_defaults(drive_dictionary(), {(0x1800, 2): 1})  # on each SYNC
        devices.host.add(NODE_ID, dictionary)
        devices.start()
        gate = threading.Event()
        try:
            devices.call(lambda: None).result(ARRIVAL)
            devices.call(lambda: gate.wait(ARRIVAL))
            master.send(Frame(CobId.NMT, nmt_frame(NmtCommand.START, NODE_ID)))
            for _ in range(20):
                master.send(Frame(CobId.SYNC))
            gate.set()
            devices.call(lambda: None).result(ARRIVAL)
            devices.call(lambda: None).result(ARRIVAL)
        finally:
            gate.set()
            devices.stop()
        answers = [f for f in master.receive(0.0) if f.can_id == tpdo_default(1, NODE_ID)]
    assert len(answers) == 1
    assert any(isinstance(record.args, tuple) and 19 in record.args for record in caplog.records)


@pytest.mark.parametrize(
    ('stalls', 'heartbeat'),
    [([WATCHED + 0.2], math.inf), ([WATCHED + 0.2], 0.05), ([WATCHED + 0.15] * 3, math.inf)],
    ids=['longer', 'with a heartbeat', 'several'],
)
def test_a_device_that_stood_still_reports_no_silence(
    stalls: list[float], heartbeat: float
) -> None:
    """It received nothing meanwhile; a master that is silent while it runs is noticed in time."""
    name = free_virtual()
    with open_bus(name) as bus, open_bus(name) as master:
        devices = DeviceRunner(bus)
        watch = {(0x1016, 1): MASTER_ID << 16 | round(WATCHED * 1000)}
        devices.host.add(NODE_ID, with_defaults(drive_dictionary(), watch))
        devices.start()

        def stand_still(seconds: float) -> None:
            rest = max(0.0, seconds - heartbeat)
            threading.Event().wait(seconds - rest)
            if rest:
                master.send(Frame(CobId.HEARTBEAT + MASTER_ID, b'\5'))
            threading.Event().wait(rest)

        try:
            devices.call(lambda: None).result(ARRIVAL)
            master.send(Frame(CobId.HEARTBEAT + MASTER_ID, b'\5'))
            devices.call(lambda: None).result(ARRIVAL)
            begun = time.monotonic()
            for stall in stalls:
                devices.call(partial(stand_still, stall)).result(ARRIVAL)
                devices.call(lambda: None).result(ARRIVAL)
            while not (lost := [f for f in master.receive(ARRIVAL) if f.can_id == EMERGENCY]):
                assert time.monotonic() - begun < ARRIVAL
            running = lost[0].timestamp - begun - sum(stalls)
            assert WATCHED * 0.9 < running < ARRIVAL / 2.0
        finally:
            devices.stop()


PANDA = Path(__file__).parents[2] / 'arm_bringup' / 'robots' / 'panda' / 'bus.yml'


class StoppedClock:
    """A clock that goes on when it is read, so that nothing waits long."""

    def __init__(self, step: float) -> None:
        self.now, self.step = 100.0, step

    def __call__(self) -> float:
        """Return the time in [s]."""
        self.now += self.step
        return self.now


def test_an_answer_counts_after_other_work_that_took_long() -> None:
    """It has been received meanwhile."""
    name = free_virtual()
    with open_bus(name) as bus, open_bus(name) as other:
        check = NodeIdCheck(bus, [NODE_ID], StoppedClock(10.0))
        other.send(Frame(0x585, bytes(8)))
        with pytest.raises(CanopenError, match='0x585'):
            check.finish()


def test_only_what_the_device_itself_sends_counts() -> None:
    """The requests of a master, its node guarding and other devices do not."""
    for frame, found in (
        (Frame(0x705, b'\0'), True),
        (Frame(0x705, b'\5'), True),
        (Frame(0x585, bytes(8)), True),
        (Frame(0x706, b'\0'), False),
        (Frame(0x605, bytes(8)), False),
        (Frame(0x705, is_remote=True), False),
        (Frame(0x080), False),
    ):
        name = free_virtual()
        with open_bus(name) as bus, open_bus(name) as other:
            other.send(frame)
            check = NodeIdCheck(bus, [NODE_ID], StoppedClock(0.05))
            assert bool(check.found) is found, frame
            requests = [each.can_id for each in other.receive(0.0)]
            # a device that is there is not disturbed
            assert requests == ([] if found else [0x605])
            if not found:
                check.finish()


def test_a_second_simulation_of_a_bus_is_refused() -> None:
    """The first goes on; when it has ended, there is room."""
    name = free_virtual()
    with simulated_devices(PANDA, name) as first:
        with pytest.raises(CanopenError, match='already'), simulated_devices(PANDA, name):
            pass
        assert len(first.call(lambda: first.host.devices).result(ARRIVAL)) == 7
    with simulated_devices(PANDA, name) as again:
        assert again.bus_name == name
