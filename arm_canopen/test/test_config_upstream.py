# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What users of ros2_canopen write, and what the EDS files of vendors leave out."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from config_cases import added
from config_samples import BUS, errors_of, load_text, TWO_AXES_EDS, write_bus
import pytest
from virtual_network import bus_config, drive_config, drive_dictionary, VirtualNetwork

from arm_canopen.config.checks import check_file
from arm_canopen.exceptions import DriveError
from arm_canopen.master.events import Severity
from arm_canopen.standard.dictionary import ObjectDictionary
from arm_canopen.standard.drive import DriveState, OperationMode

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


def without_default(*indices: int) -> ObjectDictionary:
    """Return the drive's dictionary as a vendor writes it: objects without defaults."""
    return ObjectDictionary(
        replace(entry, default=None) if entry.index in indices else entry
        for entry in drive_dictionary().for_node(2)
    )


def booted(dictionary: ObjectDictionary, **changes: object) -> VirtualNetwork:
    """Boot a drive that has this dictionary."""
    config = replace(drive_config(JOINT, 2), dictionary=dictionary, **changes)  # type: ignore[arg-type]
    net = VirtualNetwork(bus_config(config))
    net.boot()
    return net


def test_a_simulated_drive_has_the_modes_that_its_objects_allow() -> None:
    """0x6502 of EPOS, Kollmorgen and Elmo has no default; the drive is of use all the same."""
    net = booted(without_default(0x6502))
    told = net.drives[JOINT].parameters.supported_modes
    wanted = (OperationMode.PROFILE_POSITION, OperationMode.HOMING, OperationMode.CYCLIC_TORQUE)
    assert told
    assert all(told & mode.support_bit for mode in wanted)
    net.do(JOINT, 'init')
    net.select(JOINT, OperationMode.PROFILE_POSITION)
    net.commands[JOINT].set_target(0.3)
    net.run(5.0)
    assert net.drives[JOINT].position == pytest.approx(0.3, abs=1e-3)


def test_it_has_no_mode_whose_object_is_missing() -> None:
    """Without 0x6071 there is no torque mode, and without 0x6042 no velocity mode."""
    dictionary = ObjectDictionary(
        entry for entry in without_default(0x6502) if entry.index not in (0x6071, 0x6042)
    )
    told = booted(dictionary).drives[JOINT].parameters.supported_modes
    assert told
    missing = (OperationMode.PROFILE_TORQUE, OperationMode.CYCLIC_TORQUE, OperationMode.VELOCITY)
    assert not any(told & mode.support_bit for mode in missing)
    assert told & OperationMode.PROFILE_VELOCITY.support_bit


def unmapped() -> VirtualNetwork:
    """Boot a drive whose RPDOs carry controlword and mode only."""
    config = drive_config(JOINT, 2)
    net = VirtualNetwork(bus_config(replace(config, rpdos=config.rpdos[:1])))
    net.boot()
    net.do(JOINT, 'init')
    return net


def test_a_target_without_an_rpdo_goes_by_sdo() -> None:
    """As with ros2_canopen; each target is reached, and no edge comes before its value."""
    net = unmapped()
    net.select(JOINT, OperationMode.PROFILE_POSITION)
    for target in (0.5, -0.2, 0.9):
        net.commands[JOINT].set_target(target)
        net.run(5.0)
        assert net.drives[JOINT].position == pytest.approx(target, abs=1e-3)
    assert net.told(Severity.WARNING) == []


def test_a_velocity_without_an_rpdo_goes_by_sdo() -> None:
    """And so does the standstill that ends it."""
    net = unmapped()
    net.select(JOINT, OperationMode.PROFILE_VELOCITY)
    net.commands[JOINT].set_target(0.4)
    net.run(1.0)
    assert net.drives[JOINT].rate == pytest.approx(0.4, abs=0.02)
    net.do(JOINT, 'halt')
    net.run(1.0)
    assert net.drives[JOINT].rate == pytest.approx(0.0, abs=0.01)


def test_an_idle_drive_fills_no_bus_with_its_targets() -> None:
    """Enabled and at rest, nothing is written by SDO."""
    net = unmapped()
    net.select(JOINT, OperationMode.PROFILE_POSITION)
    net.run(0.5)
    begin = net.now
    net.run(2.0)
    assert net.frames(0x602, since=begin) == []


def test_a_stream_needs_its_rpdo() -> None:
    """A target in every cycle does not go by SDO; the object to be mapped is named."""
    with pytest.raises(DriveError, match='0x607A is in no RPDO'):
        unmapped().select(JOINT, OperationMode.CYCLIC_POSITION)


@pytest.mark.parametrize(
    ('mode', 'message'), [(1, 'go by SDO'), (8, 'cannot be used'), (3, 'go by SDO')]
)
def test_check_says_how_a_target_goes(tmp_path: Path, mode: int, message: str) -> None:
    """A warning at the key of the mode."""
    key = 'velocity_mode' if mode == 3 else 'position_mode'
    report = check_file(write_bus(tmp_path, added(JOINT, f'{key}: {mode}')))
    found = [w for w in report.warnings if w.key.endswith(key) and message in w.message]
    assert len(found) == 1
