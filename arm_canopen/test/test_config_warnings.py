# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What is taken, but reported: unused keys, units that do not fit, PDOs without SYNC."""

from __future__ import annotations

from pathlib import Path
import re

from config_cases import added
from config_samples import BUS, eds_text, errors_of, load_text, TWO_AXES_EDS, write_bus
import pytest


@pytest.mark.parametrize(
    ('section', 'piece', 'key', 'message'),
    [
        ('joint1', 'period: 20', 'period', 'every 10 ms, not every 20 ms'),
        ('joint1', 'package: wrong', 'package', "is in the package 'canopen_402_driver'"),
        ('joint1', 'scale_pos_to_dev: 57.3', 'scale_pos_to_dev', 'is 0.0573, not 1'),
        ('joint1', 'scale_vel_from_dev: 2', 'scale_vel_from_dev', 'is 2000, not 1'),
        ('joint1', 'scale_eff_from_dev: 0.001', 'scale_eff_from_dev', 'is 0.001, not 1'),
        ('master', 'vendor_id: 0x360', 'vendor_id', 'known, not used yet'),
        ('master', 'error_behavior: {1: 1}', 'error_behavior', 'known, not used yet'),
    ],
)
def test_reported_with_line_and_key(
    tmp_path: Path, section: str, piece: str, key: str, message: str
) -> None:
    """One warning at the key, which says what happens instead, and a remedy."""
    text = added(section, piece)
    (warning,) = load_text(tmp_path, text).warnings
    prefix = 'nodes.joint1' if section == 'joint1' else section
    assert warning.key == f'{prefix}.{key}'
    assert text.splitlines()[warning.line - 1].strip() == piece
    assert message in warning.message
    assert warning.remedy


def test_a_drive_whose_eds_names_another_profile_is_reported(tmp_path: Path) -> None:
    """The driver of bus.yml counts, and the simulator, which has the EDS alone, has no drive."""
    eds = eds_text().replace('0x00020192', '0x00020191')
    (warning,) = (w for w in load_text(tmp_path, eds=eds).warnings if 'profile 401' in w.message)
    assert warning.key == 'defaults.driver'
    assert '0x1000' in warning.remedy


def test_scales_of_a_channel_are_checked_as_those_of_a_device(tmp_path: Path) -> None:
    """Against what counts for its axis, its own and its device's."""
    text = added('joint1', 'num_channels: 2\nchannels: [{scale_pos_to_dev: 57.3}, {}]')
    warnings = load_text(tmp_path, text, eds=TWO_AXES_EDS.read_text()).warnings
    (warning,) = (warning for warning in warnings if 'scale' in warning.message)
    assert 'is 0.0573, not 1' in warning.message
    assert warning.key.endswith('scale_pos_to_dev')


@pytest.mark.parametrize(
    ('section', 'piece'),
    [
        ('joint1', 'polling: true'),
        ('joint1', 'period: 10'),
        ('joint1', 'non_transmit_timeout: 100'),
        ('joint1', 'diagnostics: {enable: true, period: 1000}'),
        ('joint1', 'enable_lazy_load: false'),
        ('joint1', 'num_channels: 1'),
        ('joint1', 'guard_time: 0'),
        ('joint1', 'boot: true'),
        ('joint1', 'software_file: ""'),
        ('joint1', 'restore_configuration: 0'),
        ('joint1', 'retry_factor: 3'),
        ('joint1', 'revision_number: 0'),
        ('master', 'vendor_id: 0'),
        ('master', 'start: true'),
        ('master', 'boot_time: 0'),
    ],
)
def test_what_requests_nothing_is_no_warning(tmp_path: Path, section: str, piece: str) -> None:
    """Keys whose request is met anyway, or that say the default, are taken silently."""
    assert load_text(tmp_path, added(section, piece)).warnings == ()


def test_a_pdo_that_waits_for_sync(tmp_path: Path) -> None:
    """Synchronous PDOs on a bus without SYNC would never be sent."""
    text = added('joint1', 'tpdo: {1: {transmission: 1}}')
    (warning,) = load_text(tmp_path, text.replace('  sync_period: 10000\n', '')).warnings
    assert 'TPDO 1 of joint1 waits for SYNC' in warning.message


def test_a_drive_without_control_word(tmp_path: Path) -> None:
    """A drive whose controlword or statusword no PDO carries cannot be run in the cycle."""
    text = added('joint1', 'rpdo: {1: {enabled: false}}\ntpdo: {1: {enabled: false}}')
    messages = [warning.message for warning in load_text(tmp_path, text).warnings]
    assert [re.findall('0x60..', message) for message in messages] == [['0x6040'], ['0x6041']]


def test_identifiers_of_an_eds_without_node_id(tmp_path: Path) -> None:
    """Each device has those of its own node id, which is said and compared at boot."""
    lines = '\n'.join(with_default_mapping('0x60640020'))
    text = f'{BUS}  joint2: {{node_id: 3}}\n'
    for literal, dcf in (('0x285', ''), ('0x280', ''), ('0x285', COMMISSIONED)):
        eds = lines.replace('$NODEID+0x280', literal) + dcf
        bus = load_text(tmp_path, text, eds=eds)
        assert [node.tpdos[1].cob_id for node in bus.nodes] == [0x282, 0x283]
        assert [node.tpdos[1].assumed for node in bus.nodes] == [True, True]
        for warning, node in zip(bus.warnings, bus.nodes, strict=True):
            assert f'COB-ID {literal} of TPDO 2 of {node.name} is not that of' in warning.message
            assert f'taken to have 0x{0x280 + node.node_id:03X}' in warning.message
            assert 'cob_id: auto' in warning.remedy


def test_identifiers_that_a_dcf_means_are_kept(tmp_path: Path) -> None:
    """Those of a device that listens to another one."""
    eds = eds_text().replace('$NODEID+0x300', '0x305') + COMMISSIONED.replace('5', '2')
    assert load_text(tmp_path, eds=eds).nodes[0].rpdos[1].cob_id == 0x305


def test_two_rpdos_of_an_eds_with_one_identifier_are_an_error(tmp_path: Path) -> None:
    """One frame would move two axes, whoever wrote it."""
    lines = '\n'.join(with_default_mapping('0x607A0020', index='1601'))
    path = write_bus(
        tmp_path, f'{BUS}  joint2: {{node_id: 3}}\n', eds=lines.replace('$NODEID+0x300', '0x6A0')
    )
    (error,) = errors_of(path)
    assert 'COB-ID 0x6A0 of RPDO 2 of joint2 is also that of RPDO 2 of joint1' in error.message
    assert 'cob_id: auto' in error.remedy


COMMISSIONED = '\n[DeviceComissioning]\nNodeID=5\n'


def with_default_mapping(*words: str, index: str = '1A01') -> list[str]:
    """Return the lines of the EDS with another default mapping of TPDO 2, or another object."""
    lines = eds_text().splitlines()
    start = lines.index(f'[{index}sub0]')
    for offset, value in enumerate((str(len(words)), *words)):
        section = lines.index(f'[{index}sub{offset}]', start)
        place = next(i for i in range(section, len(lines)) if lines[i].startswith('DefaultValue'))
        lines[place] = f'DefaultValue={value}'
    return lines


def test_mappings_that_the_eds_does_not_know(tmp_path: Path) -> None:
    """An enabled PDO whose default mapping names unknown objects is reported at its EDS line."""
    lines = with_default_mapping('0x70000020')
    bus = load_text(tmp_path, eds='\n'.join(lines))
    (warning,) = bus.warnings
    assert warning.file.name == 'drive.eds'
    assert warning.line == lines.index('[1A01sub1]') + 1
    assert 'maps 0x7000:00, which is not there; taken as UNSIGNED32' in warning.message
    assert bus.nodes[0].tpdos[1].mapping[0].word == 0x7000_0020


def test_a_flag_in_the_length_of_mapped_objects_is_ignored(tmp_path: Path) -> None:
    """Bit 7 of it belongs to the vendor; that is reported once."""
    lines = with_default_mapping('0x60410090', '0x606400A0')
    bus = load_text(tmp_path, eds='\n'.join(lines))
    (warning,) = bus.warnings
    assert 'bit 7 of the length is set in 0x60410090' in warning.message
    assert [mapped.word for mapped in bus.nodes[0].tpdos[1].mapping] == [0x6041_0010, 0x6064_0020]


def test_warnings_of_an_eds_are_reported_once(tmp_path: Path) -> None:
    """Devices that share an odd EDS share its warnings."""
    text = f'{BUS}  joint2: {{node_id: 3}}\n'
    eds = eds_text().replace('DefaultValue=1.5', 'DefaultValue=one')
    (warning,) = load_text(tmp_path, text, eds=eds).warnings
    assert warning.file.name == 'drive.eds'
    assert "could not convert string to float: 'one'; ignored" in warning.message
