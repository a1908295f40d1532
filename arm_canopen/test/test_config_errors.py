# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What is refused in a bus.yml: single keys, PDOs, and objects that are written at boot."""

from __future__ import annotations

from pathlib import Path
import re
from typing import NamedTuple

from config_cases import added
from config_samples import eds_text, errors_of, write_bus
import pytest

HERE = '# <-'
"""Marks the line that a problem must name, the only one where there is none."""
PREFIXES = {'master': 'master.', 'defaults': 'defaults.', 'joint1': 'nodes.joint1.', 'top': ''}


class Case(NamedTuple):
    """A wrong piece of a bus.yml, and patterns of what is said and advised.

    The key of the problem is the path of the piece, from its section on, where none is given.
    """

    piece: str
    message: str
    remedy: str
    key: str = ''
    section: str = 'joint1'


def path_of(piece: str) -> str:
    """Return the keys that a piece begins with: ``tpdo.1`` of ``tpdo: {1: [``."""
    names, rest = [], piece.split('\n', maxsplit=1)[0]
    while match := re.match(r'\{?(\w+):(?: +|$)', rest):
        names.append(match[1])
        rest = rest[match.end() :]
    return '.'.join(names)


def mapped(text: str, message: str, remedy: str, key: str = '', direction: str = 'tpdo') -> Case:
    """Return the case of an entry of a mapping, from its index on."""
    piece = f'{direction}: {{1: {{mapping: [{{index: {text}}}]}}}}'
    return Case(piece, message, remedy, f'{direction}.1.mapping[0]{key}')


def written(text: str, message: str, remedy: str, key: str = '') -> Case:
    """Return the case of an entry of ``sdo``, from its index on."""
    return Case(f'sdo: [{{index: {text}}}]', message, remedy, f'sdo[0]{key}')


NINE_OBJECTS = f'tpdo: {{1: {{mapping: [{", ".join(["{index: 0x2003}"] * 9)}]}}}}'
KEYS = [
    Case('nod_id: 3', "unknown key 'nod_id'", "'node_id'"),
    Case('colour: red', 'unknown key', 'known here: node_id'),
    Case('sync_period: 5', 'unknown', 'to master;'),
    Case('options: {}', 'unknown', 'belongs to the top level'),
    Case('node_id: 0', '0 is out of range', '1 to 127'),
    Case('node_id: 255', '255 is out of range', '1 to 127'),
    Case('node_id: two', "whole number, got 'two'", '0x0A'),
    Case('node_id: 010', '010 is ambiguous', 'write 10'),
    Case('node_id: 1:30', 'base 60', 'plain number'),
    Case('node_id: 2.5', 'got 2.5', 'write it as'),
    Case('node_id:', 'got nothing', 'behind the key'),
    Case('node_id: [2]', 'got a list', 'behind the key'),
    Case('node_id: off', 'reads it as a boolean', '0x0A'),
    Case('mandatory: maybe', "got 'maybe'", 'true or false'),
    Case('mandatory: "false"', 'false', 'without quotes'),
    Case('namespace: on', 'as a boolean', 'quotes'),
    Case('namespace: a b', 'no ROS namespace', '/left/arm'),
    Case('remappings: {a: 1}', 'got 1', 'quotes'),
    Case('remappings: x', 'keys with values', 'indent'),
    Case('scale_pos_to_dev: 0', '0 is out', 'than 0'),
    Case('scale_vel_to_dev: .nan', r'\.nan', '0.5'),
    Case('offset_pos_to_dev: inf', 'finite', 'one'),
    Case('switching_state: 7', '7', '5 Operation ena'),
    Case('position_mode: 3', '3 is', '8 Cyclic posit'),
    Case('velocity_mode: 8', '8 is', '3 Profile velo'),
    Case('period: 0', '0 is out of range', '1 to 60000'),
    Case('boot_timeout_ms: -1', '-1', '1 to 600000'),
    Case('heartbeat_producer: 70000', '70000 is out of range', '0 to 65535'),
    Case('heartbeat_multiplier: 0.5', '0.5 is out of range', 'below 1 every heartbeat'),
    Case(
        'driver: "ros2_canopen::CIA402Driver"',
        'unknown driver class',
        "mean 'ros2_canopen::Cia402Driver'",
    ),
    Case('driver: "ros2_canopen::MasterDriver"', 'unknown driver class', 'for the master'),
    Case('driver: Rocket', "'Rocket'", 'ProxyDriver'),
    Case('num_channels: 2', 'has 1 of 2 axes', 'use the EDS'),
    Case('num_channels: 9', 'out of range', '8 axes'),
    Case('channels: []', '0 entries for 1 channels', 'as many'),
    Case('channel_names: [a, b]', '2 names for 1', 'as many'),
    Case('recovery: always', "unknown policy 'always'", 'manual or auto'),
    Case(
        'driver: "ros2_canopen::LifecycleCia402Driver"',
        'is a lifecycle driver, but the master has a plain one',
        'for all or for none',
    ),
    Case('software_file: x', 'vendor', 'remove'),
    Case('software_version: 1', 'not chec', 'remove'),
    Case('restore_configuration: 128', 'out of range', '0 to 127'),
    Case('configuration_file: x.bin', 'sdo list', 'remove'),
    Case('node_id: 200', '200 is out of range', '1 to 127', section='master'),
    Case('sync_period: 10', '10 is out', '10 ms is 10000', section='master'),
    Case('sync_overflow: 1', '1 is out', '0 or 2 to 240', section='master'),
    Case('baudrate: 42', '42 is not allowed', '500 kbit/s', section='master'),
    Case('baud_rate: 500', 'unknown', "mean 'baudrate'", section='master'),
    Case(
        'heartbeat_producer: 60000',
        'is 180 s, devices wait at most 65.535 s',
        'smaller',
        section='master',
    ),
    Case(
        'driver: "ros2_canopen::ProxyDriver"',
        'unknown driver class',
        "for devices; take 'ros2_canopen::MasterDriver'",
        section='master',
    ),
    Case('perod: 10', "unknown key 'perod'", "mean 'period'", section='defaults'),
    Case(
        'option: {dcf_path: "."}', 'unknown section', "mean 'options'", key='option', section='top'
    ),
    Case('joint2: {node_id: 3}', 'unknown section', "below 'nodes:'", key='joint2', section='top'),
    Case('options: []', 'got a list', 'indent the keys', section='top'),
    Case('options: {heartbeat_multiplier: x}', "'x'", '10', section='top'),
]
PDOS = [
    Case('tpdo: [1]', 'got a list', 'indent'),
    Case('tpdo: {9: {}}', r'TPDO 9 \(0x1808\)', '1, 2, 3'),
    Case('rpdo: {0: {}}', "'0' is no PDO number", '1 to 512'),
    Case('tpdo: {1: }', 'got nothing', "below '1:'"),
    Case(
        'tpdo:\n  1: {enabled: true}\n  enabled: true # <-',
        "'enabled' is no PDO number",
        "indent 'enabled' below a PDO number",
        key='tpdo.enabled',
    ),
    Case('tpdo: {1: {map: []}}', 'unknown', "'mapping'"),
    Case('tpdo: {1: {event_deadline: 5}}', 'unknown key', 'belongs to a number below rpdo'),
    Case('tpdo: {1: {transmission: 300}}', '300 is out of range', '0 to 255'),
    Case('tpdo: {1: {transmission: 252}}', 'remote frames', '254 or 255'),
    Case('tpdo: {1: {inhibit_time: 70000}}', 'out of range', 'the unit is 100 microseconds'),
    Case('tpdo: {1: {cob_id: 0}}', 'no 11-bit', "'auto'"),
    Case('tpdo: {1: {cob_id: 0x80000181}}', 'no 11-bit identifier', "'enabled: false'"),
    Case('tpdo: {1: {cob_id: car}}', "got 'car'", '0x0A'),
    Case('tpdo: {1: {cob_id: 0x80}}', 'SYNC', 'auto'),
    Case('tpdo: {1: {cob_id: 0x605}}', 'SDO requ', 'auto'),
    Case('tpdo: {1: {cob_id: 0x702}}', 'heartbeats', 'auto'),
    Case(
        'tpdo: {5: {mapping: [{index: 0x6041}]}}',
        'TPDO 5 of joint1 has no COB-ID in the EDS',
        'cob_id: auto',
        key='tpdo.5',
    ),
    Case('tpdo: {2: {}}', 'maps nothing', 'enabled: false'),
    Case('tpdo: {1: {mapping: []}}', 'maps nothing', 'enabled: false', key='tpdo.1'),
    Case('tpdo: {1: {mapping: x}}', 'a list', '- {index'),
    Case('tpdo: {1: {mapping: [x]}}', "an object, got 'x'", '{index', key='tpdo.1.mapping[0]'),
    mapped('0x6041, value: 1', 'unknown key', 'entry of sdo', key='.value'),
    mapped('0x6042', '0x6042:00 is not in the EDS', 'EDS that fits'),
    mapped('0x6040', 'Controlword cannot be mapped into a TPDO .*access rww', 'another object'),
    mapped(
        '0x6041',
        'Statusword cannot be mapped into a RPDO .*access ro',
        'another object',
        direction='rpdo',
    ),
    mapped('0x6083', 'PDO mapping no', 'correct PDOMapping in the EDS'),
    mapped('0x1008', 'no fixed length .VISIBLE_STRING', 'by SDO'),
    mapped('5', 'gap 0x0005 .UNSIGNED8. is for RPDOs only', 'remove'),
    Case(
        'tpdo: {1: {mapping: [{index: 0x6064}, {index: 0x606C}, {index: 0x6041}]}}',
        'have 80 bits together, a PDO carries at most 64',
        'another PDO',
    ),
    Case(
        NINE_OBJECTS, '9 objects are mapped, TPDO 1 of this device takes at most 8', 'another PDO'
    ),
    Case('rpdo: {1: {sync_start: 5}}', 'unknown key', 'belongs to a number below tpdo'),
]
WRITES = [
    Case('sdo: 5', 'expected a list, got 5', '- {index'),
    Case('sdo: [7]', 'expected an object, got 7', 'write {index', key='sdo[0]'),
    Case('sdo: [{value: 1}]', "no 'index'", 'write {index', key='sdo[0]'),
    written('0x6081, sub: 0, value: 1', "unknown key 'sub'", "mean 'sub_index'", key='.sub'),
    written('0x10000', 'range', '16 bits', key='.index'),
    Case(
        'sdo:\n  - {index: 0x6081, value: 1}\n  - {index: 0x6082, value: 1} # <-',
        'object 0x6082:00 is not in the EDS .*drive.eds',
        'EDS that fits',
        key='sdo[1]',
    ),
    written('0x60C2, sub_index: 3, value: 1', '0x60C2:03 is not in', 'sub-indices are 0, 1, 2'),
    written('0x6041, value: 1', '0x6041:00 Statusword is read-only', 'remove'),
    written(
        '0x6098, value: 200', '200 does not fit INTEGER8', 'for these bits write -56', key='.value'
    ),
    written(
        '0x60C2, sub_index: 1, value: 256',
        '256 does not fit UNSIGNED8',
        'take 0 to 255',
        key='.value',
    ),
    written('0x6081, value: 60000', '60000 is beyond its limits', 'to 50000', key='.value'),
    written(
        '0x2000, value: -0.5',
        '0x2000:00 Gain: -0.5 is beyond its limits',
        '0.* to 10',
        key='.value',
    ),
    written('0x2001, value: 5', 'text', "'5'", key='.value'),
    written('0x2002, value: zz', 'bytes', '0A 1B', key='.value'),
    written('0x2003, value: 7', 'true or', 'false', key='.value'),
    written('0x1A00, sub_index: 0, value: 0', 'configures a PDO', 'below tpdo: 1:'),
    written('0x1402, sub_index: 1, value: 0', 'configures a PDO', 'below rpdo: 3:'),
    written('0x1017, value: 100', 'written by the master', 'set heartbeat_producer'),
    Case('error_behavior: {x: 1}', 'no sub-index', "'1: 0'"),
    Case('error_behavior: {2: 1}', '0x1029:02 is not in the EDS', 'sub-indices are 0, 1'),
]
FILES = [
    Case('dcf: other.eds', "no EDS 'other.eds'; looked for", 'put'),
    Case('dcf: 5', 'expected a text, got 5', "'5'"),
    Case(
        'dcf: $NOT_A_VARIABLE/x.eds',
        r'there is no EDS .\$NOT_A_VARIABLE/x.eds',
        'environment variable',
    ),
    Case(
        'heartbeat_consumer: true # <-\nheartbeat_multiplier: 2',
        'cannot watch the master: no writable 0x1016:01',
        'EDS that fits',
    ),
    Case('heartbeat_producer: 100', 'no heartbeat: 0x1017 is not in its EDS', 'EDS that fits'),
]


def check(folder: Path, case: Case, eds: str | None = None) -> None:
    """Assert that a case is reported with its line, key, message and remedy."""
    piece = case.piece if HERE in case.piece else f'{case.piece} {HERE}'
    text = added(case.section, piece)
    line = next(i for i, line in enumerate(text.splitlines(), 1) if HERE in line)
    path = write_bus(folder, text, eds=eds)
    problems = errors_of(path)
    assert any(
        (problem.file, problem.line) == (path, line)
        and problem.key == PREFIXES[case.section] + (case.key or path_of(case.piece))
        and re.search(case.message, problem.message)
        and re.search(case.remedy, problem.remedy)
        for problem in problems
    ), [str(problem) for problem in problems]


@pytest.mark.parametrize('case', KEYS + PDOS + WRITES, ids=lambda case: case.piece)
def test_what_is_wrong_is_refused(tmp_path: Path, case: Case) -> None:
    """Each is reported with its line, key, the value and what to write instead."""
    check(tmp_path, case)


@pytest.mark.parametrize('case', FILES, ids=lambda case: case.piece)
def test_what_the_eds_lacks_is_refused(tmp_path: Path, case: Case) -> None:
    """A missing EDS or object is reported at the key that wants it."""
    eds = eds_text().replace('[1016', '[2F16').replace('[1017', '[2F17')
    check(tmp_path, case, eds=eds)
