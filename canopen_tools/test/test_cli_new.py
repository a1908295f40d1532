# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``canopen new``: what it writes is free of findings, boots, and leaves nothing to a guess."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
import math
from pathlib import Path
import re
import tempfile
import time

from can_addresses import free_virtual
from eds_samples import DRIVE_ROWS, eds_text, FACTOR_ROWS, Row
from hypothesis import given, settings
from hypothesis import strategies as st
import pytest
from tool_environment import Output, REPOSITORY

from arm_canopen import CanopenMaster, load_bus, OperationMode
from arm_canopen.config import check_file
from canopen_sim import simulated_devices
from canopen_tools.cli.main import main

DRIVE = REPOSITORY / 'arm_canopen' / 'eds' / 'cia402_drive.eds'
CYCLIC_AND_PROFILE = Row(0x6502, 0, 'Supported drive modes', 7, 'ro', '0x81')
ONLY_VELOCITY = replace(CYCLIC_AND_PROFILE, default='0x4')
GEAR = (
    Row(0x6091, 0, 'Highest sub-index', 5, 'const', '2'),
    Row(0x6091, 1, 'Motor revolutions', 7, 'rw', '100'),
    Row(0x6091, 2, 'Shaft revolutions', 7, 'rw', '1'),
)
INTERPOLATION = (
    Row(0x60C1, 0, 'Highest sub-index', 5, 'const', '1'),
    Row(0x60C1, 1, 'First set-point', 4, 'rww', '0', mappable=True),
)
SAMPLE = (*DRIVE_ROWS, *FACTOR_ROWS, *GEAR, *INTERPOLATION, CYCLIC_AND_PROFILE)
UNMAPPED = tuple(replace(row, mappable=False) if row.index == 0x6041 else row for row in SAMPLE)
PUMP = tuple(
    replace(row, default='0x00030191') if row.index == 0x1000 else row
    for row in DRIVE_ROWS
    if row.index < 0x2000
)
TURN = 2.0 * math.pi
DEADLINE = 20.0  # [s]
CLEAN = ': 0 errors, 0 warnings'
OPTIONAL = (0x6060, 0x6061, 0x606C, 0x603F)
NEEDED = (0x6040, 0x6041, 0x6064, 0x607A, 0x60C1)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The present folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def written(folder: Path, name: str, rows: Sequence[Row]) -> Path:
    """Write an EDS."""
    path = folder / name
    path.write_text(eds_text(rows))
    return path


def without(*indices: int) -> tuple[Row, ...]:
    """Return the rows of a drive that lacks objects."""
    return tuple(row for row in SAMPLE if row.index not in indices)


def follow(master: CanopenMaster, name: str, target: float) -> None:
    """Enable a drive, and stream a target until it is there."""
    drive = master.drive(name)
    drive.enable()
    drive.select_mode(OperationMode.CYCLIC_POSITION)
    deadline = time.monotonic() + DEADLINE
    while abs(drive.position - target) > 1e-3 and time.monotonic() < deadline:
        drive.set_target(target)
    assert drive.position == pytest.approx(target, abs=1e-3)


def test_a_new_bus_boots_and_follows(tmp_path: Path, capsys: Output) -> None:
    """On simulated drives, in the mode that it has; units by the EDS and as said."""
    bus_yml = tmp_path / 'robot' / 'bus.yml'
    devices = [f'shoulder={DRIVE}@2', f'elbow={DRIVE}@7', f'lift={DRIVE}@8']
    units = ['--turn', 'elbow=-36000', '--metre', 'lift=50000']
    assert main(['new', *devices, *units, '--output', str(bus_yml)]) == 0
    assert CLEAN in capsys.readouterr().out
    with running(bus_yml) as master:
        for name, counts in (('shoulder', 1000.0), ('elbow', -36000 / TURN), ('lift', 50000)):
            follow(master, name, 0.02)
            assert master.sdo(name).read(0x6064) == pytest.approx(0.02 * counts, rel=0.06)


def test_devices_of_several_kinds(folder: Path, capsys: Output) -> None:
    """Each has its own block, and a drive the target of its mode; what is none keeps its PDOs."""
    seventh = replace(CYCLIC_AND_PROFILE, default='0x41')
    written(folder, 'drive.eds', SAMPLE)
    written(folder, 'pump.eds', PUMP)
    written(folder, 'both.eds', [*without(0x6502), seventh])
    written(folder, 'profile.eds', [*without(0x6502, 0x60C1), seventh])
    devices = ['arm=drive.eds@1', 'pump=pump.eds@0x10', f'lift={DRIVE}@3']
    devices += ['a=both.eds@4', 'b=profile.eds@5']
    assert main(['new', *devices, '--period', '4']) == 0
    assert CLEAN in capsys.readouterr().out
    config = load_bus(Path('bus.yml'))
    assert [(node.name, node.is_drive) for node in config.nodes] == [
        (name, name != 'pump') for name in ('arm', 'pump', 'lift', 'a', 'b')
    ]
    assert config.master.node_id == 2
    assert (folder / DRIVE.name).read_bytes() == DRIVE.read_bytes()
    last = config.nodes[-2:]
    assert [node.axes[0].position_mode for node in last] == [7, 1]
    mapped = [each.mapping[1] for node in last for each in node.rpdos if each.mapping]
    assert [(each.index, each.subindex) for each in mapped] == [(0x60C1, 1), (0x607A, 0)]


def ones() -> tuple[Row, ...]:
    """Return the rows of a drive whose factor group was never set: all ratios are 1."""
    ratios = (0x608F, 0x6091, 0x6092)
    return tuple(
        replace(row, default='1') if row.index in ratios and row.subindex else row
        for row in SAMPLE
    )


@contextmanager
def running(bus_yml: Path) -> Iterator[CanopenMaster]:
    """Boot a bus of simulated drives."""
    bus = free_virtual()
    with (
        simulated_devices(bus_yml, bus=bus),
        CanopenMaster.from_bus_yml(bus_yml, bus=bus) as master,
    ):
        master.boot()
        yield master


def test_a_drive_that_counts_in_rpm_follows(tmp_path: Path) -> None:
    """By its formula, and so does the simulated drive: 0x607F of 3000 is no 3000 increments."""
    limit = replace(CYCLIC_AND_PROFILE, index=0x607F, access='rw', default='3000')
    window = replace(limit, index=0x6065, default='20000')
    eds = written(tmp_path, 'drive.eds', [*SAMPLE, limit, window])
    bus_yml = tmp_path / 'robot' / 'bus.yml'
    units = ['--turn', 'arm=-409600', '--rpm', 'arm=100']
    assert main(['new', f'arm={eds}@2', *units, '--output', str(bus_yml)]) == 0
    (node,) = load_bus(bus_yml).nodes
    assert node.drive.scale_vel_to_dev == pytest.approx(-60 * 100 / TURN)
    with running(bus_yml) as master:
        follow(master, 'arm', 0.5)


RPM, TENTHS, DEGREES, METRES, COUNTS = (
    Row(0x60A9, 0, 'SI unit velocity', 7, 'rw', value)
    for value in ('0x00B44700', '0xFFB44700', '0x00410300', '0x00010300', '0x00B50300')
)
RPM_PER_S = Row(0x60AA, 0, 'SI unit acceleration', 7, 'rw', '0xFFC00300')
FACTOR = (
    Row(0x6096, 0, 'Highest sub-index', 5, 'const', '2'),
    Row(0x6096, 1, 'Numerator', 7, 'rw', '60'),
    Row(0x6096, 2, 'Divisor', 7, 'rw', '4096'),
)


def test_velocity_is_in_the_unit_that_the_eds_names(tmp_path: Path) -> None:
    """In 0x60A9, with the reason behind the scale."""
    for rows, options, velocity, words in (
        ([RPM, RPM_PER_S], ['--turn', 'arm=-1000', '--rpm', 'arm=1'], -60 / TURN, '1 turns/min'),
        ([TENTHS], ['--turn', 'arm=1000', '--rpm', 'arm=26'], 26 * 600 / TURN, '0.1 turns/min by'),
        ([RPM], ['--metre', 'arm=5000', '--rpm', 'arm=20'], 20 * 60, ', 20 turns for 1 m'),
        ([METRES], ['--metre', 'arm=5000'], 1.0, '1 m/s'),
        ([COUNTS], ['--turn', 'arm=-1000'], -1000 / TURN, '0x60A9 of the EDS: its unit is 1 incr'),
        # 0x60A9 and 0x6096 are overruled
        ([COUNTS, *FACTOR], ['--turn', 'arm=9', '--rpm', 'arm=2'], 120 / TURN, '# rpm, 2 turns'),
        ([], ['--rpm', 'arm=100'], 60 * 100 / TURN, '# rpm, 100 turns for '),
        # 0x6096 alone; torque turns with the position
        (FACTOR, ['--turn', 'arm=-4096', '--mode', 'arm=1'], -60 / TURN, 'by 0x6096 of the EDS'),
    ):
        eds, bus_yml = written(tmp_path, 'drive.eds', [*SAMPLE, *rows]), tmp_path / 'bus.yml'
        assert main(['new', f'arm={eds}@5', *options, '--output', str(bus_yml), '--force']) == 0
        (node,) = load_bus(bus_yml).nodes
        assert node.drive.scale_vel_to_dev == pytest.approx(velocity), options
        assert node.drive.scale_vel_from_dev == pytest.approx(1 / velocity), options
        assert node.drive.scale_eff_to_dev == math.copysign(1.0, node.drive.scale_pos_to_dev), (
            options
        )
        (line,) = re.findall('scale_vel_to_dev.*', bus_yml.read_text())
        assert words in line, options
        if RPM_PER_S in rows:  # 0.1 rpm/s beside rpm: ten times the scale of velocities
            assert node.drive.scale_acc_to_dev == pytest.approx(-600 / TURN), options
            assert 'by 0x60A9, 0x60AA of the EDS' in bus_yml.read_text(), options


@pytest.mark.usefixtures('folder')
def test_an_epos4_is_asked_for_its_gear(capsys: Output) -> None:
    """Its EDS says rpm; with the gear the scales are those of the bus.yml that is shipped."""
    folder = REPOSITORY / 'tests' / 'drives' / 'epos4'
    new = ['new', f'shoulder={folder / "epos4_objects.eds"}@1', '--turn', 'shoulder=83200']
    assert main(new) != 0
    assert 'give --rpm shoulder=TURNS' in capsys.readouterr().err
    assert main([*new, '--rpm', 'shoulder=26']) == 0
    (made,), shipped = load_bus(Path('bus.yml')).nodes, load_bus(folder / 'bus.yml').nodes[0]
    assert made.drive.scale_vel_to_dev == shipped.drive.scale_vel_to_dev
    assert made.drive.scale_pos_to_dev == shipped.drive.scale_pos_to_dev


@pytest.mark.parametrize('row', [COUNTS, RPM, DEGREES])
def test_what_the_master_reads_from_the_drive_is_not_written_out(tmp_path: Path, row: Row) -> None:
    """The factor group says what the positions are of, and 0x60A9 the velocities."""
    eds, bus_yml = written(tmp_path, 'drive.eds', [*SAMPLE, row]), tmp_path / 'bus.yml'
    assert main(['new', f'arm={eds}@5', '--output', str(bus_yml)]) == 0
    text = bus_yml.read_text()
    assert 'scale_from_factor_group: true' in text
    assert 'scale_vel_to_dev' not in text
    assert '# velocity units per second' in text
    assert 'scale_acc_to_dev' in text


NO_COUNTS = 'how far an increment of the joint is'
ASKED: list[tuple[Sequence[Row], str, str]] = [
    (without(0x6502), '', r'arm: drive\.eds has no 0x6502.*--mode arm=8'),
    ((*without(0x6502), ONLY_VELOCITY), '', r'names no position mode in 0x6502 \(0x00000004\)'),
    (without(0x608F, 0x6092), '', f'{NO_COUNTS}.*--turn arm='),
    (without(0x6091), '', 'with the gear in 0x6091.*--turn arm=.*--metre arm='),
    (ones(), '', NO_COUNTS),
    (without(0x607A), '', '0x607A: the EDS lacks it.*no set-points'),
    (SAMPLE, '--mode arm=7 --mode arm=8', 'arm has one already'),
    (UNMAPPED, '', '0x6041: the EDS says it cannot be mapped.*correct the EDS'),
    (without(*range(0x1800, 0x1806)), '', '0x6041: the EDS has 0 TPDOs that can be mapped'),
    (SAMPLE, '--turn leg=1', "no drive 'leg'; drives: arm"),
    (SAMPLE, '--turn arm=0', '--turn arm=0: give a number of increments'),
    (SAMPLE, '--rpm arm=-3', 'arm=-3: give turns of the motor .*a number above 0 .without sign.'),
    (without(0x6091), '--rpm arm=100', NO_COUNTS),
    ((*SAMPLE, RPM), '--turn arm=1000', '0x60A9 of the EDS has 1 turns/min .*--rpm arm=TURNS'),
    ((*SAMPLE, RPM), '--metre arm=1000', 'turns of the motor for 1 m of the joint'),
    ((*SAMPLE, METRES), '--turn arm=1000', '1 m/s .*correct 0x60A9 in the EDS'),
    (SAMPLE, '--turn arm=far', '--turn arm=far: give a number'),
    (without(0x60C1), '--mode arm=7', '0x60C1: the EDS lacks it.*no set-points'),
    (SAMPLE, '--mode arm=3', '--mode arm=3: choose one of 8 .cyclic position'),
    (SAMPLE, 'drive.eds@2', 'is no device; write it as shoulder=drive.eds@2'),
    (SAMPLE, '2=drive.eds@2', 'is no device'),
    (SAMPLE, 'leg=drive.eds@128', '128 is no node id'),
    (SAMPLE, 'arm=drive.eds@3', 'name arm is there twice'),
    (SAMPLE, 'leg=drive.eds@5', 'node id 5 is there twice'),
    (SAMPLE, 'leg=other.eds@2', 'no such file'),
    (SAMPLE, f'leg={DRIVE.with_name("cia402_two_axes.eds")}@2', 'has axes at 0x6040, 0x6840'),
]


@pytest.mark.parametrize(('rows', 'options', 'words'), ASKED)
def test_what_is_not_said_is_asked_for(
    *, rows: Sequence[Row], options: str, words: str, folder: Path, capsys: Output
) -> None:
    """With the option or the way to write it; no file is written."""
    written(folder, 'drive.eds', rows)
    assert main(['new', 'arm=drive.eds@5', *options.split()]) != 0
    assert re.search(words, capsys.readouterr().err)
    assert not Path('bus.yml').exists()


def test_nothing_is_overwritten(folder: Path, capsys: Output) -> None:
    """Neither a bus.yml, unless --force says so, nor an EDS of the same name."""
    written(folder, 'drive.eds', SAMPLE)
    bus_yml = folder / 'bus.yml'
    bus_yml.write_text('mine')
    assert main(['new', 'arm=drive.eds@2']) == 2
    assert bus_yml.read_text() == 'mine'
    assert main(['new', 'arm=drive.eds@2', '--force']) == 0
    (folder / 'other').mkdir()
    written(folder / 'other', 'drive.eds', without(0x603F))
    assert main(['new', 'arm=drive.eds@2', '--output', 'other/bus.yml']) == 2
    assert 'rename one' in capsys.readouterr().err
    devices = ['arm=drive.eds@2', 'leg=other/drive.eds@3']
    assert main(['new', *devices, '--output', 'third/bus.yml']) == 2
    assert not (folder / 'third').exists()


@pytest.mark.parametrize(
    ('turn', 'is_doubted'), [('628318.5', False), ('3000000', False), ('62831850', True)]
)
def test_a_turn_far_above_the_factor_group_is_doubted(
    turn: str, is_doubted: bool, tmp_path: Path, capsys: Output
) -> None:
    """On the terminal, and beside the scale; a gear that the drive does not know is none."""
    eds, bus = written(tmp_path, 'drive.eds', SAMPLE), tmp_path / 'bus.yml'
    assert main(['new', f'arm={eds}@2', '--turn', f'arm={turn}', '--output', str(bus)]) == 0
    words = 'its factor group has 100000 per rad: try which it is by a first motion'
    assert (words in capsys.readouterr().out) is is_doubted
    assert (words in bus.read_text()) is is_doubted


@pytest.mark.parametrize(
    ('rows', 'options', 'answers', 'scale', 'value'),
    [
        (without(0x608F, 0x6092), [], ['a', '', '0', ' 62831.853*2 '], 'pos', 20_000.0),
        # 0x60A9 names turns, and the increments are known by --turn alone
        ([*SAMPLE, RPM], ['--turn', 'arm=83200'], ['-1', 'fast', '26'], 'vel', 26 * 60 / TURN),
    ],
)
def test_a_person_is_asked_for_what_the_eds_does_not_say(
    *,
    rows: Sequence[Row],
    options: Sequence[str],
    answers: Sequence[str],
    scale: str,
    value: float,
    folder: Path,
    capsys: Output,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Increments, then turns of the motor; again after what is no such number."""
    written(folder, 'drive.eds', rows)
    monkeypatch.setattr('sys.stdin.isatty', lambda: True, raising=False)
    given = iter(answers)
    monkeypatch.setattr('builtins.input', lambda asked: next(given) if 'arm' in asked else '')
    assert main(['new', 'arm=drive.eds@2', *options]) == 0
    asked_again = re.findall(
        "(?m)^give .*a number .* such as .*, not '(.*)'", capsys.readouterr().out
    )
    assert asked_again == answers[:-1]
    (node,) = load_bus(folder / 'bus.yml').nodes
    assert getattr(node.drive, f'scale_{scale}_to_dev') == pytest.approx(value)


def changed(row: Row, fits: set[int], constant: set[int]) -> Row:
    """Return a row that can be mapped, or written, only where it is among those."""
    if row.index in {*OPTIONAL, *NEEDED} and row.data_type != 5:
        row = replace(row, mappable=row.index in fits)
    is_fixed = row.index in constant and (row.index < 0x1600 or row.subindex == 0)
    return replace(row, access='const') if is_fixed else row


@settings(max_examples=40)
@given(
    missing=st.sets(st.sampled_from((*OPTIONAL, *NEEDED)), max_size=3),
    gone=st.sets(st.sampled_from((0x60C2, 0x1017))),
    constant=st.sets(st.sampled_from((0x60C2, 0x1017, 0x1600, 0x1601, 0x1A00))),
    modes=st.integers(0, 0x3FF),
    pdos=st.tuples(st.integers(0, 6), st.integers(0, 6)),
    slots=st.integers(1, 8),
    period=st.integers(1, 100),
)
def test_whatever_an_eds_has_the_bus_is_without_findings_or_refused(
    *,
    missing: set[int],
    gone: set[int],
    constant: set[int],
    modes: int,
    pdos: tuple[int, int],
    slots: int,
    period: int,
) -> None:
    """Refused only where something is missing that a drive cannot do without."""
    fits = {*OPTIONAL, *NEEDED} - missing
    without_pdos = {*range(0x1400 + pdos[0], 0x1406), *range(0x1800 + pdos[1], 0x1806)}
    without_pdos |= {index + 0x200 for index in without_pdos}
    rows = [
        changed(row, fits, constant)
        for row in without(0x6502, *without_pdos, *gone)
        if not (0x1600 <= row.index < 0x1C00 and row.index & 0x200 and row.subindex > slots)
    ]
    rows.append(replace(CYCLIC_AND_PROFILE, default=hex(modes)))
    free = [
        len({*range(first, first + count)} - constant) * min(slots, 2)
        for first, count in zip((0x1600, 0x1A00), pdos, strict=True)
    ]
    cyclic, interpolated = modes & 0x81 and 0x607A in fits, modes & 0x40 and 0x60C1 in fits
    can_be = bool(cyclic or interpolated) and {0x6040, 0x6041, 0x6064} <= fits and min(free) > 1
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        device = f'arm={written(folder, "drive.eds", rows)}@9'
        arguments = ['--period', str(period), '--output', str(folder / 'bus.yml')]
        assert (main(['new', device, *arguments]) == 0) is can_be
        if can_be:
            report = check_file(folder / 'bus.yml')
            assert not report.errors
            remedies = {each.remedy for each in report.warnings}
            assert remedies <= {'map both into one RPDO', 'write heartbeat_producer: 100'}
            assert slots == 1 or 0x1017 in gone | constant or not remedies
