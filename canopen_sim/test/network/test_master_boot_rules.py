# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Devices that are kept alive, left alone, restored, or waited for (CiA 302-2)."""

from __future__ import annotations

from dataclasses import replace

from bus_rig import VirtualNetwork
from drive_samples import bus_config
import pytest
from scripted_device import (
    object_bytes,
    PRE_OPERATIONAL,
    RESET_COMMUNICATION,
    RESET_NODE,
    ScriptedDevice,
    START,
    STOP,
)
from test_master_boot import DEVICE_VALUES, io_config, NODE, NODE_ID

from arm_canopen import CanopenError, Severity
from arm_canopen.can import Frame
from arm_canopen.config import NodeConfig
from arm_canopen.master.remote_node import BootPhase
from arm_canopen.standard import NmtCommand, NmtState

CONFIGURED = {
    (0x1400, 1): 0x205,
    (0x1400, 2): 255,
    (0x1600, 0): 2,
    (0x1600, 1): 0x6040_0010,
    (0x1600, 2): 0x6060_0008,
    (0x1401, 1): 0x8000_0305,
    (0x1800, 1): 0x4000_0185,
    (0x1800, 2): 1,
    (0x1800, 3): 15,
    (0x1800, 5): 100,
    (0x1800, 6): 3,
    (0x1A00, 0): 2,
    (0x1A00, 1): 0x6041_0010,
    (0x1A00, 2): 0x6064_0020,
}
"""The PDO objects of a device that has been configured before."""
COMMANDED = {(0x6040, 0): 0x000F, (0x6060, 0): 8}


class Network:
    """A master with devices of a script, by name.

    Attributes:
        net: The network.
        devices: Its devices.
    """

    def __init__(self, *configs: NodeConfig, **master: object) -> None:
        """Make the devices; they are switched on, and receive the master when it starts."""
        names = [config.name for config in configs]
        self.net = VirtualNetwork(bus_config(*configs, **master), absent=names)
        self.devices = {config.name: self._device(config) for config in configs}

    def _device(self, config: NodeConfig) -> ScriptedDevice:
        values = {**DEVICE_VALUES, **COMMANDED}
        device = ScriptedDevice(
            config.node_id,
            lambda frame: self.net.send_as(config.name, frame),
            object_bytes(values),
        )
        self.net.connect(config.name, device)
        return device

    def start(self, duration: float) -> None:
        """Start the master, and let time pass in [s]."""
        self.net.start()
        self.net.run(duration)


def running(**changes: object) -> tuple[Network, ScriptedDevice]:
    """Return a network whose device has been configured and started by another master."""
    network = Network(io_config(**changes))
    device = network.devices[NODE]
    device.values |= object_bytes(CONFIGURED)
    device.state, device.guarded = NmtState.OPERATIONAL, True
    return network, device


def test_a_device_in_operation_is_taken_over_without_a_word() -> None:
    """No NMT command, no PDO object written; an RPDO carries what the device has beside."""
    network, device = running(reset_communication=False)
    network.start(1.0)
    node = network.net.network.nodes[NODE]
    assert node.online
    assert node.taken_over
    assert device.commands == []
    assert {index for index, _, _ in device.writes} == {0x1017}
    assert network.net.frames(0x205) == []
    network.net.network.publish_object(node, 0x6060, 0, 9)
    assert network.net.frames(0x205) == [b'\x0f\x00\x09']
    assert any('taken over' in text and 'error L' in text for text in network.net.reported())


def test_a_device_with_other_pdos_is_left_alone() -> None:
    """The difference is named, and nothing is sent that could disturb it; a reset corrects it."""
    network, device = running(reset_communication=False)
    device.values[0x1A00, 2] = (0x606C_0020).to_bytes(4, 'little')
    network.start(3.0)
    assert device.commands == []
    assert network.net.frames(0x205) == []
    (reported,) = network.net.reported(Severity.WARNING)
    assert '0x1A00:02 is 0x606C0020 instead of 0x60640020' in reported
    assert 'Call ~/nmt_reset_node to have it configured' in reported
    network.net.network.send_nmt(NmtCommand.RESET_NODE, NODE_ID)
    network.net.run(3.0)
    assert network.net.network.nodes[NODE].online
    assert device.commands == [RESET_NODE, PRE_OPERATIONAL, START]


def test_a_device_that_does_not_report_its_state_is_left_alone() -> None:
    """It might be in operation; the reason and the remedy are reported."""
    network, device = running(reset_communication=False)
    device.guarded = False
    network.start(5.0)
    assert device.commands == []
    (reported,) = network.net.reported(Severity.WARNING)
    assert 'boot failed while' in reported
    assert 'boot error K: no heartbeat' in reported
    assert 'does not send its NMT state' in reported
    assert 'Call ~/nmt_reset_node once, or remove reset_communication: false' in reported
    network.net.network.send_nmt(NmtCommand.RESET_NODE, NODE_ID)
    network.net.run(3.0)
    assert network.net.network.nodes[NODE].online


def test_a_device_that_is_kept_alive_but_does_not_run_is_configured() -> None:
    """Without a reset."""
    network, device = running(reset_communication=False)
    device.state = NmtState.PRE_OPERATIONAL
    network.start(2.0)
    assert device.commands == [PRE_OPERATIONAL, START]
    assert network.net.network.nodes[NODE].online


def test_a_device_that_the_master_shall_not_boot_is_taken_as_it_is() -> None:
    """`boot: false`: neither reset nor configured nor started, whatever its state."""
    network, device = running(boot=False)
    device.state = NmtState.PRE_OPERATIONAL
    network.start(1.0)
    assert device.commands == []
    assert device.writes == []
    assert network.net.network.nodes[NODE].online


def test_defaults_are_restored_once_before_the_configuration() -> None:
    """`restore_configuration`: 'load' to 0x1011, a reset, and then the configuration."""
    network = Network(io_config(restore_configuration=1))
    device = network.devices[NODE]
    device.values[0x1011, 1] = bytes(4)
    loads: list[list[int]] = []

    def note(request: bytes) -> None:
        if request[:4] == b'\x23\x11\x10\x01':
            loads.append(list(device.commands))
            assert request[4:] == b'load'

    device.on_request = note
    network.start(3.0)
    assert loads == [[RESET_COMMUNICATION, PRE_OPERATIONAL]]
    assert device.commands[2:] == [RESET_NODE, PRE_OPERATIONAL, START]
    assert network.net.network.nodes[NODE].online
    assert device.writes[0][0] == 0x1017


def two(**changes: object) -> tuple[NodeConfig, NodeConfig]:
    """Return a mandatory device and an optional one."""
    first = io_config(mandatory=True, **changes)
    second = replace(
        first,
        name='other',
        node_id=10,
        mandatory=False,
        rpdos=(replace(first.rpdos[0], cob_id=0x206),),
        tpdos=(replace(first.tpdos[0], cob_id=0x186),),
    )
    return first, second


def test_nobody_is_started_without_the_mandatory_device() -> None:
    """The others wait, configured; the time that is over is reported with what is missing."""
    network = Network(*two(), boot_time=2.0)
    network.devices[NODE].answers = network.devices[NODE].announces = False
    network.start(1.5)
    other = network.net.network.nodes['other']
    assert other.phase is BootPhase.HELD
    assert START not in network.devices['other'].commands
    network.net.run(1.0)
    assert any(
        'mandatory devices have not booted within 2 s' in text and NODE in text
        for text in network.net.reported(Severity.ERROR)
    )
    network.devices[NODE].answers = True
    network.net.run(3.0)
    for device in network.devices.values():
        assert device.commands[-1] == START
    assert other.online


def test_all_are_started_by_one_frame() -> None:
    """`start_all_nodes`: when all are there, one broadcast."""
    network = Network(*two(), start_all_nodes=True)
    network.start(2.0)
    starts = [data for data in network.net.frames(0x000) if data[0] == START]
    assert starts == [b'\x01\x00']
    assert all(node.online for node in network.net.network.nodes.values())


@pytest.mark.parametrize(
    ('master', 'command', 'message'),
    [
        ({'reset_all_nodes': True}, RESET_NODE, 'all devices are reset'),
        ({'stop_all_nodes': True}, STOP, 'all devices are stopped'),
        ({}, None, 'go on without it'),
    ],
)
def test_the_loss_of_a_mandatory_device(
    master: dict[str, bool], command: int | None, message: str
) -> None:
    """The others do what bus.yml configures, and it is reported."""
    network = Network(*two(), **master)
    network.start(2.0)
    lost, other = network.devices[NODE], network.devices['other']
    other.commands.clear()
    lost.answers = lost.beats = lost.announces = False
    lost._beat_due = None
    network.net.run(0.6)
    assert any(message in text for text in network.net.reported(Severity.ERROR))
    assert other.commands[:1] == ([] if command is None else [command])


@pytest.mark.parametrize('master', [{'reset_all_nodes': True}, {'stop_all_nodes': True}])
@pytest.mark.parametrize(
    'command', [PRE_OPERATIONAL, STOP, RESET_NODE, RESET_COMMUNICATION], ids=hex
)
@pytest.mark.parametrize('ours', [True, False], ids=['our_service', 'other_tool'])
def test_a_commanded_state_of_a_mandatory_device_is_no_loss(
    master: dict[str, bool], command: int, *, ours: bool
) -> None:
    """Whoever commanded it wants the others to go on."""
    network = Network(*two(), **master)
    network.start(2.0)
    other = network.devices['other']
    other.commands.clear()
    if ours:
        network.net.network.send_nmt(NmtCommand(command), NODE_ID)
    else:
        network.net.send_as('tool', Frame(0x000, bytes((command, NODE_ID))))
    network.net.run(2.0)
    assert network.devices[NODE].commands.count(command) >= 1
    assert other.commands == []
    assert not any('mandatory and lost' in text for text in network.net.reported())


def test_a_master_that_shall_not_start_waits_for_its_command() -> None:
    """`start: false`: no SYNC and no RPDO before NMT start to its own id."""
    network = Network(io_config(), start=False)
    network.start(1.0)
    assert network.net.frames(0x080) == []
    node = network.net.network.nodes[NODE]
    with pytest.raises(CanopenError, match='the master is not operational'):
        network.net.network.publish_object(node, 0x6060, 0, 1)
    network.net.network.send_nmt(NmtCommand.START, network.net.network.config.master.node_id)
    network.net.run(0.1)
    assert network.net.frames(0x080)
    network.net.network.publish_object(node, 0x6060, 0, 1)
    assert network.net.frames(0x205)
