# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Reading EDS and DCF files (CiA 306-1), tolerant of what vendors ship."""

from __future__ import annotations

from dataclasses import dataclass
import os
from pathlib import Path

from ..exceptions import Problem
from ..findings import Findings, Place
from ..standard.cob_id import NODE_ID_MAX, NODE_ID_MIN
from ..standard.dictionary import ObjectDictionary
from .ini import decode_text, IniFile, read_ini
from .objects import ObjectReader
from .values import parse_integer

SIZE_MAX = 16 * 1024 * 1024  # [byte] larger files are no EDS
DUMMY_TYPES = range(0x0002, 0x0008)  # INTEGER8 to UNSIGNED32 (CiA 301, 7.4.7.1)
COMMISSIONING = ('devicecomissioning', 'devicecommissioning')  # the standard misspells it
TOLERATED = 'the file is read all the same; correct it when a value is missing'


@dataclass(frozen=True, slots=True)
class Eds:
    """The content of an EDS or DCF."""

    path: Path
    dictionary: ObjectDictionary  # its objects; defaults with ``$NODEID`` are still node-relative
    node_id: int | None = None  # node id of a DCF, None in an EDS
    # data types that may stand in an RPDO as a gap
    dummy_types: frozenset[int] = frozenset(DUMMY_TYPES)
    warnings: tuple[Problem, ...] = ()  # what was odd but could be understood
    # VendorNumber, ProductNumber and RevisionNumber of [DeviceInfo]; 0 where it has none
    numbers: tuple[int, int, int] = (0, 0, 0)


def load_eds(path: str | os.PathLike[str]) -> Eds:
    """Read an EDS or DCF file; oddities are its warnings.

    Raises:
        ConfigError: The file is missing, unreadable or has no objects.
    """
    path = Path(path)
    findings = Findings()
    ini = read_ini(read_eds_text(path, findings))
    node_id = _node_id(ini)
    dictionary = ObjectDictionary(ObjectReader(ini).entries(), source=str(path), node_id=node_id)
    if not len(dictionary):
        findings.error(Place(path), 'no object in this file', 'name an EDS or DCF file of CiA 306')
        findings.raise_errors()
    for line, key, message in ini.oddities:
        findings.warning(Place(path, line, key), message, TOLERATED)
    return Eds(path, dictionary, node_id, _dummy_types(ini), findings.warnings, _numbers(ini))


def read_eds_text(path: Path, findings: Findings) -> str:
    """Return the text of an EDS or DCF.

    Raises:
        ConfigError: The file is missing, unreadable or too large to be one.
    """
    try:
        if not path.is_file():
            findings.error(Place(path), 'there is no such file', 'correct the path of the EDS')
        elif path.stat().st_size > SIZE_MAX:
            findings.error(Place(path), 'larger than 16 MiB', 'name an EDS or DCF file')
        else:
            return decode_text(path.read_bytes())
    except (OSError, ValueError) as error:
        findings.error(Place(path), f'cannot be read: {error}', 'correct its path or permissions')
    findings.raise_errors()
    return ''


def _number(ini: IniFile, section: str, key: str) -> int:
    """Return a number beside the objects, 0 where the file has none."""
    try:
        return parse_integer(ini.sections[section].text(key))
    except (KeyError, ValueError):
        return 0


def _node_id(ini: IniFile) -> int | None:
    found = (_number(ini, section, 'nodeid') for section in COMMISSIONING)
    return next((number for number in found if NODE_ID_MIN <= number <= NODE_ID_MAX), None)


def _numbers(ini: IniFile) -> tuple[int, int, int]:
    vendor, product, revision = (
        _number(ini, 'deviceinfo', f'{what}number') for what in ('vendor', 'product', 'revision')
    )
    return vendor, product, revision


def _dummy_types(ini: IniFile) -> frozenset[int]:
    """Read [DummyUsage]; files without it are taken to allow all (many just leave it out)."""
    section = ini.sections.get('dummyusage')
    if section is None:
        return frozenset(DUMMY_TYPES)
    texts = {number: section.text(f'dummy{number:04x}') for number in DUMMY_TYPES}
    return frozenset(number for number, text in texts.items() if text not in ('', '0', '0x0'))
