# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``canopen lss`` with simulated devices, one of them the program fake_slave."""

from __future__ import annotations

from collections.abc import Iterator
import subprocess
import sys

from can_addresses import free_multicast, free_virtual
from device_rig import EDS, with_defaults
from isolation import Isolation
import pytest
from tool_environment import Output

from canopen_core.can import Bus, Frame, open_bus
from canopen_core.eds import load_eds
from canopen_core.standard import lss
from canopen_sim import DeviceRunner
from canopen_tools.cli.main import main

pytestmark = pytest.mark.slow

DEADLINE = 30.0  # [s]
SERIAL = 0x100
OTHER = 0x107
ADDRESS = ('--address', '0x1', '0x2', '0x4', '0x107')


def identity(serial: int) -> dict[tuple[int, int], int]:
    """Return an identity of few bits that are set, which make fast scan slow."""
    return {(0x1018, 1): 1, (0x1018, 2): 2, (0x1018, 3): 4, (0x1018, 4): serial}


@pytest.fixture
def name() -> str:
    """Name a bus of one's own."""
    return free_virtual()


@pytest.fixture
def runner(name: str) -> Iterator[DeviceRunner]:
    """A drive without node id, and one with 5."""
    with open_bus(name) as bus:
        devices = DeviceRunner(bus)
        dictionary = load_eds(EDS).dictionary
        devices.host.add(255, with_defaults(dictionary, identity(SERIAL)))
        devices.host.add(5, with_defaults(dictionary, identity(OTHER)))
        devices.start()
        yield devices
        devices.stop()


def states(runner: DeviceRunner) -> list[lss.State]:
    """Return the LSS states of all devices."""
    return runner.call(lambda: [device._lss.state for device in runner.host.devices]).result(
        DEADLINE
    )


@pytest.mark.usefixtures('runner')
def test_a_scan_of_the_bus_mentions_devices_without_node_id(name: str, capsys: Output) -> None:
    """They answer nothing else; once all have a node id, nothing is said."""
    assert main(['scan', '--can', name, '--listen', '0.2']) == 0
    captured = capsys.readouterr()
    assert 'canopen lss scan lists it' in captured.err
    assert [line.split()[0] for line in captured.out.splitlines()] == ['node', '5', '1']
    assert main(['lss', 'set', '--node-id', '6', '--can', name]) == 0
    capsys.readouterr()
    assert main(['scan', '--can', name, '--listen', '0.2']) == 0
    assert 'lss' not in capsys.readouterr().err


def test_a_device_is_found_and_numbered(name: str, runner: DeviceRunner, capsys: Output) -> None:
    """It gets its id and boots; an id that is taken is refused, and nobody is left then."""
    assert main(['lss', 'scan', '--can', name]) == 0
    head, row, count = capsys.readouterr().out.splitlines()
    assert head.split() == ['vendor', 'product', 'revision', 'serial']
    assert row.split() == ['0x00000001', '0x00000002', '0x00000004', '0x00000100']
    assert count == '1 device without node id'
    assert set(states(runner)) == {lss.State.WAITING}
    assert main(['lss', 'set', '--node-id', '5', '--can', name]) == 1
    assert 'node id 5 is taken' in capsys.readouterr().err
    assert main(['lss', 'set', '--node-id', '10', '--store', '--can', name]) == 0
    assert capsys.readouterr().out.splitlines() == [
        'device 0x00000001 0x00000002 0x00000004 0x00000100, node id none',
        'node id 10: accepted',
        'stored',
        'node 10 has booted',
    ]
    assert main(['lss', 'scan', '--can', name]) == 1
    assert capsys.readouterr().out == '0 devices without node id\n'
    assert main(['lss', 'set', '--node-id', '12', '--can', name]) == 1
    assert 'no device is without node id; choose one' in capsys.readouterr().err
    ids = runner.call(lambda: [device.node_id for device in runner.host.devices])
    assert ids.result(DEADLINE) == [10, 5]


def test_a_device_with_an_id_is_selected_by_its_address(
    name: str, runner: DeviceRunner, capsys: Output
) -> None:
    """What it gets takes effect later, which is reported."""
    assert main(['lss', 'inquire', *ADDRESS, '--can', name]) == 0
    row = capsys.readouterr().out.splitlines()[1]
    assert row.split() == ['0x00000001', '0x00000002', '0x00000004', '0x00000107', '5']
    assert (
        main(['lss', 'set', *ADDRESS, '--node-id', '6', '--bitrate', '250k', '--can', name]) == 0
    )
    captured = capsys.readouterr()
    assert 'node id 6: accepted\nbit rate 250 kbit/s: accepted\n' in captured.out
    assert 'not stored' in captured.err
    assert 'takes effect with the next reset' in captured.err
    assert set(states(runner)) == {lss.State.WAITING}
    assert main(['lss', 'inquire', *ADDRESS[:-1], '0x108', '--can', name]) == 1
    assert 'no device has the LSS address' in capsys.readouterr().err


def test_the_only_device_is_not_one_of_two(
    name: str, runner: DeviceRunner, capsys: Output
) -> None:
    """Several devices that answer are noticed before any of them is set, and let go."""
    assert main(['lss', 'set', '--only', '--node-id', '9', '--can', name]) == 1
    assert '2 devices answer; select one of them by its address' in capsys.readouterr().err
    assert set(states(runner)) == {lss.State.WAITING}


@pytest.mark.parametrize('bitrate', ['500000', '100000'])
def test_the_bit_rate_is_activated(
    name: str, runner: DeviceRunner, capsys: Output, bitrate: str
) -> None:
    """The delay goes out, and nothing after it at the old bit rate."""
    with open_bus(name) as witness:
        options = ['--bitrate', bitrate, '--store', '--activate', '0.2']
        assert main(['lss', 'set', *ADDRESS, *options, '--can', name]) == 0
        requests = [f.data for f in witness.receive(0.0) if f.can_id == 0x7E5]
    assert requests[-1] == bytes.fromhex('15C8000000000000')
    assert f'bitrate {bitrate}' in capsys.readouterr().err
    assert lss.State.CONFIGURATION in states(runner)


@pytest.mark.parametrize(
    ('arguments', 'message'),
    [
        (['set'], 'nothing to set'),
        (['set', '--bitrate', '300k'], 'LSS has no bit rate 300k; take 1000k, 800k, 500k'),
        (['set', '--node-id', '3', '--activate', '1'], '--activate needs --bitrate'),
        (['inquire'], 'one of the arguments --address --only is required'),
        (['set', '--node-id', '128'], '128 is no node id'),
        (['set', '--address', '1', '2', '3', '--node-id', '3'], 'expected 4 arguments'),
        (['scan', '--timeout', '0'], 'not above 0'),
    ],
)
def test_wrong_usage(name: str, arguments: list[str], message: str, capsys: Output) -> None:
    """2, and nothing is sent."""
    with open_bus(name) as witness:
        try:
            code: object = main(['lss', *arguments, '--can', name])
        except SystemExit as ending:
            code = ending.code
        assert code == 2
        assert witness.receive(0.0) == []
    assert message in capsys.readouterr().err


@pytest.fixture(autouse=True)
def own_domain(isolation: Isolation, monkeypatch: pytest.MonkeyPatch) -> None:
    """Give the processes a ROS domain of their own."""
    for name, value in isolation.env.items():
        monkeypatch.setenv(name, value)


class Slave:
    """The program fake_slave without a node id."""

    def __init__(self, name: str) -> None:
        parameters = ['-p', 'node_id:=255', '-p', f'can_interface_name:={name}']
        self.process = subprocess.Popen(
            [sys.executable, '-m', 'canopen_sim.nodes.fake_slave', '--ros-args', *parameters],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )

    def end(self) -> None:
        """Kill it."""
        self.process.kill()
        self.process.wait()


def answers(bus: Bus, request: bytes) -> bool:
    """Send until a device answers."""
    for _ in range(int(DEADLINE / 0.1)):
        bus.send(Frame(0x7E5, request))
        if any(frame.can_id == 0x7E4 for frame in bus.receive(0.1)):
            return True
    return False


def test_a_fake_slave_gets_its_id_on_the_multicast_bus(capsys: Output) -> None:
    """The program that waits for its id gets one, boots, and answers its SDO with it."""
    pytest.importorskip('rclpy')
    name = free_multicast()
    slave = Slave(name)
    try:
        with open_bus(name) as bus:
            assert answers(bus, b'\x4c' + bytes(7))
        assert main(['lss', 'set', '--node-id', '42', '--store', '--can', name]) == 0
        assert 'node 42 has booted' in capsys.readouterr().out
        assert main(['read', '42', 'Device type', '--value', '--can', name]) == 0
        assert capsys.readouterr().out == f'{0x20192}\n'
    finally:
        slave.end()
