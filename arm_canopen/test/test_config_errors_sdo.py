# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Objects that cannot be written at boot."""

from __future__ import annotations

from pathlib import Path

from config_cases import Case, check
import pytest

SDO_KEY = 'sdo[0]'
SDO = [
    Case('joint1', 'sdo: 5 # <-', 'sdo', 'expected a list, got 5', '- {index'),
    Case('joint1', 'sdo: [7] # <-', SDO_KEY, 'expected an object, got 7', 'write {index'),
    Case('joint1', 'sdo: [{value: 1}] # <-', SDO_KEY, "no 'index'", 'write {index'),
    Case(
        'joint1',
        'sdo: [{index: 0x6081, sub: 0, value: 1}] # <-',
        f'{SDO_KEY}.sub',
        "unknown key 'sub'",
        "mean 'sub_index'",
    ),
    Case('joint1', 'sdo: [{index: 0x10000}] # <-', f'{SDO_KEY}.index', 'range', '16 bits'),
    Case(
        'joint1',
        """
        sdo:
          - {index: 0x6081, value: 1}
          - {index: 0x6082, value: 1} # <-
        """,
        'sdo[1]',
        'object 0x6082:00 is not in the EDS .*drive.eds',
        'EDS that fits',
    ),
    Case(
        'joint1',
        'sdo: [{index: 0x60C2, sub_index: 3, value: 1}] # <-',
        SDO_KEY,
        '0x60C2:03 is not in',
        'sub-indices are 0, 1, 2',
    ),
    Case(
        'joint1',
        'sdo: [{index: 0x6041, value: 1}] # <-',
        SDO_KEY,
        '0x6041:00 Statusword is read-only',
        'remove',
    ),
    Case(
        'joint1',
        'sdo: [{index: 0x6098, value: 200}] # <-',
        f'{SDO_KEY}.value',
        '200 does not fit INTEGER8',
        'for these bits write -56',
    ),
    Case(
        'joint1',
        'sdo: [{index: 0x60C2, sub_index: 1, value: 256}] # <-',
        f'{SDO_KEY}.value',
        '256 does not fit UNSIGNED8',
        'take 0 to 255',
    ),
    Case(
        'joint1',
        'sdo: [{index: 0x6081, value: 60000}] # <-',
        f'{SDO_KEY}.value',
        '60000 is beyond its limits',
        'to 50000',
    ),
    Case(
        'joint1',
        'sdo: [{index: 0x2000, value: -0.5}] # <-',
        f'{SDO_KEY}.value',
        '0x2000:00 Gain: -0.5 is beyond its limits',
        '0.* to 10',
    ),
    Case('joint1', 'sdo: [{index: 0x2001, value: 5}] # <-', f'{SDO_KEY}.value', 'text', "'5'"),
    Case('joint1', 'sdo: [{index: 0x2002, value: zz}] # <-', f'{SDO_KEY}.value', 'bytes', '0A 1B'),
    Case(
        'joint1', 'sdo: [{index: 0x2003, value: 7}] # <-', f'{SDO_KEY}.value', 'true or', 'false'
    ),
    Case(
        'joint1',
        'sdo: [{index: 0x1A00, sub_index: 0, value: 0}] # <-',
        SDO_KEY,
        'configures a PDO',
        'below tpdo: 1:',
    ),
    Case(
        'joint1',
        'sdo: [{index: 0x1402, sub_index: 1, value: 0}] # <-',
        SDO_KEY,
        'configures a PDO',
        'below rpdo: 3:',
    ),
    Case(
        'joint1',
        'sdo: [{index: 0x1017, value: 100}] # <-',
        SDO_KEY,
        'written by the master',
        'set heartbeat_producer',
    ),
    Case(
        'joint1',
        'error_behavior: {x: 1} # <-',
        'error_behavior.x',
        'no sub-index',
        "'1: 0'",
    ),
    Case(
        'joint1',
        'error_behavior: {2: 1} # <-',
        'error_behavior.2',
        '0x1029:02 is not in the EDS',
        'sub-indices are 0, 1',
    ),
]


@pytest.mark.parametrize('case', SDO, ids=lambda case: case.piece.strip())
def test_wrong_writes_are_refused(tmp_path: Path, case: Case) -> None:
    """Each is reported with its line, key, the object or value, and what to write instead."""
    check(tmp_path, case)
