# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Drives whose EDS leaves something out, or that have none, and PDOs that lack something."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
import re

from bus_rig import VirtualNetwork
from drive_samples import bus_config, drive_config, drive_dictionary, DRIVE_EDS
import pytest

from arm_canopen import DriveError, OperationMode, Severity
from arm_canopen.config import load_bus, load_eds
from arm_canopen.config.model.boot_plan import BootWrite
from arm_canopen.config.resolve.eds_files import DEFAULT_DRIVE
from arm_canopen.standard import ObjectDictionary

pytestmark = pytest.mark.slow

JOINT = 'joint1'


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
    reported = net.drives[JOINT].view.parameters.supported_modes
    wanted = (OperationMode.PROFILE_POSITION, OperationMode.HOMING, OperationMode.CYCLIC_TORQUE)
    assert reported
    assert all(reported & mode.support_bit for mode in wanted)
    net.enable(OperationMode.PROFILE_POSITION)
    net.target(0.3)
    net.run(5.0)
    assert net.drives[JOINT].view.position == pytest.approx(0.3, abs=1e-3)


def test_it_has_no_mode_whose_object_is_missing() -> None:
    """Without 0x6071 there is no torque mode, and without 0x6042 no velocity mode."""
    dictionary = ObjectDictionary(
        entry for entry in without_default(0x6502) if entry.index not in (0x6071, 0x6042)
    )
    reported = booted(dictionary).drives[JOINT].view.parameters.supported_modes
    assert reported
    missing = (OperationMode.PROFILE_TORQUE, OperationMode.CYCLIC_TORQUE, OperationMode.VELOCITY)
    assert not any(reported & mode.support_bit for mode in missing)
    assert reported & OperationMode.PROFILE_VELOCITY.support_bit


def test_default_mappings_whose_lengths_have_a_flag_of_the_vendor_are_used(
    tmp_path: Path,
) -> None:
    """Bit 7 of the length in 0x1600 and 0x1A00 is ignored: by boot, PDOs and the comparison."""

    def flagged(match: re.Match[str]) -> str:
        return f'DefaultValue={match[1]}{int(match[2], 16) | 0x80:02X}'

    pattern = re.compile(r'DefaultValue=(0x60[0-9A-F]{4})(08|10|20)$', re.MULTILINE)
    eds, count = pattern.subn(flagged, DRIVE_EDS.read_text())
    assert count > 10
    (tmp_path / 'drive.eds').write_text(eds)
    (tmp_path / 'bus.yml').write_text(
        'master: {node_id: 1, driver: "ros2_canopen::MasterDriver", sync_period: 10000}\n'
        'joint1: {node_id: 2, driver: "ros2_canopen::Cia402Driver", dcf: drive.eds,\n'
        '  tpdo: {2: {transmission: 1}, 3: {transmission: 1}}, rpdo: {2: {enabled: true}, '
        '3: {enabled: true}}}\n'
    )
    bus = load_bus(tmp_path / 'bus.yml')
    net = VirtualNetwork(bus)
    net.boot()
    net.enable(OperationMode.PROFILE_POSITION)
    net.target(0.3)
    net.run(5.0)
    assert net.drives[JOINT].view.position == pytest.approx(0.3, abs=2e-3)
    held = net.result(net.network.nodes[JOINT].sdo.read(0x1A01, 1, 1.0))
    assert BootWrite(0x1A01, 1, b'\x10\x00\x41\x60', 'tpdo').fits(held)


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
        net.target(target)
        net.run(5.0)
        assert net.drives[JOINT].view.position == pytest.approx(target, abs=1e-3)
    assert net.reported(Severity.WARNING) == []


def test_a_velocity_without_an_rpdo_goes_by_sdo() -> None:
    """And so does the standstill that ends it."""
    net = unmapped()
    net.select(JOINT, OperationMode.PROFILE_VELOCITY)
    net.target(0.4)
    net.run(1.0)
    assert net.drives[JOINT].view.rate == pytest.approx(0.4, abs=0.02)
    net.do(JOINT, 'halt')
    net.run(1.0)
    assert net.drives[JOINT].view.rate == pytest.approx(0.0, abs=0.01)


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


@pytest.mark.parametrize('period', [0.02, 0.05, 0.2])
def test_a_position_without_a_tpdo_is_read_once_a_period(period: float) -> None:
    """As often as `period` of the device says, by SDO."""
    config = drive_config(JOINT, 2)
    config = replace(config, tpdos=config.tpdos[:1], poll_period=period)
    net = VirtualNetwork(bus_config(config))
    net.boot()
    begin = net.now
    net.run(2.0)
    requests = [data[:3] for data in net.frames(0x602, since=begin)]
    assert requests.count(b'\x40\x64\x60') == pytest.approx(2.0 / period, rel=0.1)


def test_a_drive_moves_by_the_default_dictionary() -> None:
    """The simulated drive, whose own EDS nobody has read, is booted, enabled and moved."""
    general = load_eds(DEFAULT_DRIVE).dictionary
    config = replace(drive_config('a', 2), dictionary=general.for_node(2), sdo_writes=())
    net = VirtualNetwork(bus_config(config), dictionaries={'a': drive_dictionary().for_node(2)})
    net.boot()
    net.enable(OperationMode.PROFILE_POSITION, 'a')
    net.commands['a'].set_target(0.5)
    net.run(10.0)
    assert net.drives['a'].view.position == pytest.approx(0.5, abs=1e-3)
    assert net.reported(Severity.ERROR) == []
