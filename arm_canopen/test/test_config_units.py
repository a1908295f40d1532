# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How far 1.0 moves a drive: as with ros2_canopen, or as bus.yml says; and what moves nothing."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import cast

from config_cases import added
from config_samples import DRIVE_ROWS, eds_text, load_text, Row, write_bus
import pytest
from virtual_network import (
    bus_config,
    drive_config,
    drive_dictionary,
    SCALE,
    sdo_write,
    VirtualNetwork,
    with_defaults,
)

from arm_canopen.cia402.modes import Mode
from arm_canopen.cia402.motion import Setpoint
from arm_canopen.cia402.parameters import DriveParameters
from arm_canopen.cia402.target_limits import check_target
from arm_canopen.cia402.units import Units
from arm_canopen.config.checks import check_bus, check_file
from arm_canopen.config.drive_model import DriveConfig
from arm_canopen.config.drive_units import AxisUnits, UnitRule
from arm_canopen.exceptions import ConfigError, DriveError
from arm_canopen.master.events import Severity
from arm_canopen.standard.drive import OperationMode
from canopen_tools.cli.main import main

JOINT = 'joint1'
FACTORS = (
    Row(0x608F, 0, 'Highest sub-index', 5, 'const', '2'),
    Row(0x608F, 1, 'Encoder increments', 7, 'rw', '4096'),
    Row(0x608F, 2, 'Motor revolutions', 7, 'rw', '1'),
    Row(0x6092, 0, 'Highest sub-index', 5, 'const', '2'),
    Row(0x6092, 1, 'Feed', 7, 'rw', '6283185'),
    Row(0x6092, 2, 'Shaft revolutions', 7, 'rw', '10'),
)
POSITION, VELOCITY, TORQUE = (
    cast('Mode', SimpleNamespace(number=number, setpoint=setpoint))
    for number, setpoint in (
        (OperationMode.CYCLIC_POSITION, 0.0),
        (OperationMode.PROFILE_VELOCITY, None),
        (OperationMode.CYCLIC_TORQUE, None),
    )
)
EDS = eds_text((*DRIVE_ROWS, *FACTORS))  # 100,000 increments per rad


def units_of(folder: Path, piece: str, *, eds: str = EDS) -> AxisUnits:
    """Return what 1.0 means for the drive of the sample bus with these keys."""
    report = check_file(write_bus(folder, added(JOINT, piece), eds=eds))
    (units,) = report.units
    return units


@pytest.mark.parametrize(
    ('piece', 'rule', 'increments', 'radians'),
    [
        ('mandatory: false', UnitRule.UPSTREAM, 1000.0, 0.01),
        ('scale_pos_to_dev: 1000', UnitRule.BUS_YML, 1000.0, 0.01),
        ('scale_pos_to_dev: 200000\nscale_pos_from_dev: 5e-6', UnitRule.BUS_YML, 200_000, 2.0),
        ('scale_from_factor_group: true', UnitRule.FACTOR_GROUP, 100_000.0, 1.0),
        (
            'scale_from_factor_group: true\nsdo: [{index: 0x6092, sub_index: 2, value: 20}]',
            UnitRule.FACTOR_GROUP,
            50_000.0,
            1.0,
        ),
    ],
)
def test_what_one_means(
    tmp_path: Path, piece: str, rule: UnitRule, increments: float, radians: float
) -> None:
    """In increments and in radians, and by which rule; objects count as boot leaves them."""
    units = units_of(tmp_path, piece)
    assert units.rule is rule
    assert units.increments == pytest.approx(increments, rel=1e-6)
    assert units.radians == pytest.approx(radians, rel=1e-6)


def test_check_shows_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A row for each axis."""
    main(['check', str(write_bus(tmp_path, eds=EDS))])
    row = next(line for line in capsys.readouterr().out.splitlines() if line.startswith(JOINT))
    assert row.split()[:4] == [JOINT, '1000', '0.01', '1000']


def test_an_eds_without_factor_group_tells_no_radians(tmp_path: Path) -> None:
    """Then nobody knows what an increment is, and the group cannot be asked for."""
    assert units_of(tmp_path, 'mandatory: false', eds=eds_text()).radians is None
    text = added(JOINT, 'scale_from_factor_group: true')
    (error,) = check_file(write_bus(tmp_path, text)).errors
    assert error.key.endswith('scale_from_factor_group')


def test_the_default_is_told_where_the_drive_counts_otherwise(tmp_path: Path) -> None:
    """1.0 is 0.01 rad here, as with ros2_canopen; with the scale written nothing is said."""
    config = load_text(tmp_path, eds=EDS)
    assert ['0.01 rad' in warning.message for warning in check_bus(config).warnings].count(
        True
    ) == 1
    written = load_text(tmp_path, added(JOINT, 'scale_pos_to_dev: 1000'), eds=EDS)
    assert not any('0.01 rad' in warning.message for warning in check_bus(written).warnings)


def test_two_rules_are_refused(tmp_path: Path) -> None:
    """The factor group and a scale cannot both be meant."""
    text = added(JOINT, 'scale_from_factor_group: true\nscale_pos_to_dev: 5')
    with pytest.raises(ConfigError, match='scale_pos_to_dev'):
        load_text(tmp_path, text, eds=EDS)


@pytest.mark.parametrize('key', ['scale_pos_to_dev', 'scale_vel_to_dev'])
def test_a_scale_that_rounds_everything_is_a_warning(tmp_path: Path, key: str) -> None:
    """As in the robot_control sample of ros2_canopen, where the two directions are mixed up."""
    other = key.replace('_to_', '_from_')
    text = added(JOINT, f'{key}: 0.0001\n{other}: 10000')
    found = [w for w in check_file(write_bus(tmp_path, text, eds=EDS)).warnings if key in w.key]
    assert len(found) == 1


@pytest.mark.parametrize(
    ('piece', 'warns'),
    [
        ('sdo: [{index: 0x6081, value: 0}]', True),
        ('sdo: [{index: 0x6081, value: 0}]\nposition_mode: 8', False),
        ('sdo: [{index: 0x6081, value: 5}]', False),
    ],
)
def test_a_profile_velocity_of_0(tmp_path: Path, piece: str, *, warns: bool) -> None:
    """In mode 1 nothing would move; other modes do not need it."""
    report = check_file(write_bus(tmp_path, added(JOINT, piece)))
    assert any('profile velocity' in warning.message for warning in report.warnings) is warns


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
    assert net.drives[JOINT].position == pytest.approx(1.5, abs=1e-3)


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


@pytest.mark.parametrize('offset', [0.0, 0.3])
@pytest.mark.parametrize(
    ('scale', 'target', 'increments'), [(1e-4, 20_000.0, 2), (0.9, 1.111, 1), (SCALE, 1e-5, 0)]
)
def test_a_position_within_the_tolerance_is_taken(
    scale: float, target: float, increments: int, offset: float
) -> None:
    """Also by a coarse scale, and a part of an increment of a fine one; offsets count."""
    units = Units(DriveConfig(scale_pos_to_dev=scale, offset_pos_to_dev=offset))
    check_target(JOINT, POSITION, DriveParameters(), units, target - offset / scale)
    assert units.position_to_device(target - offset / scale) == increments


@pytest.mark.parametrize('mode', [VELOCITY, TORQUE])
@pytest.mark.parametrize(
    ('scale', 'target', 'taken'),
    [
        (0.3, 5.1, True),  # 1.53 device units; a whole number is not what was asked for
        (0.3, -1.7, True),
        (0.3, 1.6, False),
        (0.3, -1.6, False),
        (0.3, 0.0, True),
        (1.0, 0.4, False),
        (100.0, 0.004, False),
        (100.0, 0.0006, True),  # of a stream that fades
    ],
)
def test_a_rate_is_refused_only_where_it_would_become_0(
    mode: Mode, scale: float, target: float, *, taken: bool
) -> None:
    """Velocities and torques are rounded, whatever their scale."""
    units = Units(DriveConfig(scale_vel_to_dev=scale, scale_eff_to_dev=scale))
    if taken:
        check_target(JOINT, mode, DriveParameters(), units, target)
        return
    with pytest.raises(DriveError, match='would become 0'):
        check_target(JOINT, mode, DriveParameters(), units, target)


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
    assert any('0x6081' in text for text in net.told(Severity.WARNING))
    net.do(JOINT, 'init')
    net.select(JOINT, OperationMode.PROFILE_POSITION)
    with pytest.raises(DriveError, match='0x6081'):
        net.commands[JOINT].set_target(0.5)
    net.result(net.network.nodes[JOINT].objects.write_object(0x6081, 0, 10_000))
    net.run(0.5)
    net.commands[JOINT].set_target(0.5)
    net.run(5.0)
    assert net.drives[JOINT].position == pytest.approx(0.5, abs=1e-3)


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
    assert not net.drives[JOINT].ready
    assert any('scale_from_factor_group' in text for text in net.told(Severity.WARNING))
