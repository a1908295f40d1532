# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Objects by number and by name."""

from __future__ import annotations

from pathlib import Path

import pytest

from canopen_core import ObjectError
from canopen_core.eds import load_eds
from canopen_core.standard import find_object, object_path, ObjectDictionary

EDS = Path(__file__).parents[2] / 'arm_canopen' / 'eds' / 'cia402_drive.eds'


@pytest.fixture(scope='module')
def dictionary() -> ObjectDictionary:
    """The simulated drive's."""
    return load_eds(EDS).dictionary


def test_every_object_is_found_by_number(dictionary: ObjectDictionary) -> None:
    """With and without 0x, in upper and lower case."""
    for entry in dictionary:
        for path in (
            f'0x{entry.index:04X}:{entry.subindex:02X}',
            f'{entry.index:04x}:{entry.subindex:x}',
            f' 0X{entry.index:04x}:0x{entry.subindex:02x} ',
        ):
            assert find_object(dictionary, path) is entry


def test_every_object_is_found_by_its_path_or_its_doubles_are_named(
    dictionary: ObjectDictionary,
) -> None:
    """Only where the EDS has two objects of one name the number is needed."""
    paths = [object_path(entry).lower() for entry in dictionary]
    for entry in dictionary:
        path = object_path(entry)
        if paths.count(path.lower()) == 1:
            assert find_object(dictionary, path.upper()) is entry
        else:
            with pytest.raises(ObjectError, match=f'0x{entry.index:04X}'):
                find_object(dictionary, path)


@pytest.mark.parametrize(
    ('path', 'address'),
    [
        ('Statusword', (0x6041, 0)),
        ('  status  word ', None),
        ('Software position limit/Max', (0x607D, 2)),
        ('max position limit', (0x607D, 2)),
        ('identity object/serial number', (0x1018, 4)),
        ('vendor', (0x1018, 1)),
    ],
)
def test_names_may_be_shortened(
    dictionary: ObjectDictionary, path: str, address: tuple[int, int] | None
) -> None:
    """As long as only one object can be meant."""
    if address is None:
        with pytest.raises(ObjectError, match='similar: 0x6041:00 Statusword'):
            find_object(dictionary, path)
    else:
        assert find_object(dictionary, path).address == address


@pytest.mark.parametrize(
    ('path', 'words'),
    [
        ('Contrlword', 'no object .*similar: 0x6040:00 Controlword'),
        ('position', 'may be any of .*0x6064:00 Position actual value'),
        ('0x607D:09', 'no sub-index 0x09; it has: .*0x607D:02 Max position limit'),
        ('0x9999', 'no object 0x9999 in .*cia402_drive.eds'),
        ('', 'no object is named'),
        (' / ', 'no object is named'),
    ],
    ids=['misspelt', 'several', 'sub-index', 'index', 'empty', 'slash'],
)
def test_what_is_not_found_is_answered_with_what_there_is(
    dictionary: ObjectDictionary, path: str, words: str
) -> None:
    """The message helps to write it rightly."""
    with pytest.raises(ObjectError, match=words):
        find_object(dictionary, path)
