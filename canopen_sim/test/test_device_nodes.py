# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Programs of simulated devices, and their services: faults, power and STO by hand."""

from __future__ import annotations

from collections.abc import Iterator
import importlib
import os
from pathlib import Path
import re
import shutil
import signal
import subprocess
import sys
import time
from typing import Any

from can_addresses import free_multicast, free_virtual
from config_samples import ARTICLE_BUS
from device_rig import EDS
from drive_samples import drive_dictionary
from isolation import Isolation
import pytest

from canopen_core.can import Bus, open_bus
from canopen_core.standard import Statusword
from canopen_sim import DeviceRunner, Fault

pytestmark = pytest.mark.slow

rclpy = pytest.importorskip('rclpy')

PACKAGE = Path(__file__).parents[1]
ARRIVAL = 30.0  # [s] a deadline, no measure


@pytest.fixture(autouse=True)
def own_domain(isolation: Isolation, monkeypatch: pytest.MonkeyPatch) -> None:
    """Run the processes in a ROS domain of their own."""
    for name, value in isolation.env.items():
        monkeypatch.setenv(name, value)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with the article's bus.yml and our EDS."""
    shutil.copy(ARTICLE_BUS, tmp_path / 'bus.yml')
    shutil.copy(EDS, tmp_path / 'cia402_slave.eds')
    return tmp_path


def start(node: str, **parameters: str | int) -> subprocess.Popen[str]:
    """Start a node with parameters."""
    arguments = [part for k, v in parameters.items() for part in ('-p', f'{k}:={v}')]
    path = os.pathsep.join((str(PACKAGE), os.environ.get('PYTHONPATH', '')))
    return subprocess.Popen(
        [sys.executable, '-m', f'canopen_sim.nodes.{node}', '--ros-args', *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env={**os.environ, 'PYTHONPATH': path},
    )


@pytest.fixture
def processes() -> Iterator[list[subprocess.Popen[str]]]:
    """Processes that are killed at the end, whatever happens."""
    started: list[subprocess.Popen[str]] = []
    yield started
    for process in started:
        process.kill()
        process.communicate()


def output(process: subprocess.Popen[str]) -> str:
    """Wait for the end of a process and return what it wrote."""
    return process.communicate(timeout=ARRIVAL)[0]


@pytest.mark.scenario
def test_all_slaves_of_the_article(folder: Path, processes: list[subprocess.Popen[str]]) -> None:
    """Seven drives boot on the bus; SIGTERM ends the process cleanly."""
    name = free_multicast()
    with open_bus(name) as bus:
        process = start('fake_slaves', bus_config=str(folder / 'bus.yml'), can_interface_name=name)
        processes.append(process)
        booted: set[int] = set()
        deadline = time.monotonic() + ARRIVAL
        while len(booted) < 7:
            assert time.monotonic() < deadline
            assert process.poll() is None, output(process)
            booted |= {f.can_id for f in bus.receive(0.5) if f.data == b'\x00'}
        assert booted == set(range(0x702, 0x709))
        process.send_signal(signal.SIGTERM)
        text = output(process)
    assert process.returncode == 0, text
    assert f'7 simulated drives on {name}' in text
    assert 'Traceback' not in text


@pytest.mark.scenario
def test_node_ids_that_are_on_the_bus_are_refused(
    folder: Path, processes: list[subprocess.Popen[str]]
) -> None:
    """A second set of drives ends with words; the first goes on."""
    name = free_multicast()
    with open_bus(name) as bus:
        first = start('fake_slave', node_id=2, slave_config=str(EDS), can_interface_name=name)
        processes.append(first)
        deadline = time.monotonic() + ARRIVAL
        while not any(frame.can_id == 0x702 for frame in bus.receive(0.5)):
            assert time.monotonic() < deadline
            assert first.poll() is None, output(first)
    second = start('fake_slaves', bus_config=str(folder / 'bus.yml'), can_interface_name=name)
    processes.append(second)
    text = output(second)
    assert second.returncode == 1, text
    assert f'{name} has devices with these node ids already' in text
    assert 'of node id 2. End the other' in text
    assert first.poll() is None, output(first)


BAD: dict[str, tuple[str, dict[str, str | int], str]] = {
    'no bus.yml given': ('fake_slaves', {}, 'no bus_config'),
    'no such bus': ('fake_slave', {'can_interface_name': 'nothing99'}, 'nothing99'),
    'node id out of range': ('fake_slave', {'node_id': 128}, 'node_id'),
}


@pytest.mark.scenario
@pytest.mark.parametrize('case', BAD)
def test_errors_are_one_message(processes: list[subprocess.Popen[str]], case: str) -> None:
    """What cannot work is said in one message with the culprit; the exit code is 1."""
    node, parameters, culprit = BAD[case]
    process = start(node, **{'can_interface_name': free_multicast(), **parameters})
    processes.append(process)
    text = output(process)
    assert process.returncode == 1, text
    assert culprit in text
    assert text.count('[FATAL]') == 1
    assert 'Traceback' not in text


@pytest.mark.parametrize(
    'module',
    ['canopen_sim.nodes.fake_slave', 'canopen_sim.nodes.fake_slaves', 'arm_canopen.nodes.master'],
)
def test_help_names_every_parameter(module: str) -> None:
    """What a program does, an example, and each parameter that it declares; nothing is started."""
    shown = subprocess.check_output([sys.executable, '-m', module, '--help'], text=True)
    assert 'example:' in shown
    source = Path(str(importlib.import_module(module).__file__)).read_text('utf-8')
    declared = set(re.findall(r"\.(?:text|whole|number|flag)\(\s*'(\w+)'", source))
    declared |= {'can_interface_name', 'thread_priority'}
    if module.startswith('canopen_sim'):
        declared.add('store_directory')
    if 'declare_black_box' in source:
        declared |= {'black_box_folder', 'black_box_window'}
    rows = re.findall(r'^  ([a-z_]+(?:, [a-z_]+)*)(?:  |$)', shown, re.MULTILINE)
    assert declared == {name for row in rows for name in row.split(', ')}


def test_a_single_device_takes_the_bus_that_all_programs_take(
    processes: list[subprocess.Popen[str]],
) -> None:
    """Without a name the bus is `auto`: one command does on any host."""
    process = start('fake_slave', node_id=9)
    processes.append(process)
    assert process.stdout is not None
    line = next(line for line in process.stdout if 'simulated drive 9' in line)
    assert ' on vcan0' in line or ' on udp_multicast:' in line


pytest.importorskip('arm_msgs')

NAMES = {'joint1': 2, 'joint2': 3, 'no-name': 4}


class Services:
    """A node with three simulated drives, and clients."""

    def __init__(self, bus: Bus, other: Bus) -> None:
        """Start everything; needs an initialised context."""
        from canopen_sim.nodes.fake_slaves import FaultServices

        self.other = other  # the bus, as the rest of the network has it
        self.runner = DeviceRunner(bus)  # runs the devices
        for node_id in NAMES.values():
            self.runner.host.add(node_id, drive_dictionary())
        self.node = rclpy.create_node('slaves')
        FaultServices(self.node, self.runner, NAMES)
        self.runner.start()
        self._executor = rclpy.executors.SingleThreadedExecutor()
        self._executor.add_node(self.node)

    def call(self, service: Any, name: str, **fields: Any) -> Any:
        """Call a service and return the response."""
        client = self.node.create_client(service, f'/slaves/{name}')
        future = client.call_async(service.Request(**fields))
        self._executor.spin_until_future_complete(future, ARRIVAL)
        assert future.done(), name
        return future.result()

    def faults(self) -> dict[int, list[Fault]]:
        """Return the faults that go on, by node id."""
        return self.runner.call(
            lambda: {
                device.node_id: [injection.fault for injection in device.faults.active]
                for device in self.runner.host.devices
            }
        ).result(ARRIVAL)

    def wait_for_boot_up(self, *node_ids: int) -> None:
        """Wait for the boot-up messages of devices."""
        missing = {0x700 + node_id for node_id in node_ids}
        deadline = time.monotonic() + ARRIVAL
        while missing:
            assert time.monotonic() < deadline, missing
            missing -= {f.can_id for f in self.other.receive(0.5) if f.data == b'\x00'}

    def close(self) -> None:
        """End everything."""
        self.runner.stop()
        self._executor.shutdown()
        self.node.destroy_node()


@pytest.fixture
def services(isolation: Isolation) -> Iterator[Services]:
    """Three drives with their services."""
    rclpy.init(domain_id=isolation.domain_id)
    name = free_virtual()
    try:
        with open_bus(name) as bus, open_bus(name) as other:
            stage = Services(bus, other)
            stage.wait_for_boot_up(*NAMES.values())
            yield stage
            stage.close()
    finally:
        rclpy.try_shutdown()


@pytest.mark.scenario
def test_faults_by_hand(services: Services) -> None:
    """One device or all misbehave by name, until "none" ends it; wrong requests change nothing."""
    from arm_msgs.srv import InjectFault

    def inject(name: str = 'fault', **fields: Any) -> Any:
        return services.call(InjectFault, name, **fields)

    cases: list[tuple[dict[str, Any], str]] = [
        ({'device': 'joint9', 'fault': 'reboot'}, "unknown device 'joint9'; did you mean 'joint"),
        ({'fault': 'explode'}, '\n  power_off: has no power (position_kept, duration)'),
        ({'fault': 'sdo_delay', 'settings': ['pdo=1']}, 'choose one of duration, object, delay'),
        ({'fault': 'sdo_delay', 'duration': -1.0}, 'duration -1.0'),
    ]
    for request, expected in cases:
        answer = inject(**request)
        assert not answer.success
        assert expected in answer.message
    assert services.faults() == {2: [], 3: [], 4: []}
    # rclpy ends a node that logs with two severities from one place
    settings = ['delay=0.3']
    answer = inject(device='joint1', fault='sdo_delay', settings=settings, duration=60.0)
    assert answer.success, answer.message
    assert answer.message == 'joint1: sdo_delay: answers SDOs late, by 0.3 s, for 60 s'
    assert inject(device='3', fault='disconnect').success
    assert inject('no_name/fault', fault='heartbeat_stop').success
    faults = {2: [Fault.SDO_DELAY], 3: [Fault.DISCONNECT], 4: [Fault.HEARTBEAT_STOP]}
    assert services.faults() == faults
    answer = inject(fault='none')
    assert answer.success
    assert answer.message.startswith('3 devices: ended: sdo_delay')
    assert services.faults() == {2: [], 3: [], 4: []}


@pytest.mark.scenario
def test_power_and_sto_by_hand(services: Services) -> None:
    """One device boots again, or all; STO takes the voltage of one drive or all, and gives it."""
    from std_srvs.srv import SetBool, Trigger

    def supplied() -> list[bool]:
        devices = services.runner.host.devices
        words = services.runner.call(
            lambda: [device.store.integer(0x6041).value for device in devices]
        ).result(ARRIVAL)
        return [bool(word & Statusword.VOLTAGE_ENABLED) for word in words]

    assert services.call(SetBool, 'joint1/sto', data=True).success
    assert supplied() == [False, True, True]
    assert services.call(SetBool, 'sto', data=True).success
    assert supplied() == [False, False, False]
    answer = services.call(SetBool, 'sto', data=False)
    assert answer.message == '3 devices: STO is released'
    assert supplied() == [True, True, True]
    assert services.call(Trigger, 'joint2/power_cycle').success
    services.wait_for_boot_up(3)
    answer = services.call(Trigger, 'power_cycle')
    assert answer.message.startswith('3 devices: power_off')
    services.wait_for_boot_up(*NAMES.values())
    services.runner.stop()
    answer = services.call(Trigger, 'power_cycle')
    assert not answer.success
    assert 'has ended' in answer.message
