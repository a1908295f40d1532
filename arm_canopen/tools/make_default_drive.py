# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Write the dictionary of a drive of which no EDS is given, made from that of the simulated drive.

It has the objects of CiA 402 with their types, and of CiA 301 what nearly every drive has. What
only the device itself knows is left out: identity, default values, limits, and PDOs, of which only
those exist that bus.yml names. Run it after a change of cia402_drive.eds:
``python3 tools/make_default_drive.py``.
"""

from __future__ import annotations

from pathlib import Path
import re

PACKAGE = Path(__file__).parents[1]
SOURCE = PACKAGE / 'eds' / 'cia402_drive.eds'
TARGET = PACKAGE / 'arm_canopen' / 'config' / 'resolve' / 'default_drive.eds'

COMMUNICATION = {0x1003, 0x1005, 0x1008, 0x1009, 0x100A, 0x1014, 0x1017, 0x1029}
OBJECT = re.compile(r'^\[([0-9A-F]{4})(?=sub|\])', re.MULTILINE)
DEFAULT = re.compile(r'^DefaultValue=.*$', re.MULTILINE)
KNOWN_BY_THE_DEVICE = re.compile(r'^(DefaultValue|LowLimit|HighLimit)=.*\n', re.MULTILINE)
COMMENTS = re.compile(r'\[Comments\]\n.*?\n\n', re.DOTALL)
NOTE = """[Comments]
Lines=2
Line1=Stands in for the EDS of a drive that bus.yml names none for;
Line2=made by tools/make_default_drive.py.

"""
PDO_OBJECTS = range(0x1400, 0x1C00)
PROFILE = range(0x6000, 0x7000)


def default_drive(source: str) -> str:
    """Return the EDS without what differs from drive to drive.

    Args:
        source: Text of the EDS of the simulated drive.
    """
    head, rest = source.split('[OptionalObjects]')
    body, manufacturer = rest.split('[ManufacturerObjects]')
    parts = body.partition('\n\n')[2].strip().split('\n\n')
    kept = [_general(part) for part in parts if _is_general(part)]
    indices = sorted({_index(part) for part in kept})
    listed = ''.join(f'{number}=0x{index:04X}\n' for number, index in enumerate(indices, 1))
    general_head = re.sub(r'(?m)^((Vendor|Product|Revision)Number)=.*$', r'\1=0', head)
    for old, new in (
        ('A simulated CiA 402 drive (arm_canopen fake_slave).', 'Any CiA 402 drive.'),
        (SOURCE.name, TARGET.name),
        ('Simulated CiA 402 drive', 'CiA 402 drive without EDS'),
    ):
        general_head = general_head.replace(old, new)
    general_head = re.sub(r' Units are.*?radian\.\n', '\n', general_head, flags=re.DOTALL)
    mandatory = [_without_identity(part) for part in general_head.split('\n\n')]
    text = COMMENTS.sub(NOTE, '\n\n'.join(mandatory))
    objects = '\n\n'.join(kept)
    return (
        f'{text}[OptionalObjects]\nSupportedObjects={len(indices)}\n{listed}\n{objects}\n\n'
        f'[ManufacturerObjects]{manufacturer}'
    )


def _index(part: str) -> int:
    found = OBJECT.search(part)
    if found is None:
        raise ValueError(f'no object in {part[:60]!r}: separate objects by one empty line')
    return int(found[1], 16)


def _is_general(part: str) -> bool:
    index = _index(part)
    return index in COMMUNICATION or index in PDO_OBJECTS or index in PROFILE


def _general(part: str) -> str:
    """Remove from an object what only the device knows, and what is said of the simulation."""
    index = _index(part)
    part = '\n'.join(line for line in part.splitlines() if not line.startswith(';'))
    if index in PROFILE:
        constant = 'AccessType=const' in part  # the number of sub-indices belongs to the profile
        return part if constant else KNOWN_BY_THE_DEVICE.sub('', f'{part}\n').rstrip('\n')
    if index in PDO_OBJECTS and 'AccessType=rw' in part:
        # the identifiers of the standard, each switched off until bus.yml names the PDO
        switched_off = re.sub(r'\+0x4?0*(\w{3})$', r'+0x80000\1', part, flags=re.MULTILINE)
        return switched_off if '$NODEID' in part else DEFAULT.sub('DefaultValue=0', part)
    return part


def _without_identity(part: str) -> str:
    part = re.sub(r'(?m)^; 0xFFFF .*\n', '', part)
    if re.search(r'^\[(1000|1018sub[1-4])\]', part, re.MULTILINE):
        return DEFAULT.sub('DefaultValue=0', part)
    return part


if __name__ == '__main__':
    TARGET.write_text(default_drive(SOURCE.read_text('ascii')), 'ascii')
