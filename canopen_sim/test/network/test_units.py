# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How far 1.0 moves a drive, and what its limits allow: as bus.yml and the drive say it now."""

from __future__ import annotations

from dataclasses import replace

from bus_rig import booted, VirtualNetwork
from drive_samples import (
    bus_config,
    drive_config,
    drive_dictionary,
    MOTION_WRITES,
    PERIOD,
    SCALE,
    sdo_write,
    with_defaults,
)
import pytest

from arm_canopen import DriveError, NodeConfig, OperationMode, Setpoint, Severity
from arm_canopen.config import DriveConfig

JOINT = 'joint1'


def moved(scales: dict[str, float], target: float) -> VirtualNetwork:
    """Send a drive to a target in profile position mode, and wait for it."""
    net = booted(drive_config(JOINT, 2, scales=scales))
    net.enable(OperationMode.PROFILE_POSITION)
    net.target(target)
    net.run(8.0)
    return net


def test_a_drive_without_scales_moves_as_far_as_with_ros2_canopen() -> None:
    """1000 increments a unit, whatever its factor group says."""
    defaults = DriveConfig()
    keys = ('scale_pos_to_dev', 'scale_pos_from_dev', 'scale_vel_to_dev', 'scale_vel_from_dev')
    net = moved({key: getattr(defaults, key) for key in keys}, 1.5)
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
    with pytest.raises(DriveError, match='scale_pos_to_dev'):
        moved({'scale_pos_to_dev': scale, 'scale_pos_from_dev': 1 / scale}, target)


@pytest.mark.parametrize('scale', [0.9, 10.0])
def test_a_path_leads_between_increments(scale: float) -> None:
    """A motion source is not refused somewhere on its way because increments are whole."""
    scales = {'scale_pos_to_dev': scale, 'scale_pos_from_dev': 1 / scale}
    net = booted(drive_config(JOINT, 2, scales=scales))
    net.enable(OperationMode.CYCLIC_POSITION)
    net.drives[JOINT].stream(Setpoint(0.123))


def test_a_drive_with_profile_velocity_0_refuses_targets() -> None:
    """It is said at boot and at the call, until somebody writes another one."""
    config = drive_config(JOINT, 2)
    writes = (*config.sdo_writes, sdo_write(0x6081, 0, 0))
    net = booted(replace(config, sdo_writes=writes))
    assert any('0x6081' in text for text in net.reported(Severity.WARNING))
    net.enable(OperationMode.PROFILE_POSITION)
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


pytestmark = pytest.mark.slow

NODE_ID = 2


def enabled(config: NodeConfig, mode: OperationMode) -> VirtualNetwork:
    """Return a network with one drive that is enabled in a mode."""
    net = booted(config)
    net.enable(mode)
    return net


def test_limits_that_are_written_through_the_master_hold_at_once() -> None:
    """0x607D and 0x6081, by whatever service: the next target keeps to them."""
    net = enabled(drive_config(JOINT, NODE_ID), OperationMode.CYCLIC_POSITION)
    node = net.network.nodes[JOINT]
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


def test_a_write_that_the_drive_refuses_changes_nothing() -> None:
    """And one of an object that is no limit reads nothing from the drive."""
    net = enabled(drive_config(JOINT, NODE_ID), OperationMode.CYCLIC_POSITION)
    before = net.drives[JOINT].view.parameters
    begin = net.now
    promise = net.network.nodes[JOINT].sdo.write(0x6081, 0, b'\x01', 0.5)  # too short
    net.run(0.2)
    assert promise.error is not None
    net.result(net.network.nodes[JOINT].objects.write_object(0x6068, 0, 12))
    net.run(0.2)
    assert net.drives[JOINT].view.parameters == before
    assert len(net.frames(0x600 + NODE_ID, since=begin)) <= 3


def test_limits_are_in_the_units_of_targets() -> None:
    """Where bus.yml scales the two ways differently, what is accepted is what the drive does."""
    writes = (*MOTION_WRITES, sdo_write(0x607D, 1, -5_000), sdo_write(0x607D, 2, 5_000))
    scales = {'scale_pos_from_dev': 2 / SCALE, 'scale_vel_from_dev': 3 / SCALE}
    config = drive_config(JOINT, NODE_ID, sdo_writes=writes, scales=scales)
    net = enabled(config, OperationMode.PROFILE_POSITION)
    reported = net.drives[JOINT].view.parameters
    assert reported.position_limits == pytest.approx((-0.5, 0.5))
    assert reported.profile.velocity == pytest.approx(1.0)
    with pytest.raises(DriveError, match='software limits'):
        net.target(0.9)
