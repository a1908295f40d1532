# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a DCF wants written: the ParameterValues that are not the defaults (CiA 306-1, 4.6.3).

A DCF is an EDS with the values of one configured device, which a configuration manager downloads
(CiA 302-3, 0x1F20). Those of PDOs become the PDOs of the bus model.
"""

from __future__ import annotations

from ...exceptions import CodecError
from ...standard.datatypes import encode
from ...standard.device_profile import is_drive
from ...standard.dictionary import ObjectEntry
from ...standard.objects import axis_of, COMMANDS, Index
from ..findings import Findings, Place
from ..model.boot_plan import ERROR_CONTROL
from ..model.bus import SdoWrite
from ..read.eds import Eds

ACTIONS = frozenset({Index.STORE_PARAMETERS, Index.RESTORE_PARAMETERS})
"""Objects that do something when they are written."""
PDOS = range(Index.RPDO_COMMUNICATION, 0x1C00)
PROGRAMS_AND_NMT = range(0x1F50, 0x1FA0)  # CiA 302-2 and -3


def parameter_writes(eds: Eds, findings: Findings) -> tuple[SdoWrite, ...]:
    """Return the writes of a DCF in ascending order; an EDS has none, nor has what is reported."""
    return tuple(
        SdoWrite(
            *entry.address, data, place=Place(eds.path, key=f'ParameterValue of {eds.path.name}')
        )
        for entry in eds.dictionary
        if entry.configured
        and _is_setting(entry)
        and (data := _data(entry, eds, findings)) is not None
    )


def _is_setting(entry: ObjectEntry) -> bool:
    index = entry.index
    others = index in ACTIONS or index in ERROR_CONTROL or index == Index.SDO_SERVER
    ranges = index in PDOS or index in PROGRAMS_AND_NMT
    return entry.access.writable and not (others or ranges)


def _data(entry: ObjectEntry, eds: Eds, findings: Findings) -> bytes | None:
    place = Place(eds.path, entry.line, f'[{entry.index:04X}]')
    if is_drive(eds.dictionary) and axis_of(entry.index)[0] in COMMANDS:
        what = f'the ParameterValue of {entry} is a command, which is not written at boot'
        findings.warning(place, what, 'remove it; the drive gets its commands at run time')
        return None
    if entry.default is None:
        return None
    try:
        return encode(entry.data_type, entry.default)
    except CodecError as error:
        findings.warning(place, f'the ParameterValue of {entry}: {error}', 'correct it')
        return None
