# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a bus.yml may say and should not: each reported at its line, and only when it is wrong."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
import random
import re
from typing import NamedTuple

from config_mutations import mutated
from config_samples import DRIVE_ROWS, eds_text, Row, write_bus
import pytest

from arm_canopen.config import check_file, load_bus, load_eds, Problem
from arm_canopen.config.model.checks import check_bus, Report
from arm_canopen.config.model.checks.drives import period_setting

HERE = '# <-'

MORE_ROWS = (
    Row(0x1005, 0, 'COB-ID SYNC', 7, 'rw', '0x80'),
    Row(0x1006, 0, 'Communication cycle period', 7, 'rw', '0'),
    Row(0x1007, 0, 'Synchronous window length', 7, 'rw', '0'),
    Row(0x100C, 0, 'Guard time', 6, 'rw', '0'),
    Row(0x100D, 0, 'Life time factor', 5, 'rw', '0'),
    Row(0x1014, 0, 'COB-ID EMCY', 7, 'rw', '$NODEID+0x80'),
    Row(0x1019, 0, 'Synchronous counter overflow', 5, 'rw', '0'),
    Row(0x1200, 0, 'Highest sub-index', 5, 'const', '2'),
    Row(0x1200, 1, 'Client to server', 7, 'ro', '$NODEID+0x600'),
    Row(0x1200, 2, 'Server to client', 7, 'ro', '$NODEID+0x580'),
    Row(0x6502, 0, 'Supported drive modes', 7, 'ro', '0xA5'),
)
EDS = eds_text(
    [row for row in DRIVE_ROWS if row.subindex or row.index != 0x1016]
    + [Row(0x1016, 0, 'Highest sub-index', 5, 'const', '2'), *MORE_ROWS]
)

CLEAN = """\
master:
  node_id: 1
  driver: "ros2_canopen::MasterDriver"
  package: "canopen_master_driver"
  sync_period: 10000
  # master

defaults:
  dcf: drive.eds
  driver: "ros2_canopen::Cia402Driver"
  package: "canopen_402_driver"
  heartbeat_producer: 100
  # defaults
  position_mode: 8
  sdo:
    - {index: 0x60C2, sub_index: 1, value: 10}
    # sdo
  tpdo:
    1:
      transmission: 1
      mapping: [{index: 0x6041}, {index: 0x6064}]
    2:
      transmission: 255
      cob_id: auto
      # tpdo 2
      inhibit_time: 100
      mapping: [{index: 0x606C}]
  rpdo:
    1:
      transmission: 1
      mapping: [{index: 0x6040}, {index: 0x607A}]
      # rpdo 1

nodes:
  joint1:
    node_id: 2
    # joint1
  joint2:
    node_id: 3
"""
"""A bus without anything to report; comments are where cases put their keys."""


class Case(NamedTuple):
    """A bus that is not right."""

    old: str  # what of the clean bus is replaced
    new: str  # by what; the mark is in the line that has to be named
    key: str  # key path of the problem
    message: str  # pattern of what is said
    remedy: str  # pattern of what is advised


SYNC = '  sync_period: 10000\n'
RPDO = 'mapping: [{index: 0x6040}, {index: 0x607A}]\n'
WRITE = '- {index: 0x60C2, sub_index: 1, value: 10}'

WARNINGS = {
    'interpolation period': Case(
        WRITE,
        f'{WRITE[:-3]}50}} {HERE}',
        'defaults.sdo[0]',
        r'0x60C2 \(interpolation period\) is 50 ms, but SYNC comes every 10 ms',
        'write value 10 to sub-index 1 and -3 to sub-index 2',
    ),
    'interpolation period of the EDS': Case(
        f'  position_mode: 8\n  sdo:\n    {WRITE}\n',
        f'  position_mode: 8 {HERE}\n',
        'defaults.position_mode',
        '0x60C2 .* is not written, by the EDS 1 ms, but SYNC',
        'write value 10',
    ),
    'target apart, at once': Case(
        RPDO,
        'mapping: [{index: 0x6040}]\n'
        f'    2: {HERE}\n      transmission: 255\n      mapping: [{{index: 0x607A}}]\n',
        'defaults.rpdo.2',
        r'0x607A \(target position\) is in RPDO 2, the controlword .* in RPDO 1: they take',
        'map both into one RPDO',
    ),
    'target apart, with SYNC': Case(
        RPDO,
        'mapping: [{index: 0x6040}]\n'
        f'    2: {HERE}\n      transmission: 1\n      mapping: [{{index: 0x607A}}]\n',
        'defaults.rpdo.2',
        'both take effect with SYNC, but one of the frames may be lost',
        'map both into one RPDO',
    ),
    'target not mapped': Case(
        '  position_mode: 8\n',
        f'  position_mode: 8\n  velocity_mode: 3 {HERE}\n',
        'defaults.velocity_mode',
        r'the targets of mode 3 \(profile velocity\) go by SDO, .* 0x60FF \(target velocity\)',
        'map it below rpdo',
    ),
    'mode not supported': Case(
        '  position_mode: 8\n',
        f'  position_mode: 7 {HERE}\n',
        'defaults.position_mode',
        r'mode 7 .* is not among the modes that the EDS names in 0x6502 \(0xA5\)',
        'another mode',
    ),
    'cyclic mode without SYNC': Case(
        f'{SYNC}  # master\n\ndefaults:\n',
        f'defaults:\n  effort_mode: 10 {HERE}\n',
        'defaults.effort_mode',
        'mode 10 .* needs SYNC',
        'sync_period: 10000',
    ),
    'feedback not mapped': Case(
        ', {index: 0x6064}]',
        ']',
        'defaults.position_mode',
        r'no enabled TPDO carries 0x6064 \(position actual\)',
        'map it below tpdo',
    ),
    'feedback too seldom': Case(
        '      transmission: 1\n      mapping: [{index: 0x6041}, {index: 0x6064}]',
        f'      transmission: 4 {HERE}\n      mapping: [{{index: 0x6041}}, {{index: 0x6064}}]',
        'defaults.tpdo.1.transmission',
        r'0x6064 \(position actual\) comes only with every 4th SYNC',
        'transmission: 1',
    ),
    'target at once': Case(
        '      transmission: 1\n      mapping: [{index: 0x6040}',
        f'      transmission: 255 {HERE}\n      mapping: [{{index: 0x6040}}',
        'defaults.rpdo.1.transmission',
        'the target of mode 8 takes effect when its frame arrives',
        'transmission: 1',
    ),
    'start value without counter': Case(
        '# tpdo 2',
        f'sync_start: 3 {HERE}',
        'defaults.tpdo.2.sync_start',
        'the SYNC has no counter',
        'sync_overflow',
    ),
    'deadline within the cycle': Case(
        '# rpdo 1',
        f'event_deadline: 10 {HERE}',
        'defaults.rpdo.1.event_deadline',
        'misses RPDO 1 after 10 ms, but it comes every 10 ms',
        'at least 20',
    ),
    'inhibit time with SYNC': Case(
        '      transmission: 255\n      cob_id: auto\n      # tpdo 2\n      inhibit_time: 100\n',
        f'      transmission: 2\n      cob_id: auto\n      inhibit_time: 100 {HERE}\n',
        'defaults.tpdo.2.inhibit_time',
        r'inhibit_time has no effect: TPDO 2 is sent with SYNC \(transmission 2\)',
        'remove it',
    ),
    'inhibit time above event timer': Case(
        '      inhibit_time: 100\n',
        f'      event_timer: 5\n      inhibit_time: 100 {HERE}\n',
        'defaults.tpdo.2.inhibit_time',
        'inhibit_time 10 ms is longer than event_timer 5 ms',
        'unit 0.1 ms',
    ),
    'restless object without inhibit time': Case(
        '    2:\n      transmission: 255\n      cob_id: auto\n      # tpdo 2\n'
        '      inhibit_time: 100\n',
        f'    2: {HERE}\n      transmission: 255\n      cob_id: auto\n',
        'defaults.tpdo.2',
        r'0x606C \(velocity actual\) never stands still',
        'inhibit_time',
    ),
    'no heartbeat': Case(
        '    node_id: 2\n',
        f'    node_id: 2\n    heartbeat_producer: 0 {HERE}\n',
        'nodes.joint1.heartbeat_producer',
        'the device sends no heartbeat',
        'heartbeat_producer: 100',
    ),
    'heartbeat not watched': Case(
        '# master',
        f'heartbeat_consumer: false {HERE}',
        'master.heartbeat_consumer',
        'does not watch the heartbeats',
        'remove',
    ),
    'heartbeat watched too closely': Case(
        '# joint1',
        f'heartbeat_multiplier: 1.2 {HERE}',
        'nodes.joint1.heartbeat_multiplier',
        'waits 120 ms for a heartbeat that comes every 100 ms',
        '3 is usual',
    ),
    'master without heartbeat': Case(
        '# master',
        f'heartbeat_producer: 0 {HERE}',
        'master.heartbeat_producer',
        'no device notices when it dies',
        'heartbeat_producer: 200',
    ),
    'master watched too closely': Case(
        '# master',
        f'heartbeat_producer: 3 {HERE}',
        'master.heartbeat_producer',
        r'wait 9 ms for the heartbeat of the master, which comes every 10 ms \(with a cycle\)',
        '3 is usual',
    ),
    'drive that is kept alive and watches': Case(
        '# joint1',
        f'reset_communication: false {HERE}',
        'nodes.joint1.reset_communication',
        'shall be taken over as it runs, but watches the master',
        'heartbeat_consumer: false',
    ),
    'drive that does not watch': Case(
        '# joint1',
        f'heartbeat_consumer: false {HERE}',
        'nodes.joint1.heartbeat_consumer',
        'the drive does not watch the master',
        'remove',
    ),
    'SYNC elsewhere': Case(
        '# sdo',
        f'- {{index: 0x1005, value: 0x81}} {HERE}',
        'defaults.sdo[1]',
        'waits for SYNC on 0x081, the master sends 0x080',
        '0x80 to 0x1005',
    ),
    'another cycle period': Case(
        '# sdo',
        f'- {{index: 0x1006, value: 4000}} {HERE}',
        'defaults.sdo[1]',
        'expects SYNC every 4000 us .0x1006., it comes every 10000 us',
        'write 10000',
    ),
    'window as long as the period': Case(
        '# sdo',
        f'- {{index: 0x1007, value: 10000}} {HERE}',
        'defaults.sdo[1]',
        'window of 10000 us .* as long as the SYNC period',
        'less than 10000',
    ),
    'another SYNC counter': Case(
        '# sdo',
        f'- {{index: 0x1019, value: 10}} {HERE}',
        'defaults.sdo[1]',
        'counter to end at 10 .0x1019., the master counts to 0',
        'write 0',
    ),
    'written twice': Case(
        '# sdo',
        f'- {{index: 0x6081, value: 1}} {HERE}\n    - {{index: 0x6081, value: 2}}',
        'defaults.sdo[1]',
        '0x6081:00 is written again in line 18 with another value',
        'keep one',
    ),
}

ERRORS = {
    'EMCY in the place of SYNC': Case(
        '    node_id: 2\n',
        f'    node_id: 2\n    sdo: [{{index: 0x1014, value: 0x80}}] {HERE}\n',
        'nodes.joint1.sdo[0].value',
        '0x080 is the identifier of SYNC, and not for EMCYs',
        '0x80 plus the node id',
    ),
    'start value above the counter': Case(
        SYNC,
        f'{SYNC}  sync_overflow: 10\n',
        'defaults.tpdo.2.sync_start',
        'sync_start 20 never comes: the SYNC counts from 1 to 10',
        'at most 10',
    ),
    'two producers of SYNC': Case(
        '# sdo',
        f'- {{index: 0x1005, value: 0x40000080}} {HERE}',
        'defaults.sdo[1]',
        'sends SYNC itself',
        'write 0x80',
    ),
    'emergency with the identifier of a PDO': Case(
        '# sdo',
        f'- {{index: 0x1014, value: 0x183}} {HERE}',
        'defaults.sdo[1]',
        'COB-ID 0x183 of EMCY of joint1 is also that of TPDO 1 of joint2',
        'of its own',
    ),
}


def edited(case: Case) -> str:
    """Return the text of a case."""
    assert CLEAN.count(case.old) == 1 or case.old in (SYNC, '    node_id: 2\n'), case.old
    return CLEAN.replace(case.old, case.new, 1)


def report_of(folder: Path, text: str, bitrate: int | None = None) -> Report:
    """Check a text."""
    return check_file(write_bus(folder, text, eds=EDS), bitrate)


def assert_reported(problems: tuple[Problem, ...], text: str, case: Case) -> None:
    """Assert that a case is reported, at its marked line when it has one."""
    line = next((i for i, row in enumerate(text.splitlines(), 1) if HERE in row), None)
    assert any(
        problem.line == (line or problem.line)
        and problem.key == case.key
        and re.search(case.message, problem.message)
        and re.search(case.remedy, problem.remedy)
        for problem in problems
    ), '\n'.join(str(problem) for problem in problems)


def test_a_good_bus_has_nothing_to_report(tmp_path: Path) -> None:
    """Every case below starts from a bus without errors and warnings."""
    report = report_of(tmp_path, CLEAN)
    assert report.errors == report.warnings == ()


@pytest.mark.parametrize('name', WARNINGS)
def test_warnings(tmp_path: Path, name: str) -> None:
    """What runs and disappoints is a warning with file, line, key and remedy."""
    text = edited(WARNINGS[name])
    report = report_of(tmp_path, text)
    assert report.errors == ()
    assert_reported(report.warnings, text, WARNINGS[name])


@pytest.mark.parametrize('name', ERRORS)
def test_errors(tmp_path: Path, name: str) -> None:
    """What cannot work is an error."""
    text = edited(ERRORS[name])
    if name == 'start value above the counter':
        text = text.replace('# tpdo 2', f'sync_start: 20 {HERE}')
    assert_reported(report_of(tmp_path, text).errors, text, ERRORS[name])


def test_errors_and_warnings_of_reading_come_along(tmp_path: Path) -> None:
    """A misspelt key hides neither the warnings of other keys nor those of the whole bus."""
    text = CLEAN.replace('# master', 'sync_windw: 5').replace('# joint1', 'heartbeat_producer: 0')
    text = text.replace('package: "canopen_402_driver"', 'package: wrong')
    report = report_of(tmp_path, text)
    assert [problem.key for problem in report.errors] == ['master.sync_windw']
    keys = [problem.key for problem in report.warnings]
    assert keys == ['defaults.package', 'nodes.joint1.heartbeat_producer']


@pytest.mark.parametrize(('literal', 'warned'), [('0x91', True), ('0x80', False), ('0', False)])
def test_an_emcy_of_the_eds_without_node_id(tmp_path: Path, literal: str, *, warned: bool) -> None:
    """It is taken as the device's own; one of another node is said at its line of the EDS."""
    eds = EDS.replace('DefaultValue=$NODEID+0x80', f'DefaultValue={literal}')
    path = write_bus(tmp_path, CLEAN, eds=eds)
    assert [node.emergency_id for node in load_bus(path).nodes] == [0x82, 0x83]
    said = [problem for problem in check_file(path).warnings if 'EMCY' in problem.message]
    assert len(said) == 2 * warned
    for problem in said:
        assert problem.file.name == 'drive.eds'
        assert 'the EMCY COB-ID 0x091 (0x1014) of the EDS is not that of node' in problem.message


def test_a_missing_file_is_one_error(tmp_path: Path) -> None:
    """There is nothing to check then."""
    report = check_file(tmp_path / 'none.yml')
    assert len(report.errors) == 1
    assert report.load is None


def test_a_loaded_bus_can_be_checked(tmp_path: Path) -> None:
    """What a master has loaded needs no second reading, and the same is reported."""
    path = write_bus(tmp_path, edited(WARNINGS['interpolation period']), eds=EDS)
    assert check_bus(load_bus(path)).warnings == check_file(path).warnings != ()


def test_warnings_of_defaults_are_reported_once(tmp_path: Path) -> None:
    """Seven joints with one mistake in their defaults are one warning."""
    report = report_of(tmp_path, edited(WARNINGS['target apart, at once']))
    assert sum('map both' in problem.remedy for problem in report.warnings) == 1


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
    report = report_of(tmp_path, CLEAN, bitrate)
    assert report.load is not None
    bits = 100 * (47 + 33 / 30) + 400 * (95 + 81 / 30) + 200 * (79 + 65 / 30)
    bits += 25 * (55 + 41 / 30) + 200 * (111 + 97 / 30)
    assert report.load.frames_per_second == pytest.approx(925)
    assert report.load.load == pytest.approx(bits / bitrate)
    assert report.load.load_worst > report.load.load
    reported = [
        name
        for name, problems in (('error', report.errors), ('warning', report.warnings))
        if any('frames/s' in problem.message for problem in problems)
    ]
    assert reported == ([kind] if kind else [])


@pytest.mark.parametrize(
    ('old', 'new', 'rate', 'reason'),
    [
        ('# tpdo 2', 'event_timer: 50', 100, 'on change, taken as every 10 ms'),
        ('      inhibit_time: 100\n', '      inhibit_time: 400\n', 25, 'taken as every 40 ms'),
        ('# tpdo 2', 'event_timer: 10', 100, 'event timer 10 ms'),
        ('transmission: 255', 'transmission: 5', 20, 'every 5th SYNC'),
        ('transmission: 255', 'transmission: 0', 100, 'with SYNC on change'),
    ],
)
def test_rates(tmp_path: Path, old: str, new: str, rate: float, reason: str) -> None:
    """Each kind of TPDO has its rate, and the reason is reported."""
    report = report_of(tmp_path, CLEAN.replace(old, new))
    assert report.load is not None
    (item,) = [t for t in report.load.traffic if (t.device, t.service) == ('joint1', 'TPDO 2')]
    assert item.rate == pytest.approx(rate)
    assert reason in item.reason


@pytest.mark.parametrize(
    ('heartbeat', 'rows', 'warns'),
    [('0', (), True), ('100', (), False), ('0', (Row(0x100C, 0, 'Guard', 6, 'rw', '0'),), False)],
)
def test_a_drive_that_is_kept_alive_says_its_state(
    tmp_path: Path, heartbeat: str, rows: tuple[Row, ...], *, warns: bool
) -> None:
    """By a heartbeat of its own or node guarding; else it is booted by nobody when it is new."""
    text = CLEAN.replace('# joint1', 'heartbeat_consumer: false\n    reset_communication: false')
    drive = (replace(row, default=heartbeat) if row.index == 0x1017 else row for row in DRIVE_ROWS)
    report = check_file(write_bus(tmp_path, text, eds=eds_text((*drive, *rows))))
    found = [each for each in report.warnings if 'does not boot this way' in each.message]
    assert len(found) == warns
    for each in found:
        assert each.key == 'nodes.joint1.reset_communication'
        assert '~/nmt_reset_node once' in each.remedy


def test_guarding_is_as_good_as_a_heartbeat(tmp_path: Path) -> None:
    """A guarded device is watched; question and answer are in the load."""
    guarded = 'heartbeat_producer: 0\n    guard_time: 200\n    life_time_factor: 3'
    report = report_of(tmp_path, CLEAN.replace('# joint1', guarded))
    assert report.errors == report.warnings == ()
    assert report.load is not None
    frames = [t for t in report.load.traffic if t.service == 'guarding']
    assert [(t.device, t.size, t.rate) for t in frames] == [('joint1', 0, 5), ('joint1', 1, 5)]


@pytest.mark.parametrize(
    ('period', 'setting'),
    [
        (0.01, (10, -3)),
        (0.0025, (25, -4)),
        (0.004, (4, -3)),
        (0.000125, (125, -6)),
        (0.3, None),
        (0.0012345678, None),
    ],
)
def test_setting_of_a_period(period: float, setting: tuple[int, int] | None) -> None:
    """The remedy is what 0x60C2 can hold, in its coarsest unit."""
    assert period_setting(period) == setting


@pytest.mark.slow
@pytest.mark.parametrize('seed', range(4))
def test_damaged_files_can_be_checked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, seed: int
) -> None:
    """Whatever is wrong with a file, the checks end, and every problem has words."""
    monkeypatch.setattr(
        'arm_canopen.config.resolve.eds_files.load_eds', cache(load_eds)
    )  # it stays whole
    generator = random.Random(seed)
    snippets = [
        *('transmission: 252', 'sync_start: 9', '- {index: 0x1016, sub_index: 1}', '  1:'),
        *('position_mode: 9', 'mapping: []', 'sync_period: 500', 'num_channels: 3', 'x: ['),
    ]
    path = write_bus(tmp_path, CLEAN, eds=EDS)
    for _ in range(150):
        path.write_text(mutated(CLEAN, snippets, generator), encoding='utf-8')
        report = check_file(path)
        for problem in report.errors + report.warnings:
            assert problem.message
            assert problem.remedy


def test_a_consumer_time_that_the_eds_does_not_allow(tmp_path: Path) -> None:
    """What boot would write to 0x1016 is compared with its limit; the way out is named."""
    limited = EDS.replace(
        'ParameterName=Consumer heartbeat time\n',
        'ParameterName=Consumer heartbeat time\nHighLimit=0x00010100\n',
    )
    assert limited != EDS
    path = write_bus(tmp_path, CLEAN, eds=limited)
    warnings = check_file(path).warnings
    assert len(warnings) == 2  # one for each device
    assert all('heartbeat_consumer: false' in warning.remedy for warning in warnings)
    assert all('0x1016:01' in warning.message for warning in warnings)
    shorter = CLEAN.replace('  # master\n', '  heartbeat_producer: 50\n')
    assert check_file(write_bus(tmp_path, shorter, eds=limited)).warnings == ()
