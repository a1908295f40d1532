# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How far 1.0 moves a drive: as with ros2_canopen, or as bus.yml says; and what moves nothing."""

from __future__ import annotations

from dataclasses import replace

from bus_rig import VirtualNetwork
from drive_samples import (
    bus_config,
    drive_config,
    drive_dictionary,
    MOTION_WRITES,
    SCALE,
    sdo_write,
    with_defaults,
)
import pytest

from arm_canopen import DriveError, OperationMode, Setpoint, Severity
from arm_canopen.config import DriveConfig
from arm_canopen.standard import DataType, ObjectDictionary, ObjectEntry

JOINT = 'joint1'


def moved(scales: dict[str, float], target: float) -> VirtualNetwork:
    """Send a drive to a target in profile position mode, and wait for it."""
    net = VirtualNetwork(bus_config(drive_config(JOINT, 2, scales=scales)))
    net.boot()
    net.do(JOINT, 'init')
    net.select(JOINT, OperationMode.PROFILE_POSITION)
    net.commands[JOINT].set_target(target)
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
    net = VirtualNetwork(bus_config(drive_config(JOINT, 2, scales=scales)))
    net.boot()
    net.do(JOINT, 'init')
    net.select(JOINT, OperationMode.CYCLIC_POSITION)
    net.drives[JOINT].stream(Setpoint(0.123))


def test_a_drive_with_profile_velocity_0_refuses_targets() -> None:
    """It is said at boot and at the call, until somebody writes another one."""
    config = drive_config(JOINT, 2)
    writes = (*config.sdo_writes, sdo_write(0x6081, 0, 0))
    net = VirtualNetwork(bus_config(replace(config, sdo_writes=writes)))
    net.boot()
    assert any('0x6081' in text for text in net.reported(Severity.WARNING))
    net.do(JOINT, 'init')
    net.select(JOINT, OperationMode.PROFILE_POSITION)
    with pytest.raises(DriveError, match='0x6081'):
        net.commands[JOINT].set_target(0.5)
    net.result(net.network.nodes[JOINT].objects.write_object(0x6081, 0, 10_000))
    net.run(0.5)
    net.commands[JOINT].set_target(0.5)
    net.run(5.0)
    assert net.drives[JOINT].view.position == pytest.approx(0.5, abs=1e-3)


TENTHS = {'scale_vel_to_dev': 10 * SCALE, 'scale_vel_from_dev': 0.1 / SCALE}  # 0.1 inc/s
TENS = {'scale_acc_to_dev': SCALE / 10, 'scale_acc_from_dev': 10 / SCALE}  # 10 inc/s^2


@pytest.mark.parametrize(
    ('scales', 'objects'),
    [
        (TENTHS | TENS, {}),
        (TENTHS, {(0x60A9, 0): 0xFFB5_0300, (0x60AA, 0): 0x01B5_5700}),
        (
            TENTHS,
            {(0x6096, 1): 10, (0x6096, 2): 1, (0x6097, 1): 1, (0x6097, 2): 100},
        ),
    ],
    ids=['bus.yml', 'SI units', 'factor group'],
)
def test_accelerations_have_a_unit_of_their_own(
    scales: dict[str, float], objects: dict[tuple[int, int], int]
) -> None:
    """A stop of 10 counts/s^2 beside velocities of 0.1 counts/s is as short as the drive can."""
    writes = (
        *(write for write in MOTION_WRITES if write.index == 0x60C2),
        sdo_write(0x607F, 0, 300_000),  # 3 rad/s
        sdo_write(0x6081, 0, 100_000),  # 1 rad/s
        *(sdo_write(index, 0, 5_000) for index in (0x6083, 0x6084, 0x6085)),  # 5 rad/s^2
    )
    known = drive_dictionary().for_node(2)
    dictionary = ObjectDictionary(
        [
            *with_defaults(known, objects),
            *(
                ObjectEntry(*address, 'Unit', DataType.UNSIGNED32, default=value)
                for address, value in objects.items()
                if known.get(*address) is None
            ),
        ]
    )
    config = drive_config(JOINT, 2, scales=scales, sdo_writes=writes, dictionary=dictionary)
    units = {} if objects else {0: (0.1, 10.0)}
    net = VirtualNetwork(bus_config(config), rate_units=units)
    net.boot()
    net.do(JOINT, 'init')
    net.select(JOINT, OperationMode.CYCLIC_POSITION)
    assert net.drives[JOINT].view.parameters.profile.deceleration == pytest.approx(5.0)
    assert net.drives[JOINT].view.parameters.quick_stop_deceleration == pytest.approx(5.0)
    net.commands[JOINT].set_target(20.0)
    net.run(2.0)
    drive = net.drives[JOINT].view
    assert drive.velocity == pytest.approx(1.0, rel=0.02)
    begin, at = net.now, drive.position
    net.do(JOINT, 'halt')
    assert net.now - begin < 0.5
    assert drive.position - at == pytest.approx(0.1, abs=0.03)


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
