# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``canopen scan``, ``read``, ``write`` and ``diff`` on a bus, also beside a running master."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
import shutil
import threading
import time
from typing import Any, NamedTuple

import can
from can_addresses import free_virtual
from config_samples import ARTICLE_BUS
from device_rig import EDS
import pytest
from tool_environment import Output

from arm_canopen import CanopenMaster, Event, EventKind, Severity
from canopen_core.can import Bus, open_bus
from canopen_core.can.plugin import ArmCanopenBus
from canopen_core.eds import load_eds
from canopen_sim import DeviceRunner, Fault, FaultInjection, simulated_devices
from canopen_tools.cli.main import main

pytestmark = pytest.mark.slow

BUS = """\
master:
  node_id: 1
  driver: ros2_canopen::MasterDriver
  package: canopen_master_driver
  sync_period: 10000
defaults:
  dcf: cia402_drive.eds
  driver: ros2_canopen::Cia402Driver
  package: canopen_402_driver
  sdo:
    - {index: 0x6081, value: 4321}
nodes:
  left:
    node_id: 2
  right:
    node_id: 3
"""
LISTEN = ('--listen', '0.3')
DEADLINE = 10.0  # [s]


@pytest.fixture
def name() -> str:
    """Name a bus of one's own."""
    return free_virtual()


@pytest.fixture
def runner(name: str) -> Iterator[DeviceRunner]:
    """Two simulated drives, 2 and 3, on the bus."""
    with open_bus(name) as bus:
        devices = DeviceRunner(bus)
        for node_id in (2, 3):
            devices.host.add(node_id, load_eds(EDS).dictionary)
        devices.start()
        yield devices
        devices.stop()


@pytest.fixture
def inject(runner: DeviceRunner) -> Callable[..., None]:
    """Begin a fault of drive 2, or another one, now."""

    def begin(fault: Fault, drive: int = 0, **settings: Any) -> None:
        faults, injection = runner.host.devices[drive].faults, FaultInjection(fault, **settings)
        runner.call(lambda: faults.inject(injection, time.monotonic())).result(DEADLINE)

    return begin


@pytest.fixture
def bus_yml(tmp_path: Path) -> str:
    """A bus.yml with both drives."""
    (tmp_path / EDS.name).write_bytes(EDS.read_bytes())
    path = tmp_path / 'bus.yml'
    path.write_text(BUS)
    return str(path)


@pytest.fixture
def master(name: str) -> Iterator[None]:
    """SYNC, as a master sends it."""
    with ArmCanopenBus(name) as bus:
        bus.send_periodic(can.Message(arbitration_id=0x080, is_extended_id=False), 0.01)
        yield


@pytest.fixture
def witness(name: str) -> Iterator[Bus]:
    """A listener that receives everything."""
    with open_bus(name) as bus:
        yield bus


@pytest.mark.usefixtures('runner')
def test_scan_finds_devices_with_and_without_heartbeat(name: str, capsys: Output) -> None:
    """Each with its state and identity; one without heartbeat by its answer."""
    assert main(['write', '3', '0x1017', '50', '--type', 'u16', '--can', name]) == 0
    capsys.readouterr()
    assert main(['scan', '--can', name, *LISTEN]) == 0
    head, first, second, count = capsys.readouterr().out.splitlines()
    assert head.split()[:2] == ['node', 'state']
    cells = ['2', 'no heartbeat', '0x00020192 drive', '0x0000FFFF', '0x00000402', '0x00010000']
    assert [cell.strip() for cell in first.split('  ') if cell] == [*cells, '0x00000000']
    assert second.split()[:2] == ['3', 'pre-operational']
    assert count == '2 devices'


def test_scan_compares_with_bus_yml(
    name: str, inject: Callable[..., None], bus_yml: str, capsys: Output
) -> None:
    """A device that is another one, or is not there, makes the exit code 1."""
    assert main(['scan', '--can', name, '--bus-config', bus_yml, *LISTEN]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[:2] for line in lines[1:3]] == [['2', 'left'], ['3', 'right']]
    inject(Fault.WRONG_IDENTITY, product=0x403)
    inject(Fault.DISCONNECT, drive=1)
    assert main(['scan', '--can', name, '--bus-config', bus_yml, *LISTEN]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert lines[1].split()[1] == 'left'
    assert lines[1].endswith('expected product 0x00000402')
    assert lines[2].split()[:3] == ['3', 'right', 'absent']
    assert lines[2].endswith('not on the bus')


def test_two_devices_with_one_node_id(
    name: str, inject: Callable[..., None], capsys: Output
) -> None:
    """Both answer; what they share is named. An empty bus is an error, with what to look at."""
    inject(Fault.NODE_ID_CONFLICT)
    assert main(['scan', '--can', name, *LISTEN]) == 1
    assert 'node 2: several devices answer' in capsys.readouterr().err
    assert main(['scan', '--can', free_virtual(), *LISTEN]) == 1
    assert 'powered, wired and terminated' in capsys.readouterr().err


@pytest.mark.usefixtures('runner', 'master')
def test_scan_leaves_the_sdo_channels_to_a_master(name: str, witness: Bus, capsys: Output) -> None:
    """Beside a master it only listens, and says so; --query reads, with a warning."""
    assert main(['scan', '--can', name, *LISTEN]) == 1
    assert 'no device has sent a frame' in capsys.readouterr().err
    main(['write', '3', '0x1017', '50', '--type', 'u16', '--can', name])
    witness.receive(0.0)
    capsys.readouterr()
    assert main(['scan', '--can', name, *LISTEN]) == 0
    assert {frame.can_id for frame in witness.receive(0.0)} == {0x080, 0x703}
    captured = capsys.readouterr()
    assert captured.out.splitlines()[1].split() == ['3', 'pre-operational']
    assert 'a master is on this bus (SYNC), so devices are not queried' in captured.err
    assert 'a master with a heartbeat is listed like a device; --bus-config' in captured.err
    assert main(['scan', '--can', name, *LISTEN, '--query']) == 0
    assert 'its transfers may fail' in capsys.readouterr().err
    assert {frame.can_id for frame in witness.receive(0.0)} >= {0x602, 0x582, 0x603, 0x583}
    assert main(['read', '2', '0x6041', '--value', '--can', name]) == 0
    captured = capsys.readouterr()
    assert captured.out == '592\n'
    assert 'a master is on this bus (SYNC), and shares the SDO channel' in captured.err


@pytest.mark.usefixtures('runner')
def test_objects_by_name_and_number(name: str, bus_yml: str, capsys: Output) -> None:
    """With a bus.yml by the names of its EDS and of the devices; without one by the standards."""
    file = ['--can', name, '--bus-config', bus_yml]
    assert main(['read', 'left', 'statusw', '0x1018:01', '0x1008', *file]) == 0
    assert capsys.readouterr().out.splitlines() == [
        '0x6041:00 Statusword = 0x0250 Switch on disabled',
        '0x1018:01 Vendor-ID = 0x0000FFFF',
        '0x1008:00 Manufacturer device name = "Simulated CiA 402 drive"',
    ]
    assert main(['write', 'right', 'Profile velocity', '0x10', *file]) == 0
    assert capsys.readouterr().out == '0x6081:00 Profile velocity = 16\n'
    ros = f'--ros-args -p can_interface_name:={name} -p bus_config:={bus_yml}'
    for command, code, shown in (
        (f'read right 0x6081 --value {ros}', 0, '16\n'),
        (f'read 2 0x60FB --can {name}', 1, ''),
        (f'write 2 0x607C -1 --type i32 --can {name}', 0, '0x607C:00 Home offset = -1\n'),
        (f'read 2 0x6083 --type bytes --value --can {name}', 0, '10 27 00 00\n'),
        (f'write 2 0x2000 1 --can {name}', 2, ''),  # its type is not guessed
    ):
        assert main(command.split()) == code, command
        captured = capsys.readouterr()
        assert captured.out == shown
    assert 'name it with --type' in captured.err


@pytest.mark.usefixtures('runner')
def test_what_does_not_work_is_reported(name: str, bus_yml: str, capsys: Output) -> None:
    """2 for what the command line or files rule out, 1 for what a device answers."""
    for command, code, message in (
        ('read 128 0x1000', 2, '128 is no node id'),
        ('read middle 0x1000', 2, "no device is called 'middle'; known: left, right"),
        ('read left Statuswort', 2, 'similar: 0x6041:00 Statusword'),
        ('read left 0x2FFF', 2, 'there is no object 0x2FFF'),
        ('read left 0x2FFF --type u8', 1, 'object does not exist'),
        ('write left Statusword 1', 2, 'is read-only (ro)'),
        ('write left 0x6041 1 --type u16', 1, 'write a read-only object'),
        ('write left 0x6060 300', 2, 'does not fit INTEGER8'),
        ('read 9 0x1000', 1, 'did not answer the SDO for object 0x1000:00'),
        ('diff 9', 2, 'no file describes the device'),
    ):
        assert main([*command.split(), '--can', name, '--bus-config', bus_yml]) == code, command
        assert message in capsys.readouterr().err


@pytest.mark.parametrize(
    ('deviation', 'warning'),
    [
        (Fault.SDO_FOUR_BYTES, 'INTEGER8 by its EDS, with 4 bytes'),
        (Fault.SDO_NO_SIZE, ''),
        (Fault.SDO_SHORT, 'bytes where CiA 301 has 8'),
    ],
)
def test_answers_that_deviate_are_read_as_the_master_reads_them(
    name: str, inject: Callable[..., None], bus_yml: str, *, deviation: Fault, warning: str,
    capsys: Output,
) -> None:  # fmt: skip
    """Cut to the type of the object, and what is odd is said once beside them."""
    inject(deviation)
    arguments = ['--can', name, '--bus-config', bus_yml]
    assert main(['write', 'left', '0x6098', '-3', *arguments]) == 0
    capsys.readouterr()
    assert main(['read', 'left', '0x6098', '0x6041', '--value', *arguments]) == 0
    captured = capsys.readouterr()
    assert captured.out == '-3\n592\n'
    assert captured.err.count('canopen: ') == bool(warning)
    assert warning in captured.err


def test_a_device_that_holds_something_else_is_reported(
    name: str, runner: DeviceRunner, inject: Callable[..., None], capsys: Output
) -> None:
    """A write is read back, as a device may round a value or ignore it; a command is not.

    0x1010 returns what the device can store, not what was written; storing takes its time.
    """
    shown = runner.host.devices[0].store.overlay
    runner.call(lambda: shown.update({(0x6081, 0): b'\5\0\0\0'})).result(DEADLINE)
    assert main(['write', '2', '0x6081', '7', '--can', name, '--type', 'u32']) == 1
    captured = capsys.readouterr()
    assert captured.out == '0x6081:00 Profile velocity = 5\n'
    assert 'holds another value than 7' in captured.err
    inject(Fault.SDO_DELAY, object=(0x1010, 1), delay=0.7)
    assert main(['write', '2', '0x1010:1', '0x65766173', '--type', 'u32', '--can', name]) == 0
    assert capsys.readouterr().out.endswith('was written\n')


@pytest.mark.usefixtures('runner')
def test_diff_shows_what_bus_yml_has_otherwise(name: str, bus_yml: str, capsys: Output) -> None:
    """Only what differs, with the line of bus.yml; equal when it was written."""
    arguments = ['--can', name, '--bus-config', bus_yml]
    assert main(['diff', 'left', *arguments]) == 1
    output = capsys.readouterr().out
    row = next(line for line in output.splitlines() if '0x6081:00' in line)
    cells = ['*', '0x6081:00 Profile velocity', '4321', '1000', 'defaults.sdo[0] (line 11)']
    assert [cell.strip() for cell in row.split('  ') if cell] == cells
    assert '0x1018:01' not in output
    main(['write', 'left', '0x6081', '4321', *arguments])
    main(['write', 'left', '0x1016:1', '0x010258', *arguments])  # 600 ms for node 1
    for event_timer in ('0x1800:5', '0x1801:5'):
        main(['write', 'left', event_timer, '100', *arguments])
    capsys.readouterr()
    assert main(['diff', 'left', '--all', *arguments]) == 0
    output = capsys.readouterr().out
    assert '0x1018:01 Vendor-ID' in output
    assert output.splitlines()[-1].endswith('objects compared, none different')


def test_diff_takes_the_entry_of_the_heartbeat_consumer_that_boot_takes(
    name: str, inject: Callable[..., None], bus_yml: str, capsys: Output
) -> None:
    """Boot writes to the first one where none can be read, and not behind it.

    Without bus.yml the defaults of all objects that can be written count.
    """
    assert main(['diff', '2', '--can', name, '--eds', str(EDS)]) == 0
    main(['write', '2', '0x6098', '35', '--type', 'i8', '--can', name])
    assert main(['diff', '2', '--can', name, '--eds', str(EDS)]) == 1
    assert capsys.readouterr().out.splitlines()[-2].split() == (
        ['*', '0x6098:00', 'Homing', 'method', '0', '35', 'EDS']
    )
    inject(Fault.SDO_ABORT, object=(0x1016, 1))
    assert main(['diff', 'left', '--can', name, '--bus-config', bus_yml]) == 1
    rows = [line for line in capsys.readouterr().out.splitlines() if '0x1016' in line]
    assert [row.split()[1] for row in rows] == ['0x1016:01']


class Robot(NamedTuple):
    """The article's master and two of its joints, on a bus of this process."""

    master: CanopenMaster
    arguments: list[str]  # of a verb on this bus
    events: list[Event]  # what the master reported

    def assert_undisturbed(self) -> None:
        """Assert that all is online, and nothing was reported but a computer that is too busy."""
        assert all(each.status().online for each in self.master.devices.values())
        assert not [
            str(event)
            for event in self.events
            if event.severity >= Severity.WARNING and event.kind is not EventKind.CYCLE
        ]


@pytest.fixture
def robot(tmp_path: Path, name: str) -> Iterator[Robot]:
    """A robot that runs."""
    shutil.copy(EDS, tmp_path / 'cia402_slave.eds')
    text, path = ARTICLE_BUS.read_text('utf-8'), tmp_path / 'bus.yml'
    path.write_text(text[: text.index('  panda_joint3:')], 'utf-8')
    events: list[Event] = []
    with (
        simulated_devices(path, name),
        CanopenMaster.from_bus_yml(path, name, on_event=events.append) as master,
    ):
        master.boot(DEADLINE)
        yield Robot(master, ['--can', name, '--bus-config', str(path)], events)


def test_the_booted_devices_are_as_the_files_say(robot: Robot, capsys: Output) -> None:
    """Diff finds nothing that the master has not written, and scan no other device."""
    for name in ('panda_joint1', 'panda_joint2'):
        assert main(['diff', name, *robot.arguments]) == 0, capsys.readouterr().out
    assert main(['scan', *robot.arguments, '--listen', '1.2']) == 0
    rows = capsys.readouterr().out.splitlines()[-3:-1]
    assert [row.split() for row in rows] == [
        ['2', 'panda_joint1', 'operational'],
        ['3', 'panda_joint2', 'operational'],
    ]
    robot.assert_undisturbed()


def test_the_master_is_not_disturbed(robot: Robot) -> None:
    """While it reads and writes all the time, others read, and nothing of it fails."""
    stop = threading.Event()

    def keep_busy() -> int:
        transfers = 0
        while not stop.wait(0.03):
            robot.master.sdo('panda_joint1').read(0x6083)
            transfers += 1
        return transfers

    with ThreadPoolExecutor(1) as pool:
        busy = pool.submit(keep_busy)
        former = '--ask'  # codespell:ignore ask
        try:
            scanned = main(['scan', *robot.arguments, former, '--listen', '0.2'])
            compared = main(['diff', 'panda_joint1', *robot.arguments])
        finally:
            stop.set()
        assert busy.result(DEADLINE) > 5
    assert (scanned, compared) == (0, 0)
    robot.assert_undisturbed()
