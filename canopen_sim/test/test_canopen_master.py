# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The master in a program without ROS, against simulated drives of another process."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager, nullcontext, suppress
from functools import partial
from itertools import count
import os
from pathlib import Path
import subprocess
import sys
import threading
import time
from typing import Any

from can_addresses import free_multicast
import canopen
from drive_samples import bus_config, drive_config, with_defaults
import pytest

from arm_canopen import (
    AxisFeedback,
    BootError,
    BusError,
    CanopenDrive,
    CanopenMaster,
    CodecError,
    DriveError,
    DriveState,
    Event,
    EventKind,
    load_bus,
    ObjectError,
    open_bus,
    OperationMode,
    Refusal,
    SdoAbortError,
    Severity,
)
from canopen_core.can import Frame
from canopen_core.can.plugin import ArmCanopenBus
from canopen_sim import DeviceRunner

pytestmark = pytest.mark.slow

EDS = Path(__file__).parents[2] / 'arm_canopen' / 'eds' / 'cia402_drive.eds'
TIMEOUT = 30.0  # [s]
BUS_YML = f"""
master:
  node_id: 1
  driver: ros2_canopen::MasterDriver
  sync_period: 10000
  heartbeat_producer: 1000
defaults:
  dcf: {EDS}
  driver: ros2_canopen::Cia402Driver
  heartbeat_producer: 1000
  heartbeat_consumer: true
  scale_pos_to_dev: 10000.0
  scale_pos_from_dev: 0.0001
  sdo: [{{index: 0x6081, value: 20000}}, {{index: 0x60C2, sub_index: 1, value: 10}}]
  tpdo:
    1: {{enabled: true, cob_id: auto, transmission: 1,
        mapping: [{{index: 0x6041}}, {{index: 0x6061}}, {{index: 0x6064}}]}}
  rpdo:
    1: {{enabled: true, cob_id: auto,
        mapping: [{{index: 0x6040}}, {{index: 0x6060}}, {{index: 0x607A}}]}}
nodes:
  joint1: {{node_id: 2}}
  joint2: {{node_id: 3}}
"""
FORGETFUL = """
import sys
from arm_canopen import CanopenMaster
master = CanopenMaster.from_bus_yml(sys.argv[1], sys.argv[2])
master.boot(30.0)
drive = master.drive('joint1')
drive.enable()
drive.select_mode(1)
drive.set_target(3.0)
print(drive.state.name, flush=True)
assert 'rclpy' not in sys.modules
"""


@pytest.fixture
def bus() -> str:
    """Name a multicast bus of one's own."""
    return free_multicast()


@pytest.fixture
def bus_yml(tmp_path: Path) -> Path:
    """Write a bus.yml with two drives."""
    path = tmp_path / 'bus.yml'
    path.write_text(BUS_YML)
    return path


@contextmanager
def program(*argv: str | Path) -> Iterator[subprocess.Popen[str]]:
    """Run Python in another process, without ROS on its path, until it has printed a line."""
    env = {**os.environ, 'PYTHONUNBUFFERED': '1'}
    command = [sys.executable, *map(str, argv)]
    with subprocess.Popen(command, env=env, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline(), 'it ended instead'
            yield process
        finally:
            process.terminate()
            process.wait(TIMEOUT)


@pytest.fixture
def drives(bus_yml: Path, bus: str) -> Iterator[subprocess.Popen[str]]:
    """Simulate the drives in another process."""
    with program('-m', 'canopen_sim.fake_slaves_command', bus_yml, '--can', bus) as process:
        yield process


@pytest.fixture
def master(drives: object, bus_yml: Path, bus: str) -> Iterator[CanopenMaster]:
    """Boot the bus."""
    with CanopenMaster.from_bus_yml(bus_yml, bus) as made:
        made.boot(TIMEOUT)
        yield made


@contextmanager
def independent_client(bus: str, monkeypatch: pytest.MonkeyPatch) -> Iterator[canopen.Network]:
    """Observe the bus with python-canopen."""
    place = (ArmCanopenBus.__module__, 'ArmCanopenBus')
    monkeypatch.setitem(sys.modules['can.interfaces'].BACKENDS, 'arm_canopen', place)
    network = canopen.Network()
    network.connect(interface='arm_canopen', channel=bus, ignore_config=True)
    try:
        yield network
    finally:
        network.disconnect()


def statusword(network: canopen.Network, node_id: int) -> int:
    """Read 0x6041 by SDO."""
    node = network.add_node(node_id, str(EDS))
    node.sdo.RESPONSE_TIMEOUT = TIMEOUT
    return int(node.sdo[0x6041].raw)


def assert_not_enabled(bus: str, monkeypatch: pytest.MonkeyPatch, *node_ids: int) -> None:
    """Assert that an independent master reads of no drive that it is in Operation enabled."""
    with independent_client(bus, monkeypatch) as network:
        for node_id in node_ids:
            assert statusword(network, node_id) & 0x6F != 0x27


def test_a_drive_is_enabled_moved_and_read(
    master: CanopenMaster, bus: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What the master says is what an independent master reads from the drive."""
    drive = master.drive('joint1')
    drive.enable()
    assert drive.state is DriveState.OPERATION_ENABLED
    drive.move_to(0.5)
    assert drive.mode is OperationMode.PROFILE_POSITION
    assert drive.position == pytest.approx(0.5, abs=0.001)
    drive.move_to(-0.2, relative=True)
    assert drive.position == pytest.approx(0.3, abs=0.001)
    assert drive.status().fresh
    with independent_client(bus, monkeypatch) as network:
        node = network.add_node(2, str(EDS))
        node.sdo.RESPONSE_TIMEOUT = TIMEOUT
        assert node.sdo[0x6064].raw == pytest.approx(3000, abs=10)
        assert statusword(network, 3) & 0x6F != 0x27  # joint2 was not requested


def test_objects_are_read_and_written(master: CanopenMaster) -> None:
    """By number and name, typed by the EDS; what is wrong is named, if possible before a frame."""
    sdo = master.sdo('joint1')
    assert master.sdo(2).read(0x1000) == 0x20192
    sdo.write('Profile velocity', 1234)
    assert sdo.read(0x6081) == 1234
    sdo.write(0x607D, 5000, subindex=2)
    assert sdo.read('0x607D:02') == 5000
    modes: Any = ('position', 5, -3)
    select = master.drive('joint1').select_mode
    wrong: list[tuple[type[Exception], str, Callable[[], object]]] = [
        (ObjectError, '5FFF', lambda: sdo.read(0x5FFF)),
        (CodecError, 'fast', lambda: sdo.write('Profile velocity', 'fast')),
        (DriveError, 'commands of the drive', lambda: sdo.write('Controlword', 0)),
        (SdoAbortError, '6041', lambda: sdo.write('Statusword', 0)),
        (KeyError, r'elbow.*joint1, joint2', lambda: master.drive('elbow')),
        (KeyError, r'9.*joint1 \(2\)', lambda: master.sdo(9)),
        *((DriveError, r'mode of .*PROFILE_POSITION \(1\), ', partial(select, m)) for m in modes),
    ]
    for error, words, call in wrong:
        with pytest.raises(error, match=words):
            call()


def test_a_late_motion_is_halted(master: CanopenMaster) -> None:
    """It does not go on after its failure was reported."""
    drive = master.drive('joint1')
    drive.enable()
    with pytest.raises(DriveError, match=r'not arrived within 0\.1 s, and was halted'):
        drive.move_to(100.0, timeout=0.1)
    stands = drive.position
    assert stands < 50.0
    assert drive.velocity == pytest.approx(0.0, abs=0.01)
    drive.halt()
    assert drive.position == pytest.approx(stands, abs=0.001)
    assert drive.state is DriveState.OPERATION_ENABLED


def wait_until_in_motion(drive: CanopenDrive, velocity: float = 0.5) -> None:
    """Wait until a drive that was sent far away is as fast as this."""
    deadline = time.monotonic() + TIMEOUT
    while drive.velocity < velocity:
        assert time.monotonic() < deadline


def send_far_away(drive: CanopenDrive) -> None:
    """Enable a drive, and have it move for long."""
    drive.enable()
    drive.select_mode(OperationMode.PROFILE_POSITION)
    drive.set_target(1000.0)


def test_a_stop_ends_a_motion(master: CanopenMaster) -> None:
    """Another thread may stop what this one waits for."""
    drive = master.drive('joint1')
    drive.enable()
    with ThreadPoolExecutor(1) as pool:
        moving = pool.submit(drive.move_to, 1000.0)
        wait_until_in_motion(drive)
        drive.disable()
        with pytest.raises(DriveError):
            moving.result(TIMEOUT)


@pytest.mark.parametrize('failing', [False, True])
def test_leaving_disables_the_drives(
    drives: object, bus_yml: Path, bus: str, monkeypatch: pytest.MonkeyPatch, *, failing: bool
) -> None:
    """By an error, too, which is raised; no thread is left, and no call waits for ever."""
    before = set(threading.enumerate())
    master = CanopenMaster.from_bus_yml(bus_yml, bus)
    with pytest.raises(ZeroDivisionError) if failing else nullcontext(), master:
        master.boot(TIMEOUT)
        send_far_away(master.drive('joint1'))
        if failing:
            raise ZeroDivisionError
    assert set(threading.enumerate()) <= before
    for call in (master.drive('joint1').enable, master.boot):
        with pytest.raises(BusError, match='has ended'):
            call()
    master.close()  # again is no error
    assert_not_enabled(bus, monkeypatch, 2)


def test_a_program_that_forgets_to_close_leaves_no_drive_enabled(
    drives: object, bus_yml: Path, bus: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its end stops them."""
    with program('-c', FORGETFUL, bus_yml, bus) as process:
        assert process.wait(TIMEOUT) == 0
    assert_not_enabled(bus, monkeypatch, 2)


def test_calls_before_the_boot_are_refused(bus_yml: Path, bus: str) -> None:
    """They would wait for ever, also after the end of a master that was not booted."""
    master = CanopenMaster.from_bus_yml(bus_yml, bus)
    drive, device = master.drive('joint1'), master.device('joint1')
    calls = (drive.enable, drive.status, device.status, partial(drive.sdo.read, 0x6041))

    def refuses(reason: str) -> None:
        for call in calls:
            with pytest.raises(BusError, match=reason):
                call()

    refuses(r'does not run; call boot\(\) first')
    master.close()
    refuses('has ended')


def test_missing_devices_are_named(bus_yml: Path, bus: str) -> None:
    """They are booted when they come, and a second boot waits for that."""
    with CanopenMaster.from_bus_yml(bus_yml, bus) as master:
        with pytest.raises(BootError, match=r'joint1 \(node 2\).*joint2 \(node 3\)'):
            master.boot(0.2)
        with pytest.raises(DriveError, match='offline'):
            master.drive('joint1').enable()
        with program('-m', 'canopen_sim.fake_slaves_command', bus_yml, '--can', bus):
            master.boot(TIMEOUT)
            master.drive('joint1').enable()
            master.close()


def test_a_warning_on_the_way_does_not_end_a_boot(bus_yml: Path, bus: str) -> None:
    """Of a device that watches others in all entries of 0x1016; it boots all the same."""
    first, last = load_bus(bus_yml).nodes
    others = dict.fromkeys(((0x1016, subindex) for subindex in range(1, 5)), 0x0055_0064)
    booting: list[Event] = []
    with open_bus(bus) as can:
        devices = DeviceRunner(can)
        devices.host.add(first.node_id, first.dictionary)
        devices.host.add(last.node_id, with_defaults(last.dictionary, others))
        devices.start()
        try:
            with CanopenMaster.from_bus_yml(bus_yml, bus, on_event=booting.append) as master:
                master.boot(TIMEOUT)
                online = [each.status().online for each in master.devices.values()]
        finally:
            devices.stop()
    assert online == [True, True]
    severities = {event.severity for event in booting if event.kind is EventKind.BOOT}
    assert severities == {Severity.WARNING, Severity.INFO}


class Clinging:
    """A motion source that wants its axis back whenever it loses it."""

    axes = ('joint1',)

    def __init__(self, master: CanopenMaster) -> None:
        self._attach = master.begin_attach
        self.again: Future[None] | None = None

    def update(
        self, now: float, period: float, feedback: Sequence[AxisFeedback]
    ) -> list[float | None]:
        """Lead nothing."""
        return [None]

    def released(self, axis: str, refusal: Refusal) -> None:
        """Attach itself again, from the thread of the cycle."""
        self.again = self._attach(self)


def test_nothing_is_commanded_to_a_drive_while_the_master_ends(
    drives: object, bus_yml: Path, bus: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One that stands is not enabled again while another one brakes."""
    master = CanopenMaster.from_bus_yml(bus_yml, bus)

    def insist() -> None:
        while True:
            with suppress(DriveError):
                master.drive('joint2').enable()

    with ThreadPoolExecutor(1) as pool:
        with master:
            master.boot(TIMEOUT)
            moving, source = master.drive('joint1'), Clinging(master)
            moving.sdo.write('Quick stop deceleration', 20000)  # brakes for a second
            moving.init()
            master.drive('joint2').enable()
            send_far_away(moving)
            wait_until_in_motion(moving, 1.9)
            master.attach(source)
            insisting = pool.submit(insist)
        with pytest.raises(BusError, match='has ended'):
            insisting.result(TIMEOUT)
    assert_not_enabled(bus, monkeypatch, 2, 3)
    assert source.again is not None
    with pytest.raises(BusError, match='the CANopen master is ending'):
        source.again.result(TIMEOUT)


def test_a_cycle_that_ends_by_a_defect_has_sent_a_quick_stop(
    drives: object, bus_yml: Path, bus: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nobody leads the drive any more; it does not fault, as at the loss of the heartbeat."""
    master = CanopenMaster.from_bus_yml(bus_yml, bus)
    master.boot(TIMEOUT)
    drive, thread = master.drive('joint1'), master.thread
    thread.network.nodes['joint1'].watch_slot = 0
    send_far_away(drive)
    wait_until_in_motion(drive)
    ended, confirmed = threading.Event(), threading.Event()
    thread.on_failure = ended.set

    def see(_cob_id: int, response: bytearray, _timestamp: float) -> None:
        if response[:3] == bytes((0x60, 0x40, 0x60)):  # download of the controlword confirmed
            confirmed.set()

    with independent_client(bus, monkeypatch) as network:
        network.subscribe(0x582, see)
        thread.call(lambda: monkeypatch.setattr(thread, '_statistics', None))
        assert ended.wait(TIMEOUT)
        assert 'quick stop sent to joint1; nothing else stops joint1' in str(thread.failure)
        with pytest.raises(DriveError, match='could not be stopped'):
            master.close()
        assert confirmed.wait(TIMEOUT)  # else this client takes it for the answer to its own
        deadline = time.monotonic() + TIMEOUT
        while (word := statusword(network, 2)) & 0x4F == 0x07:  # it brakes
            assert time.monotonic() < deadline
    assert word & 0x4F == 0x40  # Switch on disabled


@pytest.mark.parametrize(
    ('refusals', 'text'),
    [
        (3, 'quick stop sent to joint1; nothing else stops joint1'),
        (1000, 'no quick stop could be sent to joint1 (the queue is full); nothing else stops'),
    ],
)
def test_a_last_quick_stop_that_the_bus_refuses_is_repeated_and_not_called_sent(
    refusals: int, text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The text names the drives whose power has to be cut."""
    tries = count()
    with open_bus('virtual:last_stop') as virtual, open_bus('virtual:last_stop') as device:
        master = CanopenMaster(bus_config(drive_config('joint1', 2)), virtual)
        master.network.nodes['joint1'].online = True
        send = virtual.send

        def full(frame: Frame) -> None:
            if next(tries) < refusals:
                raise BusError('the queue is full')
            send(frame)

        monkeypatch.setattr(virtual, 'send', full)
        assert text in master.thread.on_defect()
        assert bool(device.receive(0.0)) is ('quick stop sent' in text)


def test_drives_that_vanish_are_reported_and_keep_nobody_waiting(
    drives: subprocess.Popen[str], bus_yml: Path, bus: str
) -> None:
    """The motion that waits for one ends, and so does the master; rest is not known."""
    with CanopenMaster.from_bus_yml(bus_yml, bus) as master:
        master.boot(TIMEOUT)
        drive = master.drive('joint1')
        drive.enable()
        with ThreadPoolExecutor(1) as pool:
            moving = pool.submit(drive.move_to, 1000.0)
            wait_until_in_motion(drive)
            drives.kill()
            with pytest.raises(DriveError, match='joint1'):
                moving.result(TIMEOUT)
        deadline = time.monotonic() + TIMEOUT
        while drive.status().node.online:
            assert time.monotonic() < deadline
        with pytest.raises(DriveError, match='offline'):
            drive.enable()
        with pytest.raises(BootError, match='joint1'):
            master.boot(0.1)
        with pytest.raises(DriveError, match='not disabled; cut its power: offline'):
            master.close()


def test_events_are_handed_over_and_one_that_fails_harms_nobody(
    drives: object, bus_yml: Path, bus: str
) -> None:
    """The boot of each drive comes as an event, in the thread of the cycle."""
    received = []

    def on_event(event: Event) -> None:
        received.append((event.kind, event.node, threading.current_thread().name))
        raise ZeroDivisionError

    with CanopenMaster.from_bus_yml(bus_yml, bus, on_event=on_event) as master:
        master.boot(TIMEOUT)
        master.drive('joint1').enable()
    booted = {entry for entry in received if entry[0] is EventKind.BOOT}
    assert booted == {(EventKind.BOOT, name, 'canopen') for name in ('joint1', 'joint2')}
