# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Limits on the host are those of the drive now, in units of targets; a stop takes its time."""

from __future__ import annotations

from bus_rig import VirtualNetwork
from drive_samples import bus_config, drive_config, MOTION_WRITES, PERIOD, SCALE, sdo_write
import pytest

from arm_canopen import DriveError, DriveState, OperationMode, Setpoint
from arm_canopen.cia402.stop_sequence import SHUTDOWN_MAX
from arm_canopen.config import NodeConfig

pytestmark = pytest.mark.slow

JOINT = 'joint1'
NODE_ID = 2


def enabled(config: NodeConfig, mode: OperationMode) -> VirtualNetwork:
    """Return a network with one drive that is enabled in a mode."""
    net = VirtualNetwork(bus_config(config))
    net.boot()
    net.do(JOINT, 'init')
    net.select(JOINT, mode)
    return net


def with_writes(*writes: tuple[int, int, int]) -> NodeConfig:
    """Return a drive with other values for some objects."""
    changed = {index for index, _, _ in writes}
    kept = tuple(write for write in MOTION_WRITES if write.index not in changed)
    return drive_config(
        JOINT, NODE_ID, sdo_writes=(*kept, *(sdo_write(*write) for write in writes))
    )


def test_limits_that_are_written_through_the_master_hold_at_once() -> None:
    """0x607D and 0x6081, by whatever service: the next target keeps to them."""
    net = enabled(drive_config(JOINT, NODE_ID), OperationMode.CYCLIC_POSITION)
    node = net.network.nodes[JOINT]
    net.result(node.objects.write_object(0x607D, 1, -2_000))
    net.result(node.objects.write_object(0x607D, 2, 2_000))
    net.result(node.sdo.write(0x6081, 0, (2_000).to_bytes(4, 'little'), 0.5))
    net.run(0.1)
    with pytest.raises(DriveError, match=r'software limits -0\.2 to 0\.2'):
        net.commands[JOINT].set_target(0.3)
    net.commands[JOINT].set_target(0.2)
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
    net.result(net.network.nodes[JOINT].objects.write_object(0x6067, 0, 12))
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
        net.commands[JOINT].set_target(0.9)


def test_an_axis_beyond_its_limits_is_led_back() -> None:
    """From 1.05 with limits of 1: towards them in any step, never further out or across."""
    net = VirtualNetwork(bus_config(with_writes((0x607D, 1, -10_000), (0x607D, 2, 10_000))))
    simulated = net.devices[JOINT].drive
    assert simulated is not None
    simulated.count_from(10_500)
    net.boot()
    net.do(JOINT, 'init')
    net.select(JOINT, OperationMode.CYCLIC_POSITION)
    drive = net.drives[JOINT]
    net.run(0.5)
    assert simulated.position == pytest.approx(10_500, abs=1)  # enabling moves nothing
    for position in (1.06, -1.04):
        with pytest.raises(DriveError, match='software limits'):
            drive.stream(Setpoint(position))
        with pytest.raises(DriveError, match='software limits'):
            net.commands[JOINT].set_target(position)
    for step in range(1, 150):
        drive.stream(Setpoint(1.05 - 0.001 * step))
        net.run(PERIOD)
    assert simulated.position == pytest.approx(9_010, abs=20)
    with pytest.raises(DriveError, match='software limits'):
        drive.stream(Setpoint(1.001))


@pytest.mark.parametrize('option', [2, 6])
def test_a_long_quick_stop_is_waited_for(option: int) -> None:
    """1 rad/s at 0.15 rad/s^2 takes 6.7 s: the power stays until the axis stands."""
    config = with_writes((0x6085, 0, 1_500), (0x605A, 0, option))
    net = enabled(config, OperationMode.PROFILE_POSITION)
    net.commands[JOINT].set_target(50.0)
    net.run(2.0)
    drive = net.devices[JOINT].drive
    assert drive is not None
    assert drive.velocity / SCALE == pytest.approx(1.0, rel=0.05)
    begin, running = net.now, net.begin(JOINT, 'shutdown', preempt=True)
    fastest = 0.0
    while not running.done:
        net.run(PERIOD)
        if drive.state is DriveState.SWITCH_ON_DISABLED:
            fastest = max(fastest, abs(drive.velocity) / SCALE)
    assert drive.state is DriveState.SWITCH_ON_DISABLED
    assert fastest < 0.03
    assert 6.0 < net.now - begin < SHUTDOWN_MAX
    assert not [text for text in net.reported() if 'did not come to rest' in text]


@pytest.mark.parametrize(
    ('option', 'state'),
    [
        (2, DriveState.SWITCH_ON_DISABLED),
        (5, DriveState.QUICK_STOP_ACTIVE),
        (6, DriveState.QUICK_STOP_ACTIVE),
        (7, DriveState.QUICK_STOP_ACTIVE),
    ],
)
def test_a_quick_stop_at_rest_ends_where_its_option_says(option: int, state: DriveState) -> None:
    """With 5 to 7 the axis is held in Quick stop active, although there was nothing to brake."""
    net = enabled(with_writes((0x605A, 0, option)), OperationMode.PROFILE_POSITION)
    net.do(JOINT, 'quick_stop', preempt=True)
    net.run(1.0)
    assert net.drives[JOINT].view.state is state
    drive = net.devices[JOINT].drive
    assert drive is not None
    assert drive.state is state


def test_a_stop_without_end_is_not_waited_for_for_ever() -> None:
    """With next to no deceleration the power goes after the longest time, and that is said."""
    config = with_writes((0x6085, 0, 100), (0x605A, 0, 6))
    net = enabled(config, OperationMode.PROFILE_POSITION)
    net.commands[JOINT].set_target(50.0)
    net.run(1.0)
    begin = net.now
    net.do(JOINT, 'shutdown', preempt=True)
    assert net.now - begin <= SHUTDOWN_MAX
    assert net.drives[JOINT].view.state is DriveState.SWITCH_ON_DISABLED
    assert [text for text in net.reported() if 'did not come to rest' in text]
