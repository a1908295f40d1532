# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``canopen check`` as a person or a CI job starts it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
import shutil
import signal
import subprocess
import sys

from can_addresses import free_multicast
from config_samples import BUS, DRIVE_ROWS, eds_text, FACTOR_ROWS, write_bus
import pytest
from tool_environment import ENVIRONMENT, REPOSITORY

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


def test_the_article_is_checked(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
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


def test_equal_frames_of_several_devices_are_one_row(capsys: pytest.CaptureFixture[str]) -> None:
    """The table has a row for each kind of frame; --frames lists each by its identifier."""
    main(['check', str(PANDA), '--bitrate', '500k'])
    output = capsys.readouterr().out
    row = next(line for line in output.splitlines() if line.startswith('TPDO 2'))
    # 700 frames/s of 8 bytes: 111 bits and 97 / 30 of stuffing each
    assert row.split() == ['TPDO', '2', '7', '8', '700.0', '16.0%', 'every', 'SYNC']
    main(['check', str(PANDA), '--bitrate', '500k', '--frames'])
    rows = [line for line in capsys.readouterr().out.splitlines() if line.startswith('TPDO 2 of')]
    assert [row.split()[4] for row in rows] == [f'{0x280 + node:03X}' for node in range(2, 9)]


def test_what_is_polled_is_counted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Request and response of a mode that no TPDO carries, every 10 ms and a cycle."""
    main(['check', str(write_bus(tmp_path, eds=eds_text()))])
    lines = capsys.readouterr().out.splitlines()
    row = next(line for line in lines if line.startswith('SDO 0x6061'))
    assert row.split()[2:5] == ['1', '8', '100.0']
    assert row.endswith('polled, as no TPDO carries it')


def test_a_full_bus_is_an_error(capsys: pytest.CaptureFixture[str]) -> None:
    """What a bit rate cannot carry is refused, with the figures."""
    assert main(['check', str(PANDA), '--bitrate', '250000']) == 1
    output = capsys.readouterr().out
    assert 'cannot carry this: 2912 frames/s at 250 kbit/s are a load of 107%' in output


def test_a_good_file_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Nothing wrong is exit code 0, also with --strict."""
    path = write_bus(tmp_path, eds=eds_text())
    path.write_text(path.read_text().replace('  tpdo:', '  heartbeat_producer: 100\n  tpdo:', 1))
    assert main(['check', '--strict', str(path)]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == f'{path}: 0 errors, 0 warnings'


def test_units_are_shown(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A row for each axis: what 1.0 is in increments, in [rad], and of the velocity."""
    main(['check', str(write_bus(tmp_path, eds=eds_text((*DRIVE_ROWS, *FACTOR_ROWS))))])
    row = next(line for line in capsys.readouterr().out.splitlines() if line.startswith('joint1'))
    assert row.split()[:4] == ['joint1', '1000', '0.01', '1000']


@pytest.mark.parametrize(('gone', 'named'), [(None, '0x608F, 0x6092'), (0x6092, '0x608F')])
def test_only_objects_that_the_eds_has_are_named(
    gone: int | None, named: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """As the source of the units."""
    rows = [*DRIVE_ROWS, *(row for row in FACTOR_ROWS if row.index != gone)]
    text = BUS.replace('    node_id: 2\n', '    node_id: 2\n    scale_from_factor_group: true\n')
    main(['check', str(write_bus(tmp_path, text, eds=eds_text(rows)))])
    row = next(line for line in capsys.readouterr().out.splitlines() if line.startswith('joint1'))
    assert row.endswith(f'factor group of the EDS ({named})')


@pytest.mark.parametrize(
    ('scale', 'rad', 'is_far'), [(1e4, '0.1', False), (999.0, '0.00999', True)]
)
def test_a_scale_far_from_the_factor_group_is_a_warning(
    scale: float, rad: str, is_far: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A joint is not ten times as fast as its motor; the column is explained."""
    keys = ', '.join(f'scale_{kind}_to_dev: {scale}' for kind in ('pos', 'vel'))
    keys += ''.join(f', scale_{kind}_from_dev: {1 / scale}' for kind in ('pos', 'vel'))
    block = keys.replace(', ', '\n    ')
    text = BUS.replace('    node_id: 2\n', f'    node_id: 2\n    {block}\n')
    main(['check', str(write_bus(tmp_path, text, eds=eds_text((*DRIVE_ROWS, *FACTOR_ROWS))))])
    lines = capsys.readouterr().out.splitlines()
    row = next(line for line in lines if line.startswith('joint1'))
    assert row.split()[2] == rad
    assert any(line.startswith('rad: how far 1.0 is by the factor group') for line in lines)
    warning = f'and by the factor group of the EDS only {rad} rad'
    assert any(warning in line for line in lines) is is_far


def test_the_speed_of_moves_is_shown(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """In the units of bus.yml, as boot leaves the objects; only what the EDS has."""
    keys = """scale_vel_to_dev: -2000
    scale_vel_from_dev: -0.0005
    sdo: [{index: 0x6081, value: 30}]"""
    text = BUS.replace('    node_id: 2\n', f'    node_id: 2\n    {keys}\n')
    main(['check', str(write_bus(tmp_path, text, eds=eds_text()))])
    lines = capsys.readouterr().out.splitlines()
    head = next(line for line in lines if '0x6081 speed of moves' in line)
    row = lines[lines.index(head) + 1]
    assert row.split() == ['joint1', '0.015', '0.5', '0.5', '0.5']
    assert '0x6083 acceleration' in head
    assert '0x607F' not in head


def test_radians_that_nobody_says_are_explained(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Below the table, and only there where one is unknown."""
    for rows, asks in ((DRIVE_ROWS, True), ((*DRIVE_ROWS, *FACTOR_ROWS), False)):
        main(['check', str(write_bus(tmp_path, eds=eds_text(rows)))])
        lines = capsys.readouterr().out.splitlines()
        row = next(line for line in lines if line.startswith('joint1'))
        assert (row.split()[2] == '?') is asks
        assert any(line.startswith('?: the EDS has no factor group') for line in lines) is asks


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
def test_wrong_usage_is_2(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
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
