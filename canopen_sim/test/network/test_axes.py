# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Two axes in one device: objects 0x800 apart, one NMT state, one SDO server, one EMCY."""

from __future__ import annotations

from pathlib import Path
import re

from bus_rig import VirtualNetwork
from drive_samples import DRIVE_EDS
import pytest

from arm_canopen import DriveError, DriveState, load_bus, OperationMode
from canopen_core.standard import AXIS_OFFSET, Index

EDS = DRIVE_EDS.with_name('cia402_two_axes.eds')
BUS = f"""
master: {{node_id: 1, driver: "ros2_canopen::MasterDriver", sync_period: 10000}}
nodes:
  table:
    node_id: 5
    driver: "ros2_canopen::Cia402Driver"
    dcf: {EDS}
    num_channels: 2
    channel_names: [table_x, table_y]
    heartbeat_producer: 100
    tpdo:
      1: {{cob_id: auto, transmission: 1, mapping: [{{index: 0x6041}}, {{index: 0x6061}}]}}
      2: {{cob_id: auto, transmission: 1, mapping: [{{index: 0x6064}}, {{index: 0x606C}}]}}
      3: {{cob_id: auto, transmission: 1, mapping: [{{index: 0x6841}}, {{index: 0x6861}}]}}
      4: {{cob_id: auto, transmission: 1, mapping: [{{index: 0x6864}}, {{index: 0x686C}}]}}
    rpdo:
      1: {{cob_id: auto, mapping: [{{index: 0x6040}}, {{index: 0x6060}}]}}
      2: {{cob_id: auto, mapping: [{{index: 0x607A}}, {{index: 0x60FF}}]}}
      3: {{cob_id: auto, mapping: [{{index: 0x6840}}, {{index: 0x6860}}]}}
      4: {{cob_id: auto, mapping: [{{index: 0x687A}}, {{index: 0x68FF}}]}}
"""
X, Y = 'table_x', 'table_y'


@pytest.fixture(params=[0, 0x800, 0x1000], ids='first axis at 0x{:X} + 0x6000'.format)
def net(tmp_path: Path, request: pytest.FixtureRequest) -> VirtualNetwork:
    """A booted device with two axes; some have none where the first one belongs."""

    def moved(match: re.Match[str]) -> str:
        return f'{match[1]}{int(match[2], 16) + request.param:X}'

    eds = tmp_path / 'table.eds'
    path = tmp_path / 'bus.yml'
    for target, text in ((eds, EDS.read_text()), (path, BUS.replace(str(EDS), eds.name))):
        target.write_text(re.sub(r'(\[|0x)(6[0-9A-F]{3})', moved, text))
    net = VirtualNetwork(load_bus(path))
    net.boot()
    return net


def motors(net: VirtualNetwork) -> list[float]:
    """Return where the motors really are in [rad]."""
    return [drive.position / 1000.0 for drive in net.devices['table'].drives]


def test_the_axes_move_apart(net: VirtualNetwork) -> None:
    """Each has its own state, mode and target."""
    assert list(net.drives) == [X, Y]
    net.do(X, 'init')
    assert net.drives[Y].view.state is DriveState.SWITCH_ON_DISABLED
    net.do(Y, 'init')
    net.select(X, OperationMode.PROFILE_POSITION)
    net.select(Y, OperationMode.CYCLIC_POSITION)
    net.commands[X].set_target(0.5)
    net.run(3.0)
    assert motors(net) == pytest.approx([0.5, 0.0], abs=2e-3)
    net.commands[Y].set_target(-0.25)
    net.run(3.0)
    assert motors(net) == pytest.approx([0.5, -0.25], abs=2e-3)


def test_the_axes_of_a_device_that_comes_back_are_braked_at_the_same_time(
    net: VirtualNetwork,
) -> None:
    """No axis goes on until another one stands."""
    device = net.devices['table']
    for drive in device.drives:  # which go on without their master
        device.store.find(Index.ABORT_CONNECTION_OPTION + AXIS_OFFSET * drive.number).value = 0
    for axis in (X, Y):
        net.enable(OperationMode.PROFILE_VELOCITY, axis)
        net.commands[axis].set_target(0.5)
    net.run(2.0)
    net.wire.loses = lambda sender, frame: True
    net.run(8.0)
    assert [drive.state for drive in device.drives] == [DriveState.OPERATION_ENABLED] * 2
    net.wire.loses = lambda sender, frame: False
    left: dict[int, float] = {}
    while len(left) < len(device.drives):
        net.run(0.01)
        for drive in device.drives:
            if drive.state is not DriveState.OPERATION_ENABLED:
                left.setdefault(drive.number, net.now)
    assert max(left.values()) - min(left.values()) < 0.05


def test_a_fault_stops_its_axis_and_is_said_by_name(net: VirtualNetwork) -> None:
    """The other goes on; the way back is a command for the one."""
    for axis in (X, Y):
        net.enable(OperationMode.PROFILE_POSITION, axis)
    net.devices['table'].drives[1].raise_fault(0x2310, net.now)
    net.run(0.5)
    assert net.drives[Y].view.state is DriveState.FAULT
    assert net.drives[X].view.state is DriveState.OPERATION_ENABLED
    assert any('table_y: FAULT' in text for text in net.reported())
    with pytest.raises(DriveError, match='table_y takes no target; recover it'):
        net.commands[Y].set_target(0.1)
    net.commands[X].set_target(0.3)
    net.run(2.0)
    assert motors(net)[0] == pytest.approx(0.3, abs=2e-3)
    net.do(Y, 'recover')
    assert net.drives[Y].view.state is DriveState.OPERATION_ENABLED
