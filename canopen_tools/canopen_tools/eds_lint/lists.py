# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Checks of the head of an EDS and of its lists of objects (CiA 306-1, 4.5)."""

from __future__ import annotations

from pathlib import Path

from arm_canopen.config.findings import Findings, Place
from arm_canopen.config.model.pdo_direction import Direction, RPDO, TPDO
from arm_canopen.config.read.eds_ini import IniFile, IniSection
from arm_canopen.config.read.eds_values import parse_integer
from arm_canopen.standard import BIT_RATES_KBIT, Index, object_address, ObjectDictionary

MANDATORY_INDICES = (Index.DEVICE_TYPE, Index.ERROR_REGISTER, Index.IDENTITY)
MANUFACTURER = range(0x2000, 0x6000)  # CiA 301, table 40
LISTS = {
    'mandatoryobjects': 'MandatoryObjects',
    'optionalobjects': 'OptionalObjects',
    'manufacturerobjects': 'ManufacturerObjects',
}
PDO_COUNTS: tuple[tuple[str, str, Direction], ...] = (
    ('nrofrxpdo', 'NrOfRXPDO', RPDO),
    ('nroftxpdo', 'NrOfTXPDO', TPDO),
)
IDENTITY_KEYS = (
    ('vendornumber', 'VendorNumber', 1),
    ('productnumber', 'ProductNumber', 2),
)


def check_info(path: Path, ini: IniFile, dictionary: ObjectDictionary, findings: Findings) -> None:
    """Check the sections FileInfo and DeviceInfo."""
    for name, title in (('fileinfo', 'FileInfo'), ('deviceinfo', 'DeviceInfo')):
        if name not in ini.sections:
            findings.warning(Place(path), f'no section [{title}]', 'add it')
    info = ini.sections.get('deviceinfo')
    if info is None:
        return
    for key, title, direction in PDO_COUNTS:
        count, number = _number(info, key), len(direction.numbers(dictionary))
        if count is not None and count != number:
            findings.warning(
                Place(path, info.line_of(key), key='[DeviceInfo]'),
                f'{title} is {count}, but there are {number} {direction.title}s',
                f'write {title}={number}',
            )
    for key, title, subindex in IDENTITY_KEYS:
        named, default = _number(info, key), dictionary.number(Index.IDENTITY, subindex)
        if named and default and named != default:
            findings.warning(
                Place(path, info.line_of(key), key='[DeviceInfo]'),
                f'{title} is 0x{named:X}, but 0x1018:{subindex:02X} has 0x{default:X} as default; '
                'the latter is checked at boot',
                'correct the wrong one of them',
            )
    rates = [_number(info, f'baudrate_{rate}') for rate in BIT_RATES_KBIT]
    if any(rate is not None for rate in rates) and not any(rates):
        findings.warning(
            Place(path, info.line, '[DeviceInfo]'),
            'the device supports no bit rate',
            'write BaudRate_1000=1 and so on for those that it has',
        )


def check_lists(path: Path, ini: IniFile, findings: Findings) -> None:
    """Check that each object is in the list that it belongs to, and in one only."""
    seen: dict[int, str] = {}
    for name, title in LISTS.items():
        section = ini.sections.get(name)
        if section is None:
            if name == 'mandatoryobjects':
                findings.warning(Place(path), f'no section [{title}]', 'add it')
            continue
        for key, value in section.values.items():
            if key == 'supportedobjects':
                continue
            index = _number(section, key)
            if index is None:
                continue
            place = Place(path, value.line, f'[{title}]')
            if index in seen:
                findings.warning(
                    place,
                    f'{object_address(index)} is listed a second time, first in [{seen[index]}]',
                    'remove it',
                )
            elif proper_list(index) != title:
                findings.warning(
                    place,
                    f'{object_address(index)} does not belong here',
                    f'move it to [{proper_list(index)}]',
                )
            seen.setdefault(index, title)


def proper_list(index: int) -> str:
    """Return the title of the list that an object belongs to."""
    if index in MANDATORY_INDICES:
        return LISTS['mandatoryobjects']
    return LISTS['manufacturerobjects' if index in MANUFACTURER else 'optionalobjects']


def _number(section: IniSection, key: str) -> int | None:
    """Return a number, None when there is none or reading has complained already."""
    try:
        return parse_integer(section.text(key))
    except ValueError:
        return None
