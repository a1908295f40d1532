# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What users of ros2_canopen write, and what the EDS files of vendors leave out."""

from __future__ import annotations

from pathlib import Path

from config_cases import added
from config_samples import BUS, errors_of, load_text, TWO_AXES_EDS, write_bus
import pytest

from arm_canopen import DriveState
from arm_canopen.config import check_file

JOINT = 'joint1'


def test_eds_is_taken_for_dcf(tmp_path: Path) -> None:
    """With a warning; a device's own beats that of the defaults, whatever either is called."""
    config = load_text(tmp_path, BUS.replace('dcf: drive.eds', 'eds: drive.eds'))
    assert config.nodes[0].eds.name == 'drive.eds'
    assert [warning.key for warning in config.warnings] == ['defaults.eds']
    (tmp_path / 'own.eds').write_text((tmp_path / 'drive.eds').read_text())
    assert load_text(tmp_path, added(JOINT, 'eds: own.eds')).nodes[0].eds.name == 'own.eds'


def test_eds_and_dcf_in_one_place_are_refused(tmp_path: Path) -> None:
    """Nobody knows which one is meant."""
    text = added(JOINT, 'eds: drive.eds\ndcf: drive.eds')
    assert [error.key for error in errors_of(write_bus(tmp_path, text))] == ['nodes.joint1.eds']


@pytest.mark.parametrize(
    ('old', 'new', 'remedy'),
    [
        ('Cia402Driver', 'CanopenDriver', 'ProxyDriver'),
        ('Cia402Driver', 'CanopenDriver', 'Cia402Driver'),
        ('MasterDriver', 'CanopenMaster', 'MasterDriver'),
    ],
)
def test_base_classes_get_the_right_hint(tmp_path: Path, old: str, new: str, remedy: str) -> None:
    """They are in the API documentation of ros2_canopen, and are no drivers."""
    errors = errors_of(write_bus(tmp_path, BUS.replace(f'::{old}', f'::{new}')))
    assert 'base class' in errors[0].remedy
    assert f"'ros2_canopen::{remedy}'" in errors[0].remedy


def test_the_switching_state_of_the_multichannel_sample(tmp_path: Path) -> None:
    """8 is Fault; the sample means Operation enabled."""
    config = load_text(tmp_path, added(JOINT, 'switching_state: 8'))
    assert config.nodes[0].drive.switching_state is DriveState.OPERATION_ENABLED
    assert [warning.key for warning in config.warnings] == ['nodes.joint1.switching_state']


def test_each_axis_needs_its_controlword(tmp_path: Path) -> None:
    """The second axis of a device is looked at as the first one is."""
    text = added(JOINT, 'num_channels: 2')
    warnings = load_text(tmp_path, text, eds=TWO_AXES_EDS.read_text()).warnings
    found = [warning.message for warning in warnings if 'in the cycle' in warning.message]
    assert ['0x6840' in found[0], '0x6841' in found[1]] == [True, True]
    assert all('joint1_1' in message for message in found)


@pytest.mark.parametrize(
    ('mode', 'message'), [(1, 'go by SDO'), (8, 'cannot be used'), (3, 'go by SDO')]
)
def test_check_says_how_a_target_goes(tmp_path: Path, mode: int, message: str) -> None:
    """A warning at the key of the mode."""
    key = 'velocity_mode' if mode == 3 else 'position_mode'
    report = check_file(write_bus(tmp_path, added(JOINT, f'{key}: {mode}')))
    found = [w for w in report.warnings if w.key.endswith(key) and message in w.message]
    assert len(found) == 1
