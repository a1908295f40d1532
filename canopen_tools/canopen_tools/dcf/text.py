# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Writing an object dictionary as a DCF file (CiA 306-1, 4.6 and 4.7)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from arm_canopen.standard import AccessType, DataType, ObjectCode

from ..eds_lint import LISTS, proper_list


@dataclass(frozen=True, slots=True)
class DcfEntry:
    """A VAR, or a sub-index."""

    name: str
    data_type: DataType
    access: AccessType
    default: str = ''  # DefaultValue as it is written, empty for none
    mappable: bool = False  # may be mapped into a PDO
    upload_file: str = ''  # file whose content the object has, empty for none

    def lines(self) -> list[str]:
        """Return its keys."""
        return [
            f'ParameterName={self.name}',
            f'ObjectType=0x{ObjectCode.VAR:X}',
            f'DataType=0x{self.data_type:04X}',
            f'AccessType={self.access.value}',
            *([f'DefaultValue={self.default}'] if self.default else []),
            f'PDOMapping={int(self.mappable)}',
            *([f'UploadFile={self.upload_file}'] if self.upload_file else []),
        ]


@dataclass(frozen=True, slots=True)
class DcfRecord:
    """A record or array with each sub-index written out; sub-index 0 is added."""

    name: str
    parts: Sequence[DcfEntry]  # its sub-indices from 1
    code: ObjectCode = ObjectCode.RECORD  # RECORD or ARRAY


@dataclass(frozen=True, slots=True)
class DcfArray:
    """An array of equal sub-indices, abbreviated with CompactSubObj (CiA 306-1, 4.6.3.2)."""

    name: str
    data_type: DataType
    access: AccessType
    size: int
    # values by sub-index where they are not the default
    values: Mapping[int, str] = field(default_factory=dict)
    default: str = ''  # DefaultValue of all others, empty for none


DcfObject = DcfEntry | DcfRecord | DcfArray


def dcf_text(head: Mapping[str, Mapping[str, str]], objects: Mapping[int, DcfObject]) -> str:
    """Return the text of a DCF: the sections before the objects, each with its keys, and these."""
    lines: list[str] = []
    for title, keys in head.items():
        lines += [f'[{title}]', *(f'{key}={value}' for key, value in keys.items()), '']
    for title in LISTS.values():
        lines += _list(title, sorted(i for i in objects if proper_list(i) == title))
    for index, content in sorted(objects.items()):
        lines += _object(index, content)
    return '\n'.join(lines)


def _list(title: str, indices: Iterable[int]) -> list[str]:
    entries = [f'{n}=0x{index:04X}' for n, index in enumerate(indices, start=1)]
    return [f'[{title}]', f'SupportedObjects={len(entries)}', *entries, '']


def _object(index: int, content: DcfObject) -> list[str]:
    if isinstance(content, DcfEntry):
        return [f'[{index:04X}]', *content.lines(), '']
    if isinstance(content, DcfArray):
        return _array(index, content)
    count = DcfEntry(
        'Highest sub-index supported',
        DataType.UNSIGNED8,
        AccessType.CONSTANT,
        str(len(content.parts)),
    )
    lines = [f'[{index:04X}]', f'ParameterName={content.name}', f'ObjectType=0x{content.code:X}']
    lines += [f'SubNumber={len(content.parts) + 1}', '']
    for subindex, part in enumerate((count, *content.parts)):
        lines += [f'[{index:04X}sub{subindex:X}]', *part.lines(), '']
    return lines


def _array(index: int, array: DcfArray) -> list[str]:
    lines = [
        f'[{index:04X}]',
        f'ParameterName={array.name}',
        f'ObjectType=0x{ObjectCode.ARRAY:X}',
        f'DataType=0x{array.data_type:04X}',
        f'AccessType={array.access.value}',
        *([f'DefaultValue={array.default}'] if array.default else []),
        'PDOMapping=0',
        f'CompactSubObj={array.size}',
        '',
    ]
    if array.values:
        lines += [f'[{index:04X}Value]', f'NrOfEntries={len(array.values)}']
        lines += [f'{subindex}={value}' for subindex, value in sorted(array.values.items())]
        lines += ['']
    return lines
