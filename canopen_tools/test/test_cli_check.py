# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``canopen check`` and ``canopen eds`` as a person or a CI job starts them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
import random
import re
import shutil
import signal
import subprocess
import sys
from typing import NamedTuple

from can_addresses import free_multicast
from config_samples import BUS, mutated, write_bus
from device_rig import Rig
from eds_samples import DRIVE_ROWS, eds_text, FACTOR_ROWS, Row
import pytest
from tool_environment import ENVIRONMENT, Output, REPOSITORY

from arm_canopen.config.resolve.sdo_list import parameter_writes
from canopen_core import Findings
from canopen_core.eds import load_eds
from canopen_core.standard import is_drive
from canopen_tools import EdsReport, lint_eds
from canopen_tools.cli.main import main

pytestmark = pytest.mark.slow

DEADLINE = 60.0  # [s]
PANDA = REPOSITORY / 'arm_bringup' / 'robots' / 'panda' / 'bus.yml'


def test_a_process_ends_with_its_exit_code(tmp_path: Path) -> None:
    """As a program: findings on stdout, 1 for errors."""
    (tmp_path / 'bus.yml').write_text('master:\n  node_id: 300\n')
    process = subprocess.run(
        [sys.executable, '-m', 'canopen_tools.cli.main', 'check', 'bus.yml'],
        cwd=tmp_path,
        env=ENVIRONMENT,
        capture_output=True,
        text=True,
        check=False,
        timeout=DEADLINE,
    )
    assert process.returncode == 1
    lines = process.stdout.splitlines()
    assert 'bus.yml:2: error: master.node_id: 300 is out of range' in lines
    assert lines[-1].startswith('bus.yml: 3 errors, ')
    assert process.stderr == ''


def test_the_article_is_checked(tmp_path: Path, capsys: Output) -> None:
    """The bus.yml of the article works, with two warnings that --strict makes errors.

    Ours differs from it in both.
    """
    mode = '        - {index: 0x6060, sub_index: 0} # Modes of Operation\n'
    target = '        - {index: 0x607A, sub_index: 0} # Target Position\n'
    head = '    2:\n      enabled: true\n      cob_id: "auto"\n      mapping:\n'
    text = PANDA.read_text('utf-8')
    assert text.count(mode + target + head) == text.count('value: 10} # Set Interpolation') == 1
    text = text.replace(mode + target + head, mode + head + target)
    article = tmp_path / 'bus.yml'
    article.write_text(text.replace('value: 10} # Set Inter', 'value: 50} # Set Inter'), 'utf-8')
    shutil.copy(PANDA.with_name('cia402_slave.eds'), tmp_path)
    assert main(['check', str(article)]) == 0
    output = capsys.readouterr().out
    assert f'{article}:23: warning: defaults.sdo[5]: 0x60C2 (interpolation period) is 50' in output
    assert f'{article}:51: warning: defaults.rpdo.2: 0x607A (target position) is in RPDO' in output
    assert 'load at 1000 kbit/s: 2912 frames/s, 26.7% (31.4% with the most stuffing)' in output
    assert output.splitlines()[-1] == f'{article}: 0 errors, 2 warnings'
    assert main(['check', str(article), '--strict']) == 1
    assert main(['check', str(PANDA), '--strict']) == 0
    assert main(['check', str(PANDA), '--bitrate', '250000']) == 1
    assert 'cannot carry this: 2912 frames/s at 250 kbit/s' in capsys.readouterr().out


def test_equal_frames_of_several_devices_are_one_row(capsys: Output) -> None:
    """The table has a row for each kind of frame; --frames lists each by its identifier."""
    main(['check', str(PANDA), '--bitrate', '500k'])
    output = capsys.readouterr().out
    row = next(line for line in output.splitlines() if line.startswith('TPDO 2'))
    # 700 frames/s of 8 bytes: 111 bits and 97 / 30 of stuffing each
    assert row.split() == ['TPDO', '2', '7', '8', '700.0', '16.0%', 'every', 'SYNC']
    main(['check', str(PANDA), '--bitrate', '500k', '--frames'])
    rows = [line for line in capsys.readouterr().out.splitlines() if line.startswith('TPDO 2 of')]
    assert [row.split()[4] for row in rows] == [f'{0x280 + node:03X}' for node in range(2, 9)]


WITH_FACTORS = (*DRIVE_ROWS, *FACTOR_ROWS)
ENCODER_ONLY = tuple(row for row in WITH_FACTORS if row.index != 0x6092)
BY_FACTORS = 'scale_from_factor_group: true'
SCALES = """scale_pos_to_dev: {0}
    scale_pos_from_dev: {1}
    scale_vel_to_dev: {0}
    scale_vel_from_dev: {1}"""
SLOW = """scale_vel_to_dev: -2000
    scale_vel_from_dev: -0.0005
    sdo: [{index: 0x6081, value: 30}]"""
EXPLAINED = '\nrad: how far 1.0 is by the factor group'
UNKNOWN = '\n?: the EDS has no factor group'
FAR = 'and by the factor group of the EDS only 0.00999 rad'
SPEEDS = r'0x6081 speed of moves .*0x6083 acceleration .*\njoint1 +0.015 +0.5 +0.5 +0.5\n'


def test_units_and_speeds_of_each_axis(tmp_path: Path, capsys: Output) -> None:
    """What 1.0 is in increments and in [rad], by which objects, and how fast its own moves are."""
    for rows, keys, shown, not_shown in (
        (WITH_FACTORS, '', [r'joint1 +1000 +0.01 +1000', EXPLAINED], UNKNOWN),
        (WITH_FACTORS, BY_FACTORS, [r'group of the EDS \(0x608F, 0x6092\)'], EXPLAINED),
        (ENCODER_ONLY, BY_FACTORS, [r'group of the EDS \(0x608F\)'], UNKNOWN),
        (DRIVE_ROWS, '', [r'joint1 +1000 +\?', UNKNOWN.replace('?', r'\?')], EXPLAINED),
        (DRIVE_ROWS, SLOW, [SPEEDS], '0x607F'),
        (WITH_FACTORS, SCALES.format(1e4, 1e-4), ['joint1 +10000 +0.1 '], 'one of them is wrong'),
        (WITH_FACTORS, SCALES.format(999.0, 1 / 999), [r'joint1 +999 +0.00999 ', FAR], UNKNOWN),
    ):
        text = BUS.replace('    node_id: 2\n', f'    node_id: 2\n    {keys}\n')
        main(['check', str(write_bus(tmp_path, text, eds=eds_text(rows)))])
        output = capsys.readouterr().out
        assert [pattern for pattern in shown if not re.search(pattern, output)] == [], keys
        assert not_shown not in output, keys


def test_wrong_usage_is_2(capsys: Output) -> None:
    """Wrong usage is reported on stderr, with exit code 2."""
    for arguments, message in (
        ('', 'required: VERB'),
        ('check', 'required: BUS.yml'),
        ('chekc bus.yml', "invalid choice: 'chekc' (choose from 'check', "),
        ('check bus.yml --bitrat=500k', 'unrecognized arguments: --bitrat=500k'),
        ('check bus.yml --bitrate 500', '500 bit/s is not 10k to 1M; 500k perhaps'),
        ('check bus.yml --bitrate 2M', '2M bit/s is not 10k to 1M'),
        ('check bus.yml --bitrate fast', "'fast' is no bit rate"),
        ('check bus.yml --ros-args -p', '-p needs a value'),
    ):
        with pytest.raises(SystemExit) as ending:
            main(arguments.split())
        assert ending.value.code == 2
        assert message in capsys.readouterr().err


def start(*arguments: str, prefix: Sequence[str] = ()) -> subprocess.Popen[str]:
    """Start the program with its output in pipes."""
    return subprocess.Popen(
        [*prefix, sys.executable, '-m', 'canopen_tools.cli.main', *arguments],
        env=ENVIRONMENT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def test_a_reader_that_goes_away_is_no_error() -> None:
    """``canopen check bus.yml | head`` ends without a traceback."""
    process = start('check', str(PANDA), '--frames')
    assert process.stdout
    process.stdout.close()
    assert process.wait(DEADLINE) == 1
    assert process.stderr
    assert 'Traceback' not in process.stderr.read()
    process.stderr.close()


@pytest.mark.parametrize('prefix', [(), ('sh', '-c', 'trap "" INT; exec "$@"', 'sh')])
def test_ctrl_c_ends_a_verb(prefix: tuple[str, ...]) -> None:
    """With the code of an interrupted program and no traceback, also as a script's background job.

    Shells start those with SIGINT ignored, and so does the prefix.
    """
    process = start('scan', '--can', free_multicast(), '--listen', '60', prefix=prefix)
    assert process.stderr
    assert 'listening on' in process.stderr.readline()
    process.send_signal(signal.SIGINT)
    output, errors = process.communicate(timeout=DEADLINE)
    assert process.returncode == 130
    assert output == errors == ''


OWN_FILES = sorted(
    path
    for folder in ('arm_canopen/eds', 'arm_canopen/arm_canopen/config', 'arm_bringup/robots')
    for path in (REPOSITORY / folder).rglob('*')
    if path.suffix in ('.eds', '.dcf')
)
GOOD = eds_text(
    replace(row, default='5') if 0x1400 <= row.index < 0x1600 and not row.subindex else row
    for row in DRIVE_ROWS
)
"""The sample, whose RPDOs have one sub-index less than they say."""


class Case(NamedTuple):
    """A damaged file."""

    section: str  # section in which something is replaced
    old: str  # what
    new: str  # by what
    message: str  # pattern of what is said
    line: str | None = None  # that is named, empty for any; None for that of ``new``


WRONG_TYPE = Case(
    '6041', 'DataType=0x0006', 'DataType=0x0007', 'Statusword: .* is UNSIGNED16', line='[6041]'
)
WRONG_ACCESS = Case(
    '6041', 'AccessType=ro', 'AccessType=rw', 'but the object is read-only', line='[6041]'
)
NO_NODE_ID = r'node id \(0x201\)'
UNMAPPED = r'into a RPDO \(PDOMapping 0, AccessType rww\)'
ERRORS = [
    Case('1001', '[1001]', '[2FFF]', r'0x1001:00 \(error register\) is missing', line=''),
    Case('1018sub1', '[1018sub1]', '[1018sub9]', r'0x1018:01 \(vendor id\) is missing', line=''),
    WRONG_TYPE,
    Case('1A00', '[1A00', '[2A00', 'TPDO 1 has no mapping: 0x1A00 is missing', line=''),
    Case('1405', '[1405', '[2405', r'RPDO 6 has a mapping \(0x1605\), but no', line=''),
    Case('1800sub1', '[1800sub1]', '[1800sub7]', r'TPDO 1 has no sub-index 1 \(COB-ID\)', line=''),
    Case('1A00sub0', 'DefaultValue=0', 'DefaultValue=9', 'maps 9 .* 8 entries', line='[1A00sub0]'),
]
MAPS = 'DefaultValue=0', 'DefaultValue=0x55550010', 'DefaultValue=0x60400010'
WARNINGS = [
    Case('2001', '[2001]', '[2000]', r'section \[2000\] was already opened'),
    Case('2001', 'PDOMapping=0', 'AccessType=ro', 'AccessType was already given'),
    WRONG_ACCESS,
    Case('6060', 'AccessType=rww', 'AccessType=ro', 'written by the master', line='[6060]'),
    Case('2000', 'AccessType=rw', 'AccessType=rx', "unknown AccessType 'rx'"),
    Case('6040', 'PDOMapping=1', 'PDOMapping=0', UNMAPPED, line='[6040]'),
    Case('1400sub1', 'DefaultValue=$NODEID+0x200', 'DefaultValue=0x201', NO_NODE_ID, '[1400sub1]'),
    Case('1A00sub1', MAPS[0], MAPS[1], 'maps 0x5555:00, which is not', line='[1A00sub1]'),
    Case('1A00sub1', MAPS[0], MAPS[2], '1 maps 0x6040:00 .* cannot be', line='[1A00sub0]'),
]


def damaged(case: Case) -> str:
    """Return the text of a case; a head stands for its sub-sections, too."""
    start = GOOD.index(f'[{case.section}]')
    if case.old.endswith(']') or not case.old.startswith('['):
        end = start + GOOD[start:].index(case.old) + len(case.old)
        text = GOOD[: end - len(case.old)] + case.new + GOOD[end:]
    else:
        text = GOOD.replace(case.old, case.new)
    if 'default mapping' in case.message or case.section == '1A00sub1':
        head = text.index('[1A00sub0]')
        place = text.index('DefaultValue=0', head)
        text = text[:place] + 'DefaultValue=1' + text[place + len('DefaultValue=0') :]
    return text


def lint(folder: Path, text: str) -> EdsReport:
    """Check a text."""
    path = folder / 'drive.eds'
    path.write_text(text, encoding='utf-8')
    return lint_eds(path)


@pytest.mark.parametrize('case', [*ERRORS, *WARNINGS], ids=lambda case: case.message)
def test_damage_is_reported(tmp_path: Path, case: Case) -> None:
    """Each kind of damage is an error or a warning at its line, with a remedy."""
    text = damaged(case)
    assert text != GOOD
    report = lint(tmp_path, text)
    problems = report.errors if case in ERRORS else report.warnings
    found = [problem for problem in problems if re.search(case.message, problem.message)]
    assert found, '\n'.join(map(str, report.errors + report.warnings))
    assert found[0].remedy
    line = case.new if case.line is None else case.line
    assert line in {'', text.splitlines()[found[0].line - 1]}


@pytest.mark.parametrize('path', OWN_FILES, ids=lambda path: path.name)
def test_our_own_files_are_right(path: Path) -> None:
    """Every EDS and DCF that the workspace ships passes its own lint."""
    assert OWN_FILES
    report = lint_eds(path)
    assert report.errors == report.warnings == ()


def test_the_verb_prints_a_summary(tmp_path: Path, capsys: Output) -> None:
    """Several files, each with what it holds; exit code 1 when one has errors, or --strict."""
    good, odd, bad = (tmp_path / f'{name}.eds' for name in ('good', 'odd', 'bad'))
    good.write_text(GOOD)
    odd.write_text(damaged(WRONG_ACCESS))
    bad.write_text(damaged(WRONG_TYPE))
    assert main(['eds', str(good), '--strict']) == 0
    count = len({row.index for row in DRIVE_ROWS})
    summary = f'{count} objects, 6 RPDOs, 6 TPDOs; 0 errors, 0 warnings'
    assert capsys.readouterr().out == f'{good}: {summary}\n'
    assert main(['eds', str(odd)]) == 0
    assert main(['eds', '--strict', str(odd)]) == 1
    capsys.readouterr()
    assert main(['eds', str(good), str(bad), str(tmp_path / 'none.eds')]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert re.search(r'bad.eds:\d+: error: \[6041\]: Statusword: the data type', lines[1])
    assert lines[-1] == f'{tmp_path / "none.eds"}: 1 error, 0 warnings'


@pytest.mark.parametrize('seed', range(2))
def test_damaged_files_are_read_or_refused(tmp_path: Path, seed: int) -> None:
    """Whatever a file holds, the lint ends, and every problem has words and a line of the file."""
    generator = random.Random(seed)
    snippets = ('[1A00', '[1018sub0]', 'DefaultValue=$NODEID', 'CompactSubObj=300', '=', 'a' * 300)
    for _ in range(60):
        text = mutated(GOOD, snippets, generator)
        report = lint(tmp_path, text)
        for problem in report.errors + report.warnings:
            assert problem.message
            assert problem.remedy
            assert 0 <= problem.line <= text.count('\n') + 1


COMMON_ROWS = tuple(
    replace(row, default='5') if 0x1400 <= row.index < 0x1600 and not row.subindex else row
    for row in DRIVE_ROWS
    if row.index < 0x6000 and row.index != 0x1000
)
OTHER_MEANINGS = (  # numbers that CiA 402 has, with types that it does not have
    Row(0x6040, 0, 'Something else', 7, 'ro', '0'),
    Row(0x6041, 0, 'Something else', 5, 'rw', '0'),
    Row(0x6060, 0, 'Something else', 7, 'ro', '0'),
    Row(0x607A, 0, 'Something else', 7, 'ro', '0'),
)


def text_of(device_type: str, *profile: Row) -> str:
    """Return the EDS of a device with this 0x1000."""
    device = Row(0x1000, 0, 'Device type', 7, 'ro', device_type)
    return eds_text((device, *COMMON_ROWS, *profile))


def test_only_drives_are_judged_as_drives(tmp_path: Path) -> None:
    """Not CiA 401, 406 and one that is not known here, and none is simulated of these.

    Drives are one with several axes, too, and one whose EDS does not say what it is.
    """
    for device_type, errors in (
        *((other, 0) for other in ('0x000F0191', '0x00020196', '0x00000195')),
        *((drive, 4) for drive in ('0x00020192', '0xFFFF0192', '')),
    ):
        report = lint(tmp_path, text_of(device_type, *OTHER_MEANINGS))
        assert (len(report.errors), len(report.warnings) > 0) == (errors, errors > 0), device_type
        if not errors:
            dictionary = load_eds(tmp_path / 'drive.eds').dictionary
            assert not is_drive(dictionary), device_type
            assert Rig(dictionary).device.drive is None, device_type


def test_a_value_at_the_place_of_a_command_is_written(tmp_path: Path) -> None:
    """The ParameterValue of 0x6060 of an I/O module is no command."""
    row = Row(0x6060, 0, 'Polarity', 5, 'rw', '0')
    text = text_of('0x000F0191', row)
    path = tmp_path / 'module.dcf'
    place = text.index('[6060]')
    value = text.index('DefaultValue=0', place)
    path.write_text(f'{text[:value]}ParameterValue=3\n{text[value:]}', encoding='utf-8')
    findings = Findings()
    (write,) = parameter_writes(load_eds(path), findings)
    assert (write.index, write.data) == (0x6060, b'\x03')
    assert findings.warnings == ()
