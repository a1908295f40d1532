# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What `canopen check` finds in a bus.yml: each at its file, line and key, with a remedy."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
import re
import shutil
from typing import NamedTuple

from config_samples import added, BUS, FLAT_BUS, load_text, TWO_AXES_EDS, write_bus
from eds_samples import DRIVE_ROWS, eds_text, Row
import pytest

from arm_canopen import load_bus
from arm_canopen.config import check_bus, check_file, Report
from arm_canopen.config.model.device_checks import period_setting
from canopen_core import Problem

HERE = '# <-'
"""Marks the line that a problem must name, the first one of a piece where there is none."""
PREFIXES = {'joint1': 'nodes.joint1.', 'top': ''}
DATA = Path(__file__).parent / 'data'
EDS = Path(__file__).parents[1] / 'eds' / 'cia402_drive.eds'

MORE_ROWS = (
    Row(0x1005, 0, 'COB-ID SYNC', 7, 'rw', '0x80'),
    Row(0x1006, 0, 'Communication cycle period', 7, 'rw', '0'),
    Row(0x1007, 0, 'Synchronous window length', 7, 'rw', '0'),
    Row(0x100C, 0, 'Guard time', 6, 'rw', '0'),
    Row(0x100D, 0, 'Life time factor', 5, 'rw', '0'),
    Row(0x1014, 0, 'COB-ID EMCY', 7, 'rw', '$NODEID+0x80'),
    Row(0x1019, 0, 'Synchronous counter overflow', 5, 'rw', '0'),
    Row(0x6502, 0, 'Supported drive modes', 7, 'ro', '0xA5'),
)
RICH_EDS = eds_text(
    [row for row in DRIVE_ROWS if row.subindex or row.index != 0x1016]
    + [Row(0x1016, 0, 'Highest sub-index', 5, 'const', '2'), *MORE_ROWS]
)
DEVICES = """\
  heartbeat_producer: 100
  position_mode: 8
  sdo:
    - {index: 0x60C2, sub_index: 1, value: 10}
  tpdo:
    1: {transmission: 1, mapping: [{index: 0x6041}, {index: 0x6064}]}
    2: {transmission: 255, cob_id: auto, inhibit_time: 100, mapping: [{index: 0x606C}]}
  rpdo:
    1: {transmission: 1, mapping: [{index: 0x6040}, {index: 0x607A}]}

nodes:
  joint2:
    node_id: 3
  joint1:
    node_id: 2
"""
CLEAN = BUS.partition('  tpdo:')[0] + DEVICES
"""A bus with nothing to report, also with the EDS of more objects."""


class Case(NamedTuple):
    """Keys of a section that are not right, and what is said or advised, as a pattern.

    The key of the problem is the path that the piece begins with where none is given.
    """

    piece: str
    said: str
    key: str = ''
    section: str = 'joint1'

    @property
    def path(self) -> str:
        """Key of the problem."""
        return PREFIXES.get(self.section, f'{self.section}.') + (self.key or path_of(self.piece))


def path_of(piece: str) -> str:
    """Return the keys that a piece begins with: ``tpdo.1`` of ``tpdo: {1: [``."""
    names, rest = [], piece.split('\n', maxsplit=1)[0]
    while match := re.match(r'\{?(\w+):(?: +|$)', rest):
        names.append(match[1])
        rest = rest[match.end() :]
    return '.'.join(names)


def mapped(text: str, said: str, key: str = '', direction: str = 'tpdo') -> Case:
    """Return the case of an entry of a mapping, from its index on."""
    piece = f'{direction}: {{1: {{mapping: [{{index: {text}}}]}}}}'
    return Case(piece, said, f'{direction}.1.mapping[0]{key}')


def written(text: str, said: str, key: str = '') -> Case:
    """Return the case of an entry of ``sdo``, from its index on."""
    return Case(f'sdo: [{{index: {text}}}]', said, f'sdo[0]{key}')


def master(piece: str, said: str, key: str = '') -> Case:
    """Return the case of keys of the master."""
    return Case(piece, said, key, 'master')


def top(piece: str, said: str, key: str = '') -> Case:
    """Return the case of a section."""
    return Case(piece, said, key, 'top')


LIFECYCLE = 'driver: "ros2_canopen::LifecycleCia402Driver"'
REFUSED = [
    Case('nod_id: 3', "mean 'node_id'"),
    Case('colour: red', 'unknown key .* known here: node_id'),
    Case('options: {}', 'belongs to the top level'),
    Case('node_id: 0', '0 is out of range; take 1 to 127'),
    Case('node_id: 255', '255 is out of range'),
    Case('node_id: two', "whole number, got 'two'"),
    Case('node_id: 010', 'ambiguous.* write 10'),
    Case('node_id: 1:30', 'base 60'),
    Case('node_id: 2.5', 'got 2.5'),
    Case('node_id:', 'got nothing'),
    Case('node_id: off', 'reads it as a boolean'),
    Case('mandatory: maybe', "got 'maybe'"),
    Case('mandatory: "false"', 'without quotes'),
    Case('namespace: on', 'as a boolean.* quotes'),
    Case('namespace: a b', "no ROS namespace .* like '/left/arm'"),
    Case('remappings: {a: 1}', 'in quotes'),
    Case('remappings: x', 'keys with values'),
    Case('scale_pos_to_dev: 0', '0 is out of range.* other than 0'),
    Case('scale_vel_to_dev: .nan', r'\.nan'),
    Case('switching_state: 7', '5 Operation ena'),
    Case('position_mode: 3', '8 Cyclic posit'),
    Case('heartbeat_multiplier: 0.5', 'below 1 every heartbeat'),
    Case('driver: "ros2_canopen::CIA402Driver"', "mean 'ros2_canopen::Cia402Driver'"),
    Case('driver: "ros2_canopen::MasterDriver"', 'for the master'),
    Case('driver: "ros2_canopen::CanopenDriver"', "mean 'ros2_canopen::Cia402Driver'"),
    Case('driver: Rocket', 'ProxyDriver'),
    Case(LIFECYCLE, 'is a lifecycle driver, but the master has a plain one'),
    Case('num_channels: 2', 'has 1 of 2 axes'),
    Case('channels: []', '0 entries for 1 channels'),
    Case('channel_names: [a, b]', '2 names for 1'),
    Case('recovery: always', "'always' is not allowed here; take one of: manual"),
    Case('software_file: x', 'vendor'),
    Case('eds: drive.eds\ndcf: drive.eds', "there are 'eds' and 'dcf'"),
    Case('scale_from_factor_group: true', 'no factor group'),
    Case('scale_from_factor_group: true\nscale_pos_to_dev: 5', 'given twice'),
    master('sync_period: 10', '10 ms is 10000'),
    master('sync_overflow: 1', '0 or 2 to 240'),
    master('baudrate: 42', '500 kbit/s'),
    master('baud_rate: 500', "mean 'baudrate'"),
    master('heartbeat_producer: 60000', 'is 180 s, devices wait at most 65.535 s'),
    master('driver: "ros2_canopen::ProxyDriver"', "for devices; take 'ros2_canopen::Master"),
    Case('perod: 10', "mean 'period'", section='defaults'),
    top('option: {dcf_path: "."}', "mean 'options'", 'option'),
    top('joint2: {node_id: 3}', "below 'nodes:'", 'joint2'),
    top('options: {heartbeat_multiplier: x}', "'x'"),
    Case('tpdo: [1]', 'got a list'),
    Case('tpdo: {9: {}}', r'TPDO 9 \(0x1808\).* 1, 2, 3'),
    Case('rpdo: {0: {}}', "'0' is no PDO number.* 1 to 512"),
    Case('tpdo: {1: }', "below '1:'"),
    Case('tpdo:\n  1: {enabled: true}\n  enabled: true # <-', 'below a PDO num', 'tpdo.enabled'),
    Case('tpdo:\n  1:\n    enabled: true\n  cob_id: auto # <-', 'no PDO number', 'tpdo.cob_id'),
    Case('tpdo: {1: {map: []}}', "'mapping'"),
    Case('tpdo: {1: {transmission: 252}}', 'remote frames'),
    Case('tpdo: {1: {inhibit_time: 70000}}', 'the unit is 100 microseconds'),
    Case('tpdo: {1: {cob_id: 0}}', "no 11-bit.* 'auto'"),
    Case('tpdo: {1: {cob_id: 0x80000181}}', "no 11-bit .*'enabled: false'"),
    Case('tpdo: {1: {cob_id: car}}', "got 'car'"),
    Case('tpdo: {1: {cob_id: 0x80}}', 'SYNC'),
    Case('tpdo: {5: {mapping: [{index: 0x6041}]}}', 'no COB-ID in the EDS', 'tpdo.5'),
    Case('tpdo: {2: {}}', 'maps nothing'),
    Case('tpdo: {1: {mapping: []}}', 'maps nothing', 'tpdo.1'),
    Case('tpdo: {1: {mapping: [x]}}', "an object, got 'x'", 'tpdo.1.mapping[0]'),
    mapped('0x6041, value: 1', 'entry of sdo', '.value'),
    mapped('0x6042', '0x6042:00 is not in the EDS'),
    mapped('0x6040', 'Controlword cannot be mapped into a TPDO .*access rww'),
    mapped('0x6041', 'Statusword cannot be mapped into a RPDO .*access ro', direction='rpdo'),
    mapped('0x6083', 'PDO mapping no'),
    mapped('0x1008', 'no fixed length .VISIBLE_STRING'),
    mapped('5', 'gap 0x0005 .UNSIGNED8. is for RPDOs only'),
    mapped('0x6064}, {index: 0x606C}, {index: 0x6041', 'have 80 bits together', '$'),
    mapped('0x2003}' + ', {index: 0x2003}' * 7 + ', {index: 0x2003', 'takes at most 8', '$'),
    Case('rpdo: {1: {sync_start: 5}}', 'belongs to a number below tpdo'),
    Case('sdo: 5', 'expected a list, got 5'),
    Case('sdo: [{value: 1}]', "no 'index'", 'sdo[0]'),
    written('0x6081, sub: 0, value: 1', "mean 'sub_index'", '.sub'),
    written('0x10000', '16 bits', '.index'),
    written('0x6082, value: 1', '0x6082:00 is not in the EDS .*drive.eds'),
    written('0x60C2, sub_index: 3, value: 1', 'sub-indices are 0, 1, 2'),
    written('0x6041, value: 1', '0x6041:00 Statusword is read-only'),
    written('0x6098, value: 200', 'for these bits write -56', '.value'),
    written('0x6081, value: 60000', '60000 is beyond its limits', '.value'),
    written('0x2000, value: -0.5', '0x2000:00 Gain: -0.5 is beyond its limits', '.value'),
    written('0x2001, value: 5', "'5'", '.value'),
    written('0x2002, value: zz', '0A 1B', '.value'),
    written('0x2003, value: 7', 'true or', '.value'),
    written('0x1A00, sub_index: 0, value: 0', 'below tpdo: 1:'),
    written('0x1017, value: 100', 'set heartbeat_producer'),
    Case('error_behavior: {x: 1}', 'no sub-index'),
    Case('error_behavior: {2: 1}', '0x1029:02 is not in the EDS'),
]
WITHOUT_HEARTBEAT = eds_text().replace('[1016', '[2F16').replace('[1017', '[2F17')
LACKING = [
    Case('dcf: other.eds', "no EDS 'other.eds'; looked for"),
    Case('dcf: 5', 'expected a text, got 5'),
    Case('dcf: $NOT_A_VARIABLE/x.eds', r'\$NOT_A_VARIABLE/x.eds.* environment variable'),
    Case('heartbeat_consumer: true # <-\nheartbeat_multiplier: 2', 'no writable 0x1016:01'),
    Case('heartbeat_producer: 100', '0x1017 is not in its EDS'),
    Case('heartbeat_producer: 0\nguard_time: 150 # <-', 'no writable 0x100C', 'guard_time'),
]

NO_SYNC = CLEAN.replace('  sync_period: 10000\n', '')
APART = 'rpdo: {1: {mapping: [{index: 0x6040}]}, 2: {mapping: [{index: 0x607A}]}}'
TPDO_2, RPDO_1 = 'tpdo: {{2: {{{}}}}}', 'rpdo: {{1: {{{}}}}}'
INHIBIT = 'tpdo.2.inhibit_time'
WARNINGS = [
    written('0x60C2, sub_index: 1, value: 50', '50 ms, but SYNC .* value 10 to .* -3 to'),
    Case('position_mode: 8 # <-\nsdo: []', 'not written, by the EDS 1 ms, but SYNC'),
    Case(APART, 'late or lost.* map both into one', 'rpdo.2'),
    Case('velocity_mode: 3', r'mode 3 .profile velocity. go by SDO, .* 0x60FF'),
    Case('position_mode: 7', r'mode 7 .* the EDS names in 0x6502 \(0xA5\)'),
    Case('tpdo: {1: {mapping: [{index: 0x6041}]}}', 'no enabled TPDO carries 0x6064', '^position'),
    Case('tpdo: {1: {transmission: 4}}', '0x6064 .* only with every 4th', 'tpdo.1.transmission'),
    Case('rpdo: {1: {transmission: 255}}', 'when its frame arrives', 'rpdo.1.transmission'),
    Case(TPDO_2.format('sync_start: 3'), 'the SYNC has no counter', 'tpdo.2.sync_start'),
    Case(RPDO_1.format('event_deadline: 10'), 'after 10 ms', 'rpdo.1.event_deadline'),
    Case(TPDO_2.format('transmission: 2, inhibit_time: 9'), 'sent with SYNC', INHIBIT),
    Case(TPDO_2.format('event_timer: 5, inhibit_time: 100'), '10 ms is longer', INHIBIT),
    Case(TPDO_2.format('inhibit_time: 0'), '0x606C .* never stands still', 'tpdo.2'),
    Case('heartbeat_producer: 0', 'the device sends no heartbeat'),
    master('heartbeat_consumer: false', 'does not watch the heartbeats'),
    Case('heartbeat_multiplier: 1.2', 'waits 120 ms for .* every 100 ms'),
    master('heartbeat_producer: 0', 'no device notices when it dies'),
    master('heartbeat_producer: 3', r'wait 9 ms .* every 10 ms \(with a cycle\)'),
    Case('reset_communication: false', 'shall be taken over as it runs, but watches'),
    Case('heartbeat_consumer: false', 'the drive does not watch the master'),
    written('0x1005, value: 0x81', 'waits for SYNC on 0x081, the master sends 0x080'),
    written('0x1006, value: 4000', 'every 4000 us .0x1006., it comes every 10000 us'),
    written('0x1007, value: 10000', 'window of 10000 us .* as long as the SYNC period'),
    written('0x1019, value: 10', 'to end at 10 .0x1019., the master counts to 0'),
    written('0x6081, value: 1}, {index: 0x6081, value: 2', 'again in line 26 with another value'),
    Case('period: 20', 'every 10 ms, not every 20 ms'),
    Case('scale_pos_to_dev: 57.3', 'is 0.0573, not 1'),
    Case('scale_vel_from_dev: 2', 'is 2000, not 1'),
    Case('scale_eff_from_dev: 0.001', 'is 0.001, not 1'),
    master('vendor_id: 0x360', 'known, not used yet'),
    master('error_behavior: {1: 1}', 'known, not used yet', 'error_behavior'),
    Case('eds: drive.eds', "'eds' is taken for 'dcf'"),
    Case('switching_state: 8', '8 is Fault'),
    Case('rpdo: {1: {enabled: false}}', 'no enabled RPDO carries 0x6040', '$'),
    Case('tpdo: {1: {enabled: false}}', 'no enabled TPDO carries 0x6041', '$'),
    Case('guard_time: 150', 'sends a heartbeat every 100 ms'),
    Case(
        'sdo: [{index: 0x6081, value: 0}]\nposition_mode: 1', '0x6081 .* is 0: in mode 1', 'sdo[0]'
    ),
]
"""Beside the clean bus."""
ERRORS = [
    written('0x1014, value: 0x80', '0x080 is the identifier of SYNC', '.value'),
    written('0x1005, value: 0x40000080', 'sends SYNC itself'),
    written('0x1014, value: 0x183', 'of EMCY of joint1 is also that of TPDO 1 of joint2'),
]
SILENT = (
    *('polling: true', 'period: 10', 'non_transmit_timeout: 100', 'enable_lazy_load: false'),
    *('diagnostics: {enable: true, period: 1000}', 'num_channels: 1', 'guard_time: 0'),
    *('boot: true', 'software_file: ""', 'restore_configuration: 0', 'retry_factor: 3'),
    *('revision_number: 0', 'heartbeat_producer: 0\nguard_time: 200\nlife_time_factor: 3'),
    *('master.vendor_id: 0', 'master.start: true', 'master.boot_time: 0'),
)
"""Keys whose request is met anyway, or that say the default."""


def report_of(folder: Path, text: str = CLEAN, eds: str = RICH_EDS) -> Report:
    """Check a text."""
    return check_file(write_bus(folder, text, eds=eds))


def listed(problems: tuple[Problem, ...], said: str) -> list[Problem]:
    """Return the problems that say something."""
    return [each for each in problems if re.search(said, f'{each.message}; {each.remedy}')]


TABLES = (
    ('errors', REFUSED, BUS, eds_text()),
    ('errors', LACKING, BUS, WITHOUT_HEARTBEAT),
    ('errors', ERRORS, CLEAN, RICH_EDS),  # although each key by itself is fine
    ('warnings', WARNINGS, CLEAN, RICH_EDS),  # it can be loaded all the same
)


@pytest.mark.parametrize(
    ('kind', 'case', 'base', 'eds'),
    [(kind, case, base, eds) for kind, cases, base, eds in TABLES for case in cases],
    ids=[f'{kind}-{case.piece}' for kind, cases, *_ in TABLES for case in cases],
)
def test_what_is_found(tmp_path: Path, kind: str, case: Case, base: str, eds: str) -> None:
    """At its line and key, with a remedy: what is refused, and what runs and disappoints."""
    first, *rest = case.piece.split('\n')
    piece = case.piece if HERE in case.piece else '\n'.join([f'{first} {HERE}', *rest])
    text = added(case.section, piece, base)
    report = report_of(tmp_path, text, eds)
    assert kind == 'errors' or report.errors == ()
    problems = report.errors if kind == 'errors' else report.warnings
    found = [each for each in listed(problems, case.said) if each.remedy]
    assert found, problems
    if '$' not in case.path and '^' not in case.path:  # else it is of what stands around it
        line = next(i for i, row in enumerate(text.splitlines(), 1) if HERE in row)
        assert (line, case.path) in [(each.line, each.key) for each in found], problems


@pytest.mark.parametrize('piece', ['', *SILENT])
def test_what_requests_nothing_is_no_warning(tmp_path: Path, piece: str) -> None:
    """Of the clean bus, too."""
    section, _, key = piece.rpartition('master.')
    text = added('master' if section or 'master.' in piece else 'joint1', key, CLEAN)
    report = report_of(tmp_path, text)
    assert report.errors == report.warnings == ()


NODES_LIST = BUS.replace('nodes:\n  joint1:\n    node_id: 2', 'nodes:\n  - joint1: {node_id: 2}')
PROXY = BUS.replace('Cia402Driver', 'ProxyDriver').replace('402_driver', 'proxy_driver')
LAYOUTS = [
    (NODES_LIST, 20, "'nodes' is a list"),
    (BUS.partition('nodes:')[0], 0, "'defaults' but no 'nodes'"),
    (BUS.partition('  joint1:')[0], 20, 'there are no devices'),
    (BUS.partition('    node_id: 2')[0], 21, 'a device with its keys, got nothing'),
    (BUS.replace('nodes:', 'node:'), 20, "mean 'nodes'"),
    (FLAT_BUS.partition('joint1')[0], 0, 'there are no devices'),
    (FLAT_BUS.replace('master:', 'mastr:'), 2, "mean 'master'"),
    (FLAT_BUS.replace('master:', 'mastr:'), 0, "no section 'master'"),
    (FLAT_BUS.replace('master:', 'mastr:'), 0, "no 'driver'"),
    (FLAT_BUS.replace('  node_id: 2\n', ''), 4, "no 'node_id'"),
    (BUS.replace('  node_id: 1\n', ''), 1, "no 'node_id'"),
    (BUS.replace('joint1', 'joint-1'), 21, "'joint-1' is no name"),
    (added('nodes', 'joint2: {node_id: 2}'), 23, 'is also that of joint1 .line 22'),
    (BUS.replace('node_id: 2', 'node_id: 1'), 22, 'is also that of the master .line 2'),
    (f'options:\n  master: {{node_id: 9}}\n{BUS}', 2, 'unknown|belongs'),
    (f'{BUS}    tpdo: {{1: }}\n', 23, "below '1:'"),
    (PROXY.replace('  dcf: drive.eds\n', ''), 20, "no 'dcf'"),
]


@pytest.mark.parametrize(('text', 'line', 'said'), LAYOUTS, ids=lambda value: str(value)[-24:])
def test_wrong_layouts_are_refused(tmp_path: Path, text: str, line: int, said: str) -> None:
    """Missing, doubled and misplaced sections and devices."""
    errors = report_of(tmp_path, text, eds_text()).errors
    assert line in [each.line for each in listed(errors, said)], errors


def test_the_prbt_guide_loads_as_printed(tmp_path: Path) -> None:
    """Sections below options, PDOs whose keys are not indented: each slip is reported."""
    shutil.copy(EDS, tmp_path / 'prbt_0_1.dcf')
    path = shutil.copy(DATA / 'prbt_guide.yml', tmp_path / 'bus.yml')
    bus = load_bus(path)
    lines = Path(path).read_text().splitlines()
    assert [node.name for node in bus.nodes] == [f'prbt_joint_{n}' for n in range(1, 7)]
    assert bus.master.sync_period == pytest.approx(0.01)
    for node in bus.nodes:
        assert node.drive.position_mode == 7
        assert [pdo.enabled for pdo in node.tpdos] == [True, True, False, False]
        assert [mapped.index for mapped in node.rpdos[0].mapping] == [0x6040, 0x6060, 0x60C1]
        assert [mapped.index for mapped in node.tpdos[1].mapping] == [0x6064, 0x606C]
    slips = [lines[w.line - 1].strip() for w in bus.warnings if 'indented' in w.message]
    assert set(slips) == {'master:', 'defaults:', 'nodes:', '1:', '2:', '3:', '4:'}
    assert len(slips) == 3 + 4 + 2


def test_all_problems_are_reported_at_once(tmp_path: Path) -> None:
    """Of all sections and files, in the order of the lines; warnings come along."""
    text = added(
        'joint1', 'colour: red\nsdo: [{index: 0x6082}]\nmandatory: 7\nscale_vel_from_dev: 2'
    )
    report = report_of(tmp_path, text.replace('sync_period: 10000', 'sync_period: 1'))
    lines = [problem.line for problem in report.errors]
    assert lines == sorted(lines)
    assert len(lines) == 4
    assert listed(report.warnings, 'is 2000, not 1')
    assert check_file(tmp_path / 'none.yml').load is None


def test_what_defaults_or_an_eds_have_wrong_is_reported_once(tmp_path: Path) -> None:
    """However many devices share it; a loaded bus is checked as its file is."""
    text = added('defaults', 'velocity_mode: 3', CLEAN)
    path = write_bus(tmp_path, text, eds=RICH_EDS.replace('DefaultValue=1.5', 'DefaultValue=one'))
    report = check_file(path)
    assert [w.file.name for w in listed(report.warnings, "'one'|go by SDO")] == [
        'bus.yml',
        'drive.eds',
    ]
    checked = check_bus(load_bus(path)).warnings
    assert listed(checked, 'SDO') == listed(report.warnings, 'SDO')


def with_default_mapping(*words: str, index: str = '1A01') -> str:
    """Return an EDS with another default mapping of TPDO 2, or of another PDO."""
    lines = eds_text().splitlines()
    start = lines.index(f'[{index}sub0]')
    for offset, value in enumerate((str(len(words)), *words)):
        section = lines.index(f'[{index}sub{offset}]', start)
        place = next(i for i in range(section, len(lines)) if lines[i].startswith('DefaultValue'))
        lines[place] = f'DefaultValue={value}'
    return '\n'.join(lines)


def unsigned(index: int) -> str:
    """Return an EDS that types an object as UNSIGNED32."""
    return eds_text(replace(row, data_type=7) if row.index == index else row for row in DRIVE_ROWS)


def fixed_tpdos() -> str:
    """Return an EDS whose TPDOs always carry the statusword."""
    head, mark, tail = eds_text().partition('[1A00]')
    count = 'ParameterName=Number of objects\nDataType=0x0005\nAccessType='
    first = 'ParameterName=Object 1\nDataType=0x0007\nAccessType='
    tail = tail.replace(f'{count}rw\nDefaultValue=0', f'{count}const\nDefaultValue=1')
    tail = tail.replace(f'{first}rw\nDefaultValue=0', f'{first}const\nDefaultValue=0x60410010')
    return head + mark + tail


def in_pdo(index: int) -> str:
    """Return the key that maps an object."""
    kind, first = ('tpdo', 0x6041) if index in (0x6064, 0x606C) else ('rpdo', 0x6040)
    return f'{kind}: {{1: {{mapping: [{{index: 0x{first:X}}}, {{index: 0x{index:X}}}]}}}}'


FIXED_HEARTBEAT = eds_text().replace(
    'Producer heartbeat time\nDataType=0x0006\nAccessType=rw\nDefaultValue=0',
    'Producer heartbeat time\nDataType=0x0006\nAccessType=ro\nDefaultValue=250',
)
LIMITED = RICH_EDS.replace(
    'ParameterName=Consumer heartbeat time\n',
    'ParameterName=Consumer heartbeat time\nHighLimit=0x00010100\n',
)
OTHER_PROFILE = eds_text().replace('0x00020192', '0x00020191')
TWO_AXES = TWO_AXES_EDS.read_text('utf-8')
TWO = 'num_channels: 2'
JOINT2 = 'joint2: {node_id: 3}'
KEPT = 'heartbeat_consumer: false\nreset_communication: false'
BY_EDS: list[tuple[str, str, str, int]] = [
    *(
        (unsigned(index), in_pdo(index), f'!0x{index:04X}:00 as UNSIGNED32', 1)
        for index in (0x607A, 0x60FF, 0x6064, 0x606C)
    ),
    (eds_text(), in_pdo(0x607A), 'as UNSIGNED32', 0),
    (unsigned(0x607A), '', 'as UNSIGNED32', 0),
    (unsigned(0x607A), f'driver: "ros2_canopen::ProxyDriver"\n{in_pdo(0x607A)}', 'as UNSIGN', 0),
    (OTHER_PROFILE, '', 'profile 401, whose objects', 1),
    (FIXED_HEARTBEAT, 'heartbeat_producer: 100', '!fixed at 250 ms', 1),
    (FIXED_HEARTBEAT, 'heartbeat_producer: 250', 'fixed at', 0),
    (
        fixed_tpdos(),
        'tpdo: {1: {mapping: [{index: 0x6064}]}}',
        '!mapping of TPDO 1 .* is fixed',
        1,
    ),
    (with_default_mapping('0x70000020'), '', '0x7000:00, which is not there; taken as UNSI', 1),
    (with_default_mapping('0x60410090', '0x606400A0'), '', 'bit 7 of the length is set', 1),
    (
        with_default_mapping('0x607A0020', index='1601').replace('$NODEID+0x300', '0x6A0'),
        JOINT2,
        '!COB-ID 0x6A0 of RPDO 2 of joint2 is also that of RPDO 2 of joint1',
        1,
    ),
    (RICH_EDS.replace('=$NODEID+0x80', '=0x91'), '', 'EMCY COB-ID 0x091 .* is not that of', 1),
    (RICH_EDS.replace('=$NODEID+0x80', '=0x80'), '', 'EMCY COB-ID', 0),
    (RICH_EDS.replace('=$NODEID+0x80', '=0'), '', 'EMCY COB-ID', 0),
    (LIMITED, 'heartbeat_producer: 100', '0x1016:01 takes at most.* heartbeat_consumer: false', 1),
    (eds_text(), KEPT, 'does not boot this way', 1),
    (RICH_EDS, KEPT, 'does not boot this way', 0),
    (FIXED_HEARTBEAT, KEPT, 'does not boot this way', 0),
    (TWO_AXES, TWO, 'joint1_1 cannot be (enabled|watched) in the cycle', 2),
    (TWO_AXES, f'{TWO}\nchannels: [{{scale_pos_to_dev: 57.3}}, {{}}]', 'is 0.0573, not 1', 1),
    (TWO_AXES, f"{TWO}\nchannel_names: [elbow, 'left arm']", '!no name for a ROS node', 1),
    (TWO_AXES, f"{TWO}\nchannel_names: [elbow, '1st']", '!no name for a ROS node', 1),
    (TWO_AXES, f"{TWO}\nchannel_names: [elbow, '']", '!no name for a ROS node', 1),
    (TWO_AXES, f'{TWO}\nchannel_names: [a, a]', "!both have an axis 'a'", 1),
    (TWO_AXES, f'{TWO}\nchannel_names: [joint2, elbow]', "!both have an axis 'joint2'", 1),
]


@pytest.mark.parametrize(
    ('eds', 'piece', 'said', 'count'), BY_EDS, ids=lambda each: str(each)[:40]
)
def test_what_bus_yml_and_the_eds_say_together(
    tmp_path: Path, eds: str, piece: str, said: str, count: int
) -> None:
    """As often as it should be reported, with a line of its file; `!` begins what is an error."""
    text = added('joint1', piece)
    if JOINT2 in piece or 'joint2' in said:
        text = added('nodes', JOINT2, text.replace(JOINT2, ''))
    report = report_of(tmp_path, text, eds)
    found = listed(report.errors + report.warnings, said.removeprefix('!'))
    assert len(found) == count
    assert all(problem.line for problem in found)
    assert all((problem in report.errors) == said.startswith('!') for problem in found)


@pytest.mark.parametrize(
    ('literal', 'commissioned', 'kept'),
    [('0x285', '', False), ('0x280', '', False), ('0x285', '5', False), ('0x285', '2', True)],
)
def test_identifiers_of_an_eds_without_node_id(
    tmp_path: Path, literal: str, commissioned: str, *, kept: bool
) -> None:
    """Each device has that of its own node id, reported and compared at boot; a DCF's is meant."""
    eds = with_default_mapping('0x60640020').replace('$NODEID+0x280', literal)
    bus = load_text(tmp_path, eds=f'{eds}\n[DeviceComissioning]\nNodeID={commissioned}\n')
    tpdo = bus.nodes[0].tpdos[1]
    assert (tpdo.cob_id, tpdo.assumed) == (0x285 if kept else 0x282, not kept)
    assert len(listed(bus.warnings, f'COB-ID {literal} .* taken to have 0x282.* auto')) == (
        not kept
    )


def test_a_drive_without_eds_is_a_drive_of_the_standard(tmp_path: Path) -> None:
    """It is reported, its identity not checked, and it has no PDO that bus.yml does not name."""
    config = load_text(tmp_path, BUS.replace('  dcf: drive.eds\n', ''))
    assert [warning.key for warning in listed(config.warnings, "no 'dcf'")] == ['nodes.joint1']
    (node,) = config.nodes
    assert not any(getattr(node.identity, name) for name in ('device_type', 'vendor_id'))
    assert all(pdo.configured for pdo in (*node.tpdos, *node.rpdos) if pdo.enabled)


def test_odd_mappings_of_an_eds_are_taken_as_far_as_they_are_understood(tmp_path: Path) -> None:
    """So that the device is read as it sends."""
    for eds, words, fixed in (
        (fixed_tpdos(), [0x6041_0010], True),  # read-only: used as it is, and marked so
        (with_default_mapping('0x70000020'), [0x7000_0020], False),  # unknown: by its length
        # bit 7 of a length belongs to the vendor
        (with_default_mapping('0x60410090', '0x606400A0'), [0x6041_0010, 0x6064_0020], False),
    ):
        (node,) = load_text(tmp_path, eds=eds).nodes
        assert [mapped.word for mapped in node.tpdos[1].mapping] == words, eds
        assert [pdo.fixed_mapping for pdo in node.tpdos] == [fixed] * 6, eds


def test_sync_that_is_missing(tmp_path: Path) -> None:
    """A cyclic mode and a synchronous PDO need it, a start value one of a counter."""
    found = report_of(tmp_path, added('joint1', 'effort_mode: 10', NO_SYNC)).warnings
    assert listed(found, 'mode 10 .* needs SYNC')
    assert listed(found, 'TPDO 1 of joint1 waits for SYNC')
    text = added('master', 'sync_overflow: 10', CLEAN)
    text = added('joint1', TPDO_2.format('sync_start: 20'), text)
    (error,) = report_of(tmp_path, text).errors
    assert error.key == 'nodes.joint1.tpdo.2.sync_start'


@pytest.mark.parametrize(
    ('bitrate', 'kind'),
    [(1_000_000, None), (250_000, None), (100_000, 'warning'), (50_000, 'error')],
)
def test_load(tmp_path: Path, bitrate: int, kind: str | None) -> None:
    """The load by hand: 70 % is a warning, more than the bus carries an error.

    A second has 100 SYNC of 0 bytes, 400 PDOs of 6 bytes, 200 TPDOs of 4 bytes, 25 heartbeats of
    1 byte, and 200 SDOs of 8 bytes: 0x6061 of two drives is polled every 10 ms and a cycle. Bits
    of a frame of n bytes: 47 + 8n, and stuffing of (33 + 8n) / 30 on average.
    """
    report = check_file(write_bus(tmp_path, CLEAN, eds=RICH_EDS), bitrate)
    assert report.load is not None
    bits = 100 * (47 + 33 / 30) + 400 * (95 + 81 / 30) + 200 * (79 + 65 / 30)
    bits += 25 * (55 + 41 / 30) + 200 * (111 + 97 / 30)
    assert report.load.frames_per_second == pytest.approx(925)
    assert report.load.load == pytest.approx(bits / bitrate)
    assert report.load.load_worst > report.load.load
    assert bool(listed(report.errors, 'frames/s')) == (kind == 'error')
    assert bool(listed(report.warnings, 'frames/s')) == (kind == 'warning')


def test_rates(tmp_path: Path) -> None:
    """Each kind of TPDO has its rate, and the reason is reported; guarding is sent both ways."""
    for keys, service, reason, rate in (
        (TPDO_2.format('event_timer: 50'), 'TPDO 2', 'on change, taken as every 10 ms', 100),
        (TPDO_2.format('inhibit_time: 400'), 'TPDO 2', 'taken as every 40 ms', 25),
        (TPDO_2.format('event_timer: 10'), 'TPDO 2', 'event timer 10 ms', 100),
        (TPDO_2.format('transmission: 5'), 'TPDO 2', 'every 5th SYNC', 20),
        (TPDO_2.format('transmission: 0'), 'TPDO 2', 'with SYNC on change', 100),
        ('heartbeat_producer: 0\nguard_time: 200', 'guarding', '', 5),
    ):
        report = report_of(tmp_path, added('joint1', keys, CLEAN))
        assert report.load is not None, keys
        found = [t for t in report.load.traffic if (t.device, t.service) == ('joint1', service)]
        assert [item.rate for item in found] == pytest.approx([rate] * len(found)), keys
        assert reason in found[0].reason, keys
        assert [t.size for t in found] == ([0, 1] if service == 'guarding' else [4]), keys


@pytest.mark.parametrize(
    ('period', 'setting'),
    [(0.01, (10, -3)), (0.0025, (25, -4)), (0.000125, (125, -6)), (0.3, None), (0.00123456, None)],
)
def test_setting_of_a_period(period: float, setting: tuple[int, int] | None) -> None:
    """The remedy is what 0x60C2 can hold, in its coarsest unit."""
    assert period_setting(period) == setting
