# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The EDS of the simulated drive: conforming, complete, and true."""

from __future__ import annotations

import configparser
from pathlib import Path
from typing import Any

import canopen
from device_rig import EDS, NODE_ID, Rig
import pytest

from canopen_core.eds import load_eds
from canopen_core.standard import NmtCommand
from canopen_sim.drive.objects import DriveObjects
from canopen_sim.object_store import Integer, ObjectStore

TWO_AXES = EDS.with_name('cia402_two_axes.eds')
FILES = pytest.mark.parametrize('path', [EDS, TWO_AXES], ids=lambda path: path.stem)
DEVICE_INFO = [
    *('VendorName', 'VendorNumber', 'ProductName', 'ProductNumber', 'RevisionNumber', 'OrderCode'),
    *(f'BaudRate_{rate}' for rate in (10, 20, 50, 125, 250, 500, 800, 1000)),
    *('SimpleBootUpMaster', 'SimpleBootUpSlave', 'Granularity', 'DynamicChannelsSupported'),
    *('GroupMessaging', 'NrOfRXPDO', 'NrOfTXPDO', 'LSS_Supported'),
]
"""Entries that CiA 306-1, 4.5.2 requires."""


def ini(path: Path) -> configparser.ConfigParser:
    """Read the file as an INI file; a section or key that stands twice is an error."""
    parser = configparser.ConfigParser(strict=True, interpolation=None)
    parser.optionxform = str  # type: ignore[assignment,method-assign]
    with path.open(encoding='ascii') as file:
        parser.read_file(file)
    return parser


@FILES
def test_others_read_the_same(path: Path) -> None:
    """python-canopen understands every object as our reader does, which has no warning."""
    assert load_eds(path).warnings == ()
    dictionary = load_eds(path).dictionary.for_node(NODE_ID)
    other: Any = canopen.import_od(str(path), node_id=NODE_ID)
    assert len(list(dictionary)) == sum(
        1 if isinstance(entry, canopen.objectdictionary.ODVariable) else len(entry)
        for entry in other.values()
        if entry.index >= 0x1000  # below are the data types for gaps
    )
    for entry in dictionary:
        variable = other.get_variable(entry.index, entry.subindex)
        assert (variable.data_type, variable.access_type, variable.pdo_mappable) == (
            entry.data_type,
            entry.access.value,
            entry.pdo_mappable,
        ), str(entry)
        assert variable.default == entry.default, str(entry)
        assert (variable.min, variable.max) == (entry.low_limit, entry.high_limit), str(entry)


@FILES
def test_lists_and_sections_agree(path: Path) -> None:
    """Each listed object has its section, each section is listed once, counts are right."""
    file = ini(path)
    listed: list[int] = []
    for name in ('MandatoryObjects', 'OptionalObjects', 'ManufacturerObjects'):
        count = int(file[name]['SupportedObjects'])
        indices = [int(file[name][str(number)], 16) for number in range(1, count + 1)]
        assert len(file[name]) == count + 1
        assert indices == sorted(indices)
        listed += indices
    sections = {int(name, 16) for name in file.sections() if len(name) == 4}
    assert len(listed) == len(set(listed))
    assert set(listed) == sections
    for index in sections:
        subs = [s for s in file.sections() if s.startswith(f'{index:04X}sub')]
        assert int(file[f'{index:04X}'].get('SubNumber', '0')) == len(subs)


@FILES
def test_device_info_is_complete_and_true(path: Path) -> None:
    """The device information has what the standard requires, and agrees with the objects."""
    assert max(map(len, path.read_bytes().decode('ascii').splitlines())) <= 255  # 306-1
    file = ini(path)
    info = file['DeviceInfo']
    assert [key for key in DEVICE_INFO if key not in info] == []
    assert int(info['VendorNumber'], 0) == int(file['1018sub1']['DefaultValue'], 0)
    assert int(info['ProductNumber'], 0) == int(file['1018sub2']['DefaultValue'], 0)
    assert int(info['RevisionNumber'], 0) == int(file['1018sub3']['DefaultValue'], 0)
    assert info['ProductName'] == file['1008']['DefaultValue']
    assert int(info['NrOfRXPDO']) == sum(name.startswith('140') for name in file if len(name) == 4)
    assert int(info['NrOfTXPDO']) == sum(name.startswith('180') for name in file if len(name) == 4)
    assert file['FileInfo']['FileName'] == path.name


def test_second_axis_mirrors_the_first() -> None:
    """Each object of the drive profile is there again 0x800 further on, the same in all else."""
    dictionary = load_eds(TWO_AXES).dictionary
    one, two = (
        {
            (entry.index - base, entry.subindex): (entry.data_type, entry.access, entry.default)
            for entry in dictionary
            if base <= entry.index < base + 0x800
        }
        for base in (0x6000, 0x6800)
    )
    assert one == two
    assert (0x40, 0) in two


def test_drive_finds_every_object_that_it_works_with() -> None:
    """Nothing of the drive model is hidden behind a made-up object."""
    store = ObjectStore(load_eds(EDS).dictionary)
    known = set(store)
    missing = [
        f'0x{variable.entry.index:04X}'
        for variable in vars(DriveObjects(store)).values()
        if isinstance(variable, Integer) and variable not in known
    ]
    assert missing == []


def test_default_pdos_work_as_they_come() -> None:
    """Without any configuration, CiA 402's default PDOs run a drive."""
    rig = Rig()
    rig.nmt(NmtCommand.START)
    assert rig.take(0x180 + NODE_ID) == [b'\x50\x02']
    rig.send(0x300 + NODE_ID, b'\x06\x00\x03')
    assert rig.take(0x280 + NODE_ID) == [b'\x31\x02\x03']
    rig.send(0x200 + NODE_ID, b'\x07\x00')
    rig.send(0x500 + NODE_ID, b'\x0f\x00\xf4\x01\x00\x00')
    rig.cycles(100)
    assert rig.take(0x480 + NODE_ID)[-1][2:] == b'\xf4\x01\x00\x00'
    rig.sync()
    assert len(rig.take(0x380 + NODE_ID)) == 1
