# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""PDOs that the device or the bus cannot have."""

from __future__ import annotations

from pathlib import Path

from config_cases import Case, check
import pytest

TPDO_KEY = 'tpdo.1'
PDO = [
    Case('joint1', 'tpdo: [1] # <-', 'tpdo', 'got a list', 'indent'),
    Case('joint1', 'tpdo: {9: {}} # <-', 'tpdo.9', r'TPDO 9 \(0x1808\)', '1, 2, 3'),
    Case('joint1', 'rpdo: {0: {}} # <-', 'rpdo.0', "'0' is no PDO number", '1 to 512'),
    Case('joint1', 'tpdo: {1: } # <-', TPDO_KEY, 'got nothing', "below '1:'"),
    Case(
        'joint1',
        """
        tpdo:
          1: {enabled: true}
          enabled: true # <-
        """,
        'tpdo.enabled',
        "'enabled' is no PDO number",
        "indent 'enabled' below a PDO number",
    ),
    Case('joint1', 'tpdo: {1: {map: []}} # <-', f'{TPDO_KEY}.map', 'unknown', "'mapping'"),
    Case(
        'joint1',
        'tpdo: {1: {event_deadline: 5}} # <-',
        f'{TPDO_KEY}.event_deadline',
        'unknown key',
        'belongs to a number below rpdo',
    ),
    Case(
        'joint1',
        'tpdo: {1: {transmission: 300}} # <-',
        f'{TPDO_KEY}.transmission',
        '300 is out of range',
        '0 to 255',
    ),
    Case(
        'joint1',
        'tpdo: {1: {transmission: 252}} # <-',
        f'{TPDO_KEY}.transmission',
        'remote frames',
        '254 or 255',
    ),
    Case(
        'joint1',
        'tpdo: {1: {inhibit_time: 70000}} # <-',
        f'{TPDO_KEY}.inhibit_time',
        'out of range',
        'the unit is 100 microseconds',
    ),
    Case('joint1', 'tpdo: {1: {cob_id: 0}} # <-', f'{TPDO_KEY}.cob_id', 'no 11-bit', "'auto'"),
    Case(
        'joint1',
        'tpdo: {1: {cob_id: 0x80000181}} # <-',
        f'{TPDO_KEY}.cob_id',
        'no 11-bit identifier',
        "'enabled: false'",
    ),
    Case('joint1', 'tpdo: {1: {cob_id: car}} # <-', f'{TPDO_KEY}.cob_id', "got 'car'", '0x0A'),
    Case('joint1', 'tpdo: {1: {cob_id: 0x80}} # <-', f'{TPDO_KEY}.cob_id', 'SYNC', 'auto'),
    Case('joint1', 'tpdo: {1: {cob_id: 0x605}} # <-', f'{TPDO_KEY}.cob_id', 'SDO requ', 'auto'),
    Case('joint1', 'tpdo: {1: {cob_id: 0x702}} # <-', f'{TPDO_KEY}.cob_id', 'heartbeats', 'auto'),
    Case(
        'joint1',
        'tpdo: {5: {mapping: [{index: 0x6041}]}} # <-',
        'tpdo.5',
        'TPDO 5 of joint1 has no COB-ID in the EDS',
        'cob_id: auto',
    ),
    Case('joint1', 'tpdo: {2: {}} # <-', 'tpdo.2', 'maps nothing', 'enabled: false'),
    Case(
        'joint1',
        'tpdo: {1: {mapping: []}} # <-',
        'tpdo.1',
        'maps nothing',
        'enabled: false',
    ),
    Case('joint1', 'tpdo: {1: {mapping: x}} # <-', f'{TPDO_KEY}.mapping', 'a list', '- {index'),
    Case(
        'joint1',
        'tpdo: {1: {mapping: [x]}} # <-',
        f'{TPDO_KEY}.mapping[0]',
        "an object, got 'x'",
        '{index',
    ),
    Case(
        'joint1',
        'tpdo: {1: {mapping: [{index: 0x6041, value: 1}]}} # <-',
        f'{TPDO_KEY}.mapping[0].value',
        'unknown key',
        'entry of sdo',
    ),
    Case(
        'joint1',
        'tpdo: {1: {mapping: [{index: 0x6042}]}} # <-',
        f'{TPDO_KEY}.mapping[0]',
        '0x6042:00 is not in the EDS',
        'EDS that fits',
    ),
    Case(
        'joint1',
        'tpdo: {1: {mapping: [{index: 0x6040}]}} # <-',
        f'{TPDO_KEY}.mapping[0]',
        'Controlword cannot be mapped into a TPDO .*access rww',
        'another object',
    ),
    Case(
        'joint1',
        'rpdo: {1: {mapping: [{index: 0x6041}]}} # <-',
        'rpdo.1.mapping[0]',
        'Statusword cannot be mapped into a RPDO .*access ro',
        'another object',
    ),
    Case(
        'joint1',
        'tpdo: {1: {mapping: [{index: 0x6083}]}} # <-',
        f'{TPDO_KEY}.mapping[0]',
        'PDO mapping no',
        'correct PDOMapping in the EDS',
    ),
    Case(
        'joint1',
        'tpdo: {1: {mapping: [{index: 0x1008}]}} # <-',
        f'{TPDO_KEY}.mapping[0]',
        'no fixed length .VISIBLE_STRING',
        'by SDO',
    ),
    Case(
        'joint1',
        'tpdo: {1: {mapping: [{index: 5}]}} # <-',
        f'{TPDO_KEY}.mapping[0]',
        'gap 0x0005 .UNSIGNED8. is for RPDOs only',
        'remove',
    ),
    Case(
        'joint1',
        """
        tpdo:
          1:
            mapping: # <-
              - {index: 0x6064}
              - {index: 0x606C}
              - {index: 0x6041}
        """,
        f'{TPDO_KEY}.mapping',
        'have 80 bits together, a PDO carries at most 64',
        'another PDO',
    ),
    Case(
        'joint1',
        f'tpdo: {{1: {{mapping: [{", ".join(["{index: 0x2003}"] * 9)}]}}}} # <-',
        f'{TPDO_KEY}.mapping',
        '9 objects are mapped, TPDO 1 of this device takes at most 8',
        'another PDO',
    ),
    Case(
        'joint1',
        'rpdo: {1: {sync_start: 5}} # <-',
        'rpdo.1.sync_start',
        'unknown key',
        'belongs to a number below tpdo',
    ),
]


@pytest.mark.parametrize('case', PDO, ids=lambda case: case.piece.strip())
def test_wrong_pdos_are_refused(tmp_path: Path, case: Case) -> None:
    """Each is reported with its line, key, the reason and what to write instead."""
    check(tmp_path, case)
