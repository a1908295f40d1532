# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How far 1.0 moves a drive: as with ros2_canopen, or as bus.yml says; and what moves nothing."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
import re
from types import SimpleNamespace
from typing import cast

from config_samples import added, ARTICLE_BUS, load_text, write_bus
from drive_samples import SCALE
from eds_samples import DRIVE_ROWS, eds_text, FACTOR_ROWS, Row
import pytest

from arm_canopen import DriveError, OperationMode
from arm_canopen.cia402.modes import Mode
from arm_canopen.cia402.modes.mode import check_target
from arm_canopen.cia402.parameters import DriveParameters
from arm_canopen.cia402.units import Units
from arm_canopen.config import AxisUnits, check_bus, check_file, DriveConfig, rate_units, UnitRule
from canopen_core.standard import Index

JOINT = 'joint1'
EDS = eds_text((*DRIVE_ROWS, *FACTOR_ROWS))  # 100,000 increments per rad


def units_of(folder: Path, piece: str, *, eds: str = EDS) -> AxisUnits:
    """Return what 1.0 means for the drive of the sample bus with these keys."""
    report = check_file(write_bus(folder, added(JOINT, piece), eds=eds))
    (units,) = report.units
    return units


def test_what_one_means(tmp_path: Path) -> None:
    """In increments and in radians, and by which rule; objects count as boot leaves them."""
    for piece, rule, increments, radians in (
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
    ):
        units = units_of(tmp_path, piece)
        assert units.rule is rule, piece
        assert units.increments == pytest.approx(increments, rel=1e-6), piece
        assert units.radians == pytest.approx(radians, rel=1e-6), piece


def test_a_key_of_defaults_is_warned_of_once_with_all_its_drives(tmp_path: Path) -> None:
    """Also where a key is missing beside it."""
    (tmp_path / 'cia402_slave.eds').write_text(eds_text())
    scales = 'scale_pos_to_dev: 4000\nscale_pos_from_dev: 0.00025'
    bus = write_bus(tmp_path, added('defaults', scales, ARTICLE_BUS.read_text()))
    of_scales = [each for each in check_file(bus).warnings if 'scale_pos' in each.key]
    drives = ', '.join(f'panda_joint{n}' for n in range(1, 8))
    assert [each.message.partition(': ')[0] for each in of_scales] == 2 * [drives]


def test_the_default_is_reported_where_the_drive_counts_otherwise(tmp_path: Path) -> None:
    """1.0 is 0.01 rad here, as with ros2_canopen; a scale that is written is doubted below 0.1.

    Where the EDS has no factor group an increment has no known size.
    """
    assert units_of(tmp_path, 'mandatory: false', eds=eds_text()).radians is None
    config = load_text(tmp_path, eds=EDS)
    assert len([each for each in check_bus(config).warnings if '0.01 rad' in each.message]) == 1
    for scale, is_doubted in ((20_000, False), (1000, True)):
        written = load_text(tmp_path, added(JOINT, f'scale_pos_to_dev: {scale}'), eds=EDS)
        found = [w.message for w in check_bus(written).warnings if 'factor group' in w.message]
        assert ['one of them is wrong' in message for message in found] == [True] * is_doubted


POSITIONS = 'scale_pos_to_dev: -57295.78\nscale_pos_from_dev: -1.745329e-5'
RATES = 'scale_vel_to_dev: 1000\nscale_vel_from_dev: 0.001'


IN_RPM = 'scale_vel_to_dev: -9.549\nscale_vel_from_dev: -0.10472'


def test_the_units_of_velocities_and_accelerations(tmp_path: Path) -> None:
    """By the ratio of the scales, where these have one of their own."""
    for piece, units in (
        ('mandatory: false', (1.0, 1.0)),
        (POSITIONS, (1.0, 1.0)),
        (f'{POSITIONS}\nscale_vel_to_dev: 57295.8\nscale_vel_from_dev: 1.745329e-5', (1.0, 1.0)),
        (f'{POSITIONS}\n{IN_RPM}', (6000.0, 6000.0)),
        (f'{POSITIONS}\n{IN_RPM}\nscale_acc_to_dev: 5729.58', (6000.0, 10.0)),
        (f'{POSITIONS}\nscale_acc_from_dev: 1.745329e-6', (1.0, 0.1)),
        ('scale_from_factor_group: true', (1.0, 1.0)),
    ):
        bus = load_text(tmp_path, added(JOINT, piece), eds=EDS)
        (node,) = bus.nodes
        assert rate_units(bus, node, node.drive) == pytest.approx(units, rel=1e-3), piece


TENTHS_OF_RPM = 'sdo: [{index: 0x60A9, value: 0x00B44700}, {index: 0x60AA, value: 0xFFC00300}]'


def test_what_one_is_of_accelerations(tmp_path: Path) -> None:
    """By bus.yml, by the drive, or assumed, with a warning beside a scale of velocities."""
    for piece, acceleration, by in (
        ('mandatory: false', 1000.0, ''),
        (f'{POSITIONS}\n{IN_RPM}', -9.549, ''),
        (f'{POSITIONS}\n{IN_RPM}\nscale_acc_to_dev: 95.49', 95.49, 'scale_acc_to_dev'),
        (f'{POSITIONS}\n{IN_RPM}\n{TENTHS_OF_RPM}', -95.49, '0x60A9, 0x60AA'),
        ('scale_from_factor_group: true', 100_000.0, ''),
    ):
        rows = (
            Row(0x60A9, 0, 'SI unit velocity', 7, 'rw', '0'),
            Row(0x60AA, 0, 'SI unit acceleration', 7, 'rw', '0'),
            Row(0x6083, 0, 'Profile acceleration', 7, 'rw', '3000'),
        )
        eds = eds_text((*DRIVE_ROWS, *FACTOR_ROWS, *rows))
        report = check_file(write_bus(tmp_path, added(JOINT, piece), eds=eds))
        (units,) = report.units
        assert units.acceleration == pytest.approx(acceleration, rel=1e-4), piece
        assert units.acceleration_by == by, piece
        assert units.motion[Index.PROFILE_ACCELERATION] == pytest.approx(
            3000.0 / abs(acceleration), rel=1e-4
        )
        found = [each for each in report.warnings if '1.0 per s2 is assumed' in each.message]
        assert len(found) == (not by and units.rule is not UnitRule.UPSTREAM), piece


BOTH = f'{POSITIONS}\n{RATES}\n'
LEFT = 'moves at 0.01745 where 1.0 is asked.* scale_vel_to_dev: -57295.8 .*joint: -9.549297'


def test_scales_and_offsets_that_move_something_else(tmp_path: Path) -> None:
    """Positions in rad beside velocities by 1000, a shown position that is no target, rounding.

    What is not said begins with an exclamation mark.
    """
    for piece, said in (
        (POSITIONS, LEFT),
        (BOTH, '!velocities the default'),  # written, and so meant
        (f'{POSITIONS}\nscale_vel_to_dev: 5\nscale_vel_from_dev: 0.2', '!velocities the default'),
        ('scale_pos_to_dev: 1000', '!velocities the default'),
        ('mandatory: false', '!velocities the default|do not cancel'),
        ('scale_from_factor_group: true', '!velocities the default'),
        (f'{BOTH}offset_pos_from_dev: 0.5', 'do not cancel.* offset_pos_to_dev: 28647.89'),
        (f'{BOTH}offset_pos_to_dev: 100', 'do not cancel.* offset_pos_to_dev: 0 '),
        (f'{BOTH}offset_pos_from_dev: 0.5\noffset_pos_to_dev: 28647.89', '!do not cancel'),
        (f'{BOTH}offset_pos_from_dev: 0.5\noffset_pos_to_dev: -28647.89', 'cancel.*: 28647.89'),
        ('scale_pos_to_dev: 0.0001\nscale_pos_from_dev: 10000', 'correct scale_pos_to_dev'),
        ('scale_vel_to_dev: 0.0001\nscale_vel_from_dev: 10000', 'correct scale_vel_to_dev'),
    ):
        report = check_file(write_bus(tmp_path, added(JOINT, piece), eds=EDS))
        pattern = said.removeprefix('!')
        found = [w for w in report.warnings if re.search(pattern, f'{w.message}; {w.remedy}')]
        assert len(found) == (pattern == said), piece
        assert all(warning.key.startswith('nodes.joint1.') for warning in found), piece


def check(mode: OperationMode, units: Units, target: float) -> None:
    """Check a target of a mode."""
    setpoint = 0.0 if mode is OperationMode.CYCLIC_POSITION else None
    kind = cast('Mode', SimpleNamespace(number=mode, setpoint=setpoint))
    check_target(JOINT, kind, DriveParameters(), units, target)


@pytest.mark.parametrize('offset', [0.0, 0.3])
@pytest.mark.parametrize(
    ('scale', 'target', 'increments'), [(1e-4, 20_000.0, 2), (0.9, 1.111, 1), (SCALE, 1e-5, 0)]
)
def test_a_position_within_the_tolerance_is_taken(
    scale: float, target: float, increments: int, offset: float
) -> None:
    """Also by a coarse scale, and a part of an increment of a fine one; offsets count."""
    units = Units(DriveConfig(scale_pos_to_dev=scale, offset_pos_to_dev=offset))
    check(OperationMode.CYCLIC_POSITION, units, target - offset / scale)
    assert units.position.to_device(target - offset / scale) == increments


@pytest.mark.parametrize('mode', [OperationMode.PROFILE_VELOCITY, OperationMode.CYCLIC_TORQUE])
def test_a_rate_is_refused_only_where_it_would_become_0(mode: OperationMode) -> None:
    """Velocities and torques are rounded, whatever their scale."""
    for scale, target, taken in (
        (0.3, 5.1, True),  # 1.53 device units; a whole number is not the target
        (0.3, -1.7, True),
        (0.3, 1.6, False),
        (0.3, -1.6, False),
        (0.3, 0.0, True),
        (1.0, 0.4, False),
        (100.0, 0.004, False),
        (100.0, 0.0006, True),  # of a stream that fades
    ):
        units = Units(DriveConfig(scale_vel_to_dev=scale, scale_eff_to_dev=scale))
        refused = pytest.raises(DriveError, match='would become 0')
        with nullcontext() if taken else refused:
            check(mode, units, target)
