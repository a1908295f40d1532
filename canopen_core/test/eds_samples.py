# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Texts of EDS files that tests start from."""

from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True)
class Row:
    """One sub-index of a sample EDS."""

    index: int
    subindex: int
    name: str
    data_type: int
    access: str = 'rw'
    default: str = ''
    mappable: bool = False
    low: str = ''
    high: str = ''


def _pdo_rows(communication: int, mapping: int, base: int, count: int) -> Iterable[Row]:
    for number in range(count):
        offset = 0x100 * number + base if number < 4 else 0x8000_0000
        node = '$NODEID+' if number < 4 else ''
        invalid = 0x8000_0000 if number >= 2 else 0
        index = communication + number
        yield Row(index, 0, 'Highest sub-index', 5, 'const', '6')
        yield Row(index, 1, 'COB-ID', 7, 'rw', f'{node}0x{offset | invalid:X}')
        yield Row(index, 2, 'Transmission type', 5, 'rw', '255')
        if communication == 0x1800:
            yield Row(index, 3, 'Inhibit time', 6, 'rw', '0')
            yield Row(index, 6, 'SYNC start value', 5, 'rw', '0')
        yield Row(index, 5, 'Event timer', 6, 'rw', '0')
        yield Row(mapping + number, 0, 'Number of objects', 5, 'rw', '0')
        for slot in range(1, 9):
            yield Row(mapping + number, slot, f'Object {slot}', 7, 'rw', '0')


DRIVE_ROWS: tuple[Row, ...] = (
    Row(0x1000, 0, 'Device type', 7, 'ro', '0x00020192'),
    Row(0x1001, 0, 'Error register', 5, 'ro', '0', mappable=True),
    Row(0x1008, 0, 'Manufacturer device name', 9, 'const', 'Sample; drive'),
    Row(0x1016, 0, 'Highest sub-index', 5, 'const', '1'),
    Row(0x1016, 1, 'Consumer heartbeat time', 7, 'rw', '0'),
    Row(0x1017, 0, 'Producer heartbeat time', 6, 'rw', '0'),
    Row(0x1018, 0, 'Highest sub-index', 5, 'const', '4'),
    Row(0x1018, 1, 'Vendor-ID', 7, 'ro', '0x555'),
    Row(0x1018, 2, 'Product code', 7, 'ro', '7'),
    Row(0x1018, 3, 'Revision number', 7, 'ro', '0x10001'),
    Row(0x1018, 4, 'Serial number', 7, 'ro', '0x1234'),
    Row(0x1029, 0, 'Highest sub-index', 5, 'const', '1'),
    Row(0x1029, 1, 'Communication error', 5, 'rw', '0'),
    *_pdo_rows(0x1400, 0x1600, 0x200, 6),
    *_pdo_rows(0x1800, 0x1A00, 0x180, 6),
    Row(0x2000, 0, 'Gain', 8, 'rw', '1.5', low='0', high='10'),
    Row(0x2001, 0, 'Label', 9, 'rw', 'none'),
    Row(0x2002, 0, 'Blob', 0xF, 'rw'),
    Row(0x2003, 0, 'Flag', 1, 'rw', '0', mappable=True),
    Row(0x2004, 0, 'Long', 0x1B, 'rw', '0', mappable=True),
    Row(0x603F, 0, 'Error code', 6, 'ro', '0', mappable=True),
    Row(0x6040, 0, 'Controlword', 6, 'rww', '0', mappable=True),
    Row(0x6041, 0, 'Statusword', 6, 'ro', '0', mappable=True),
    Row(0x6060, 0, 'Modes of operation', 2, 'rww', '0', mappable=True),
    Row(0x6061, 0, 'Modes of operation display', 2, 'ro', '0', mappable=True),
    Row(0x6064, 0, 'Position actual value', 4, 'ro', '0', mappable=True),
    Row(0x606C, 0, 'Velocity actual value', 4, 'ro', '0', mappable=True),
    Row(0x607A, 0, 'Target position', 4, 'rww', '0', mappable=True),
    Row(0x6081, 0, 'Profile velocity', 7, 'rw', '1000', mappable=True, high='50000'),
    Row(0x6083, 0, 'Profile acceleration', 7, 'rw', '1000'),
    Row(0x6084, 0, 'Profile deceleration', 7, 'rw', '1000'),
    Row(0x6085, 0, 'Quick stop deceleration', 7, 'rw', '1000'),
    Row(0x6098, 0, 'Homing method', 2, 'rw', '0'),
    Row(0x60C2, 0, 'Highest sub-index', 5, 'const', '2'),
    Row(0x60C2, 1, 'Interpolation time period value', 5, 'rw', '1'),
    Row(0x60C2, 2, 'Interpolation time index', 2, 'rw', '-3', low='-128', high='63'),
    Row(0x60FF, 0, 'Target velocity', 4, 'rww', '0', mappable=True),
)
FACTOR_ROWS: tuple[Row, ...] = (
    Row(0x608F, 0, 'Highest sub-index', 5, 'const', '2'),
    Row(0x608F, 1, 'Encoder increments', 7, 'rw', '4096'),
    Row(0x608F, 2, 'Motor revolutions', 7, 'rw', '1'),
    Row(0x6092, 0, 'Highest sub-index', 5, 'const', '2'),
    Row(0x6092, 1, 'Feed', 7, 'rw', '6283185'),
    Row(0x6092, 2, 'Shaft revolutions', 7, 'rw', '10'),
)
"""A factor group of 100,000 increments per rad."""


def eds_text(rows: Iterable[Row] = DRIVE_ROWS) -> str:
    """Write an EDS of these rows as a careful vendor would."""
    by_index: dict[int, list[Row]] = {}
    for row in rows:
        by_index.setdefault(row.index, []).append(row)
    lines = ['[FileInfo]', 'FileName=sample.eds', 'EDSVersion=4.0', '']
    lines += ['[DeviceInfo]', 'VendorName=Sample', 'ProductName=Sample drive', '']
    lines += _lists(sorted(by_index))
    for index, group in sorted(by_index.items()):
        if len(group) == 1 and group[0].subindex == 0:
            lines += [f'[{index:04X}]', 'ObjectType=0x7', *_keys(group[0])]
            continue
        lines += [f'[{index:04X}]', f'ParameterName=Object {index:04X}', 'ObjectType=0x9']
        lines += [f'SubNumber={len(group)}', '']
        for row in group:
            lines += [f'[{index:04X}sub{row.subindex:X}]', 'ObjectType=0x7', *_keys(row)]
    return '\n'.join(lines)


def _lists(indices: list[int]) -> list[str]:
    groups = {
        'MandatoryObjects': [i for i in indices if i in (0x1000, 0x1001, 0x1018)],
        'OptionalObjects': [
            i for i in indices if i not in (0x1000, 0x1001, 0x1018) and not 0x2000 <= i < 0x6000
        ],
        'ManufacturerObjects': [i for i in indices if 0x2000 <= i < 0x6000],
    }
    lines: list[str] = []
    for title, group in groups.items():
        lines += [f'[{title}]', f'SupportedObjects={len(group)}']
        lines += [f'{place}=0x{index:04X}' for place, index in enumerate(group, 1)] + ['']
    return lines


def _keys(row: Row) -> list[str]:
    return [
        f'ParameterName={row.name}',
        f'DataType=0x{row.data_type:04X}',
        f'AccessType={row.access}',
        f'DefaultValue={row.default}',
        f'PDOMapping={int(row.mappable)}',
        *([f'LowLimit={row.low}'] if row.low else []),
        *([f'HighLimit={row.high}'] if row.high else []),
        '',
    ]
