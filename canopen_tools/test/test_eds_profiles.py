# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Objects from 0x6000 on by the profile that a device follows, and files in other encodings."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from config_samples import DRIVE_ROWS, eds_text, Row
from device_rig import Rig
import pytest

from arm_canopen.config import load_eds
from arm_canopen.config.findings import Findings
from arm_canopen.config.resolve.sdo_list import parameter_writes
from arm_canopen.standard import is_drive
from canopen_tools import EdsReport, lint_eds

COMMON_ROWS = tuple(
    replace(row, default='5') if 0x1400 <= row.index < 0x1600 and not row.subindex else row
    for row in DRIVE_ROWS
    if row.index < 0x6000 and row.index != 0x1000
)
OTHER_MEANINGS = (  # numbers that CiA 402 has, with types that it does not have
    Row(0x6040, 0, 'Something else', 7, 'ro', '0'),
    Row(0x6041, 0, 'Something else', 5, 'rw', '0'),
    Row(0x6060, 0, 'Something else', 7, 'ro', '0'),
    Row(0x607A, 0, 'Something else', 7, 'ro', '0'),
)


def rows(device_type: str, *profile: Row) -> tuple[Row, ...]:
    """Return the rows of a device with this 0x1000."""
    return (Row(0x1000, 0, 'Device type', 7, 'ro', device_type), *COMMON_ROWS, *profile)


def lint(folder: Path, *entries: Row) -> EdsReport:
    """Look at an EDS of these rows."""
    path = folder / 'device.eds'
    path.write_text(eds_text(entries), encoding='utf-8')
    return lint_eds(path)


@pytest.mark.parametrize('device_type', ['0x000F0191', '0x00020196', '0x00000195'])
def test_other_profiles_are_not_judged_by_that_of_drives(tmp_path: Path, device_type: str) -> None:
    """CiA 401, 406 and one that is not known here."""
    report = lint(tmp_path, *rows(device_type, *OTHER_MEANINGS))
    assert report.errors == report.warnings == ()


@pytest.mark.parametrize('device_type', ['0x00020192', '0xFFFF0192', ''])
def test_drives_are_judged_by_theirs(tmp_path: Path, device_type: str) -> None:
    """Also one with several axes, and one whose EDS does not say what it is."""
    report = lint(tmp_path, *rows(device_type, *OTHER_MEANINGS))
    assert len(report.errors) == 4


@pytest.mark.parametrize(
    ('device_type', 'row'),
    [
        ('0x000F0191', Row(0x6401, 1, 'Analogue input', 7, 'ro', '0', mappable=True)),
        ('0x000F0191', Row(0x6200, 1, 'Digital output', 6, 'rww', '0', mappable=True)),
        ('0x00020196', Row(0x6004, 0, 'Position value', 3, 'ro', '0', mappable=True)),
    ],
)
def test_each_profile_has_its_rules(tmp_path: Path, device_type: str, row: Row) -> None:
    """A wrong data type is an error there, too; what another profile has at the place is not."""
    head = [Row(row.index, 0, 'Count', 5, 'const', '1')] if row.subindex else []
    (error,) = lint(tmp_path, *rows(device_type, *head, row)).errors
    assert f'{row.index:04X}' in error.key
    assert lint(tmp_path, *rows('0x00000195', *head, row)).errors == ()


def test_no_drive_is_simulated_where_there_is_none(tmp_path: Path) -> None:
    """fake_slaves makes a plain device of an encoder that has something at 0x6040."""
    lint(tmp_path, *rows('0x00020196', *OTHER_MEANINGS))
    dictionary = load_eds(tmp_path / 'device.eds').dictionary
    assert not is_drive(dictionary)
    assert Rig(dictionary).device.drive is None


def test_a_value_at_the_place_of_a_command_is_written(tmp_path: Path) -> None:
    """The ParameterValue of 0x6060 of an I/O module is no command."""
    row = Row(0x6060, 0, 'Polarity', 5, 'rw', '0')
    text = eds_text(rows('0x000F0191', row))
    path = tmp_path / 'module.dcf'
    place = text.index('[6060]')
    value = text.index('DefaultValue=0', place)
    path.write_text(f'{text[:value]}ParameterValue=3\n{text[value:]}', encoding='utf-8')
    findings = Findings()
    (write,) = parameter_writes(load_eds(path), findings)
    assert (write.index, write.data) == (0x6060, b'\x03')
    assert findings.warnings == ()


@pytest.mark.parametrize(
    'encoding', ['latin-1', 'cp1252', 'utf-8-sig', 'utf-16', 'utf-16-le', 'utf-16-be']
)
def test_files_in_other_encodings_are_read(tmp_path: Path, encoding: str) -> None:
    """As editors on Windows save them; names keep their umlauts."""
    text = eds_text().replace('Sample drive', 'Pr\u00fcfger\u00e4t')
    path = tmp_path / 'device.eds'
    path.write_bytes(text.encode(encoding))
    plain = tmp_path / 'plain.eds'
    plain.write_text(text, encoding='utf-8')
    assert list(load_eds(path).dictionary) == list(load_eds(plain).dictionary)
    assert len(lint_eds(path).errors) == len(lint_eds(plain).errors)
