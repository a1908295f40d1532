# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Write the EDS of the simulated two-axis drive, made from that of the single drive.

The objects 0x6000 to 0x67FE come a second time, 0x800 further on; the second axis also gets four
RPDOs and four TPDOs with the mapping of the first, which are switched off by default. 0x67FF and
0x6FFF hold the device type of each axis (CiA 402-1). Run it after a change of cia402_drive.eds:
``python3 tools/make_two_axes.py``.
"""

from __future__ import annotations

from pathlib import Path
import re

FOLDER = Path(__file__).parents[1] / 'eds'
SOURCE = FOLDER / 'cia402_drive.eds'
TARGET = FOLDER / 'cia402_two_axes.eds'

AXIS_OFFSET = 0x800
PROFILE = range(0x6000, 0x67FF)
PDO_COUNT = 4
PDO_BASES = (0x1400, 0x1600, 0x1800, 0x1A00)
DISABLED_COB_ID = '0x80000000'
OBJECT = re.compile(r'^\[([0-9A-F]{4})(?=sub|\])', re.MULTILINE)
AXIS_TYPE = """; The device type of this axis alone.
[{index:04X}]
ParameterName=Single device type
ObjectType=0x7
DataType=0x0007
AccessType=ro
DefaultValue=0x00020192
PDOMapping=0

"""


def two_axes(source: str) -> str:
    """Return the EDS of two axes.

    Args:
        source: Text of the EDS of one.
    """
    head, rest = source.split('[OptionalObjects]')
    body, manufacturer = rest.split('[ManufacturerObjects]')
    blocks = _objects(body.partition('\n\n')[2])
    for index, text in list(blocks.items()):
        offset = _offset(index)
        if offset:
            blocks[index + offset] = _moved(text, index, offset)
    for index in (PROFILE.stop, PROFILE.stop + AXIS_OFFSET):
        blocks[index] = AXIS_TYPE.format(index=index)
    lines = [f'{number}=0x{index:04X}\n' for number, index in enumerate(sorted(blocks), 1)]
    listed = f'[OptionalObjects]\nSupportedObjects={len(blocks)}\n{"".join(lines)}\n'
    body = ''.join(blocks[index] for index in sorted(blocks))
    return f'{_renamed(head)}{listed}{body}[ManufacturerObjects]{manufacturer}'


def _objects(body: str) -> dict[int, str]:
    """Return the text of each object with its comments and sub-objects."""
    blocks: dict[int, str] = {}
    for part in body.strip().split('\n\n'):
        found = OBJECT.search(part)
        if found is None:
            raise ValueError(f'no object in {part[:60]!r}: separate objects by one empty line')
        index = int(found[1], 16)
        blocks[index] = blocks.get(index, '') + part + '\n\n'
    return blocks


def _offset(index: int) -> int:
    """Return how far on an object comes a second time, 0 for never."""
    if index in PROFILE:
        return AXIS_OFFSET
    is_pdo = any(base <= index < base + PDO_COUNT for base in PDO_BASES)
    return PDO_COUNT if is_pdo else 0


def _moved(text: str, index: int, offset: int) -> str:
    text = OBJECT.sub(lambda found: f'[{int(found[1], 16) + offset:04X}', text)
    if index in PROFILE:
        return text
    # names carry the number of the PDO; mapped objects are those of the other axis
    number = (index & 0x3F) + 1
    text = text.replace(f'parameter {number}\n', f'parameter {number + offset}\n')
    text = re.sub(r'=\$NODEID\+0x\w+', f'={DISABLED_COB_ID}', text)
    return re.sub(r'=0x6([0-7]\w{6})\b', lambda f: f'=0x{_second(f[1]):08X}', text)


def _second(digits: str) -> int:
    return int(f'6{digits}', 16) + (AXIS_OFFSET << 16)


def _renamed(head: str) -> str:
    for old, new in (
        (
            '; A simulated CiA 402 drive',
            '; Made by tools/make_two_axes.py.\n; A two-axis drive',
        ),
        (f'FileName={SOURCE.name}', f'FileName={TARGET.name}'),
        ('Description=Simulated CiA 402 drive', 'Description=Simulated CiA 402 drive of two axes'),
        ('NrOfRXPDO=4', 'NrOfRXPDO=8'),
        ('NrOfTXPDO=4', 'NrOfTXPDO=8'),
        ('DefaultValue=0x00020192', 'DefaultValue=0xFFFF0192'),
        ('ProductNumber=0x00000402', 'ProductNumber=0x00000403'),
        ('DefaultValue=0x00000402', 'DefaultValue=0x00000403'),
    ):
        if old not in head:
            raise ValueError(f'{old!r} is not in the head of {SOURCE.name}')
        head = head.replace(old, new)
    return head


if __name__ == '__main__':
    TARGET.write_text(two_axes(SOURCE.read_text('ascii')), 'ascii')
