# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``canopen check`` as a person or a CI job starts it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
import re
import shutil
import signal
import subprocess
import sys

from can_addresses import free_multicast
from config_samples import BUS, write_bus
from eds_samples import DRIVE_ROWS, eds_text, FACTOR_ROWS, Row
import pytest
from tool_environment import ENVIRONMENT, Output, REPOSITORY

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


@pytest.mark.parametrize(
    ('rows', 'keys', 'shown', 'not_shown'),
    [
        (WITH_FACTORS, '', [r'joint1 +1000 +0.01 +1000', EXPLAINED], [UNKNOWN]),
        (WITH_FACTORS, BY_FACTORS, [r'group of the EDS \(0x608F, 0x6092\)'], [EXPLAINED]),
        (ENCODER_ONLY, BY_FACTORS, [r'group of the EDS \(0x608F\)'], []),
        (DRIVE_ROWS, '', [r'joint1 +1000 +\?', UNKNOWN.replace('?', r'\?')], []),
        (DRIVE_ROWS, SLOW, [SPEEDS], ['0x607F']),
        (
            WITH_FACTORS,
            SCALES.format(1e4, 1e-4),
            ['joint1 +10000 +0.1 '],
            ['one of them is wrong'],
        ),
        (WITH_FACTORS, SCALES.format(999.0, 1 / 999), [r'joint1 +999 +0.00999 ', FAR], []),
    ],
)
def test_units_and_speeds_of_each_axis(
    rows: Sequence[Row],
    keys: str,
    *,
    shown: list[str],
    not_shown: list[str],
    tmp_path: Path,
    capsys: Output,
) -> None:
    """What 1.0 is in increments and in [rad], by which objects, and how fast its own moves are."""
    text = BUS.replace('    node_id: 2\n', f'    node_id: 2\n    {keys}\n')
    main(['check', str(write_bus(tmp_path, text, eds=eds_text(rows)))])
    output = capsys.readouterr().out
    assert [pattern for pattern in shown if not re.search(pattern, output)] == []
    assert [text for text in not_shown if text in output] == []


@pytest.mark.parametrize(
    ('arguments', 'message'),
    [
        ([], 'required: VERB'),
        (['check'], 'required: BUS.yml'),
        (['chekc', str(PANDA)], "unknown 'chekc'; did you mean check?"),
        (['xyzzy'], "invalid choice: 'xyzzy'"),
        (['check', str(PANDA), '--bitrat3=500k'], '--bitrat3; did you mean --bitrate?'),
        (['check', str(PANDA), '--xyzzy'], 'unrecognized arguments: --xyzzy'),
        (['check', 'bus.yml', '--bitrate', '500'], '500 bit/s is not 10k to 1M; 500k perhaps'),
        (['check', 'bus.yml', '--bitrate', '2M'], '2M bit/s is not 10k to 1M'),
        (['check', 'bus.yml', '--bitrate', 'fast'], "'fast' is no bit rate"),
        (['check', 'bus.yml', '--ros-args', '-p'], '-p needs a value'),
    ],
)
def test_wrong_usage_is_2(arguments: list[str], message: str, capsys: Output) -> None:
    """Wrong usage is reported on stderr, with exit code 2."""
    with pytest.raises(SystemExit) as ending:
        main(arguments)
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
