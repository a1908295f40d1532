# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Axes: how far 1.0 moves a drive and what its limits allow, and two axes in one device."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
import re

from bus_rig import booted, JOINT, Leader, VirtualNetwork
from drive_samples import (
    bus_config,
    drive_config,
    drive_dictionary,
    DRIVE_EDS,
    MOTION_WRITES,
    PERIOD,
    SCALE,
    sdo_write,
    with_defaults,
)
import pytest

from arm_canopen import (
    DriveError,
    DriveState,
    load_bus,
    OperationMode,
    Setpoint,
    Severity,
)
from arm_canopen.config import DriveConfig, SdoWrite
from canopen_core.standard import AXIS_OFFSET, Index
from canopen_sim import DeviceHost
from canopen_sim.host import add_devices

NODE_ID = 2
PROFILE, CYCLIC = OperationMode.PROFILE_POSITION, OperationMode.CYCLIC_POSITION
KEYS = ('scale_pos_to_dev', 'scale_pos_from_dev', 'scale_vel_to_dev', 'scale_vel_from_dev')


def enabled(
    mode: OperationMode, scales: dict[str, float] | None = None, *writes: SdoWrite
) -> VirtualNetwork:
    """Return a network with one drive that is enabled in a mode."""
    writes = (*MOTION_WRITES, *writes)
    net = booted(drive_config(JOINT, NODE_ID, scales=scales or {}, sdo_writes=writes))
    net.enable(mode)
    return net


def test_a_drive_without_scales_moves_as_far_as_with_ros2_canopen() -> None:
    """1000 increments a unit, whatever its factor group says."""
    net = enabled(PROFILE, {key: getattr(DriveConfig(), key) for key in KEYS})
    net.target(1.5)
    net.run(8.0)
    assert net.targets(JOINT)[-1] == 1500
    assert net.drives[JOINT].view.position == pytest.approx(1.5, abs=1e-3)


@pytest.mark.parametrize(
    ('scale', 'target'),
    [*((1e-4, target) for target in (1.5, -0.4, 3.2, 12_345.0)), (1.0, 1.5), (2.0, 0.3)],
)
def test_a_position_that_would_be_rounded_to_another_one_is_refused(
    scale: float, target: float
) -> None:
    """Success at another place, or without motion, is no answer."""
    net = enabled(PROFILE, {'scale_pos_to_dev': scale, 'scale_pos_from_dev': 1 / scale})
    with pytest.raises(DriveError, match='scale_pos_to_dev'):
        net.target(target)


@pytest.mark.parametrize('scale', [0.9, 10.0])
def test_a_path_leads_between_increments(scale: float) -> None:
    """A motion source is not refused somewhere on its way because increments are whole."""
    net = enabled(CYCLIC, {'scale_pos_to_dev': scale, 'scale_pos_from_dev': 1 / scale})
    net.drives[JOINT].stream(Setpoint(0.123))


def test_a_drive_with_profile_velocity_0_refuses_targets() -> None:
    """It is said at boot and at the call, until somebody writes another one."""
    net = enabled(PROFILE, None, sdo_write(0x6081, 0, 0))
    assert any('0x6081' in text for text in net.reported(Severity.WARNING))
    with pytest.raises(DriveError, match='0x6081'):
        net.target(0.5)
    net.result(net.network.nodes[JOINT].objects.write_object(0x6081, 0, 10_000))
    net.run(0.5)
    net.target(0.5)
    net.run(5.0)
    assert net.drives[JOINT].view.position == pytest.approx(0.5, abs=1e-3)


def test_a_factor_group_that_the_drive_does_not_have_is_said() -> None:
    """The EDS promised it; without it nobody knows how far a target is."""
    missing = {(index, sub): 0 for index in (0x608F, 0x6092) for sub in (1, 2)}
    config = drive_config(JOINT, 2)
    axis = DriveConfig(name=JOINT, scale_from_factor_group=True)
    dictionary = with_defaults(drive_dictionary().for_node(2), missing)
    net = VirtualNetwork(
        bus_config(replace(config, axes=(axis,))), dictionaries={JOINT: dictionary}
    )
    net.start()
    net.run(3.0)
    assert not net.drives[JOINT].view.ready
    assert any('scale_from_factor_group' in text for text in net.reported(Severity.WARNING))


def test_limits_that_are_written_through_the_master_hold_at_once() -> None:
    """0x607D and 0x6081, by whatever service; a write that is refused changes nothing.

    One of an object that is no limit reads nothing from the drive.
    """
    net = enabled(CYCLIC)
    node, before = net.network.nodes[JOINT], net.drives[JOINT].view.parameters
    begin = net.now
    promise = node.sdo.write(0x6081, 0, b'\x01', 0.5)  # too short
    net.run(0.2)
    assert promise.error is not None
    net.result(node.objects.write_object(0x6068, 0, 12))
    net.run(0.2)
    assert net.drives[JOINT].view.parameters == before
    assert len(net.frames(0x600 + NODE_ID, since=begin)) <= 3
    net.result(node.objects.write_object(0x607D, 1, -2_000))
    net.result(node.objects.write_object(0x607D, 2, 2_000))
    net.result(node.sdo.write(0x6081, 0, (2_000).to_bytes(4, 'little'), 0.5))
    net.run(0.1)
    with pytest.raises(DriveError, match=r'software limits -0\.2 to 0\.2'):
        net.target(0.3)
    net.target(0.2)
    fastest = 0.0
    for _ in range(200):
        net.run(PERIOD)
        fastest = max(fastest, net.drives[JOINT].view.velocity)
    assert fastest == pytest.approx(0.2, rel=0.05)


def test_limits_are_in_the_units_of_targets() -> None:
    """Where bus.yml scales the two ways differently, what is accepted is what the drive does."""
    limits = (sdo_write(0x607D, 1, -5_000), sdo_write(0x607D, 2, 5_000))
    scales = {'scale_pos_from_dev': 2 / SCALE, 'scale_vel_from_dev': 3 / SCALE}
    net = enabled(PROFILE, scales, *limits)
    reported = net.drives[JOINT].view.parameters
    assert reported.position_limits == pytest.approx((-0.5, 0.5))
    assert reported.profile.velocity == pytest.approx(1.0)
    with pytest.raises(DriveError, match='software limits'):
        net.target(0.9)


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


def test_an_axis_that_is_seen_again_holds_up_no_other(net: VirtualNetwork) -> None:
    """Where it was before: none of its set-points leaves for a cycle; the other goes on."""
    for axis in (X, Y):
        net.enable(OperationMode.CYCLIC_POSITION, axis)
        net.master.attach(Leader(axis, heeds=False))
    net.run(1.0)
    net.lose(0x285, 0x305)  # positions of X, and set-points for it
    net.run(0.7)
    since = net.now
    net.lose()
    net.run(0.1)
    of_x, of_y = (len(net.frames(cob_id, since=since)) for cob_id in (0x305, 0x505))
    assert of_y - of_x == 1


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


def test_each_axis_has_a_position_of_its_own_at_power_on(net: VirtualNetwork) -> None:
    """By the name of its channel; one that is not given reports 0."""
    host = DeviceHost(lambda frame: None)
    add_devices(host, net.network.config, {Y: 0.5})
    assert [drive.position for drive in host.devices[0].drives] == [0.0, 500.0]
