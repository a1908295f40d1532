# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``canopen new --scan``: a bus.yml of what is on a bus, by files and by what devices say."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
import math
from pathlib import Path
import time

from can_addresses import free_virtual
from eds_samples import DRIVE_ROWS, eds_text, FACTOR_ROWS, Row
from hypothesis import given
from hypothesis import strategies as st
import pytest
from tool_environment import Output

from arm_canopen import CanopenMaster, load_bus, open_bus
from arm_canopen.config import Identity, position_unit
from arm_canopen.config.model.si_unit import POSITIONS, TIMES, velocity_unit
from canopen_core.eds import load_eds
from canopen_sim import DeviceRunner, Fault, FaultInjection
from canopen_tools.cli.main import main
from canopen_tools.cli.new_scan import match_eds, NoMatchError, SeveralMatchError

LISTEN = ('--listen', '0.1')
DEADLINE = 20.0  # [s]
MODES = Row(0x6502, 0, 'Supported drive modes', 7, 'ro', '0x81')
UNIT = Row(0x60A8, 0, 'SI unit position', 7, 'rw', '0x00B50000')
SPEED_UNIT = Row(0x60A9, 0, 'SI unit velocity', 7, 'rw', '0x00B50300')
GEAR = (
    Row(0x6091, 0, 'Highest sub-index', 5, 'const', '2'),
    Row(0x6091, 1, 'Motor revolutions', 7, 'rw', '1'),
    Row(0x6091, 2, 'Shaft revolutions', 7, 'rw', '1'),
)
STORED = (
    Row(0x1021, 0, 'Store EDS', 0xF, 'ro'),
    Row(0x1022, 0, 'Store format', 5, 'ro', '0'),
)
SAMPLE = (*DRIVE_ROWS, *FACTOR_ROWS, *GEAR, MODES, UNIT, SPEED_UNIT)


def with_identity(
    rows: Sequence[Row], vendor: int = 0x555, product: int = 7, revision: int = 0x10001
) -> tuple[Row, ...]:
    """Return the rows of a device with another 0x1018."""
    numbers = {1: vendor, 2: product, 3: revision}
    return tuple(
        replace(row, default=hex(numbers[row.subindex]))
        if row.index == 0x1018 and row.subindex in numbers
        else row
        for row in rows
    )


def written(folder: Path, name: str, rows: Sequence[Row]) -> Path:
    """Write an EDS."""
    path = folder / name
    path.parent.mkdir(exist_ok=True)
    path.write_text(eds_text(rows))
    return path


@contextmanager
def devices_on(
    name: str,
    devices: Mapping[int, Path],
    values: Mapping[tuple[int, int, int], bytes] | None = None,
) -> Iterator[DeviceRunner]:
    """Simulate devices by node id; values by node id, index and sub-index are what they hold."""
    with open_bus(name) as can:
        runner = DeviceRunner(can)
        for node, path in devices.items():
            runner.host.add(node, load_eds(path).dictionary)
        runner.start()

        def fill() -> None:  # after power-on, which restores defaults
            for (node, index, subindex), data in (values or {}).items():
                variable = runner.host.device(node).store.find(index, subindex)
                variable.value = variable.decoded(data)

        runner.call(fill).result(DEADLINE)
        try:
            yield runner
        finally:
            runner.stop()


def number(value: int) -> bytes:
    """Encode an UNSIGNED32."""
    return value.to_bytes(4, 'little')


def test_a_scanned_bus_boots_and_moves(tmp_path: Path, capsys: Output) -> None:
    """Files by vendor, product and revision; units by what each drive holds; names as given."""
    files = tmp_path / 'eds'
    old = written(files, 'old.eds', with_identity(SAMPLE, revision=0x10000))
    new = written(files, 'new.eds', with_identity(SAMPLE, revision=0x20003))
    written(files, 'other.eds', with_identity(SAMPLE, product=8))
    values = {
        (2, 0x6091, 1): number(50),
        (2, 0x608F, 1): number(4096),
        (3, 0x60A8, 0): number(0xFE410000),
        (3, 0x60A9, 0): number(0x00B44700),
    }
    bus, bus_yml = free_virtual(), tmp_path / 'arm' / 'bus.yml'
    with devices_on(bus, {2: old, 3: new}, values):
        arguments = ['new', '--scan', '--can', bus, str(files), 'shoulder@2', *LISTEN]
        assert main([*arguments, '--output', str(bus_yml)]) == 0
        output = capsys.readouterr().out
        assert ': 0 errors' in output
        assert 'node 2 is shoulder' in output
        text = bus_yml.read_text()
        shoulder, elbow = load_bus(bus_yml).nodes
        assert (shoulder.eds.name, elbow.eds.name) == ('old.eds', 'new.eds')
        assert (shoulder.name, elbow.name) == ('shoulder', 'joint3')
        assert 'vendor, product and revision agree' in text
        assert 'a turn by the drive' in text
        assert elbow.drive.scale_pos_to_dev == pytest.approx(100 * 180 / math.pi)
        assert '0x60A8 of the drive: its unit is 0.01 deg' in text
        assert elbow.drive.scale_vel_to_dev == pytest.approx(60 / math.tau)
        assert '0x60A9 of the drive: its unit is 1 turns/min' in text
        assert not (tmp_path / 'arm' / 'other.eds').exists()
        with CanopenMaster.from_bus_yml(bus_yml, bus=bus) as master:
            master.boot()
            assert master.drive('joint3').enable()


def test_a_device_brings_its_own_eds(tmp_path: Path, capsys: Output) -> None:
    """From 0x1021, where no file fits; one that is compressed is not read."""
    path = written(tmp_path, 'hidden.eds', (*SAMPLE, *STORED))
    content = {(4, 0x1021, 0): path.read_bytes()}
    bus, bus_yml = free_virtual(), tmp_path / 'arm' / 'bus.yml'
    arguments = ['new', '--scan', '--can', bus, *LISTEN, '--turn', 'joint4=4096']
    with devices_on(bus, {4: path}, content):
        assert main([*arguments, '--output', str(bus_yml)]) == 0
    (node,) = load_bus(bus_yml).nodes
    assert node.eds.name == '00000555_00000007_00010001.eds'
    assert node.eds.read_bytes() == path.read_bytes()
    assert 'from the device itself (0x1021)' in bus_yml.read_text()
    assert node.drive.scale_pos_to_dev == pytest.approx(4096 / math.tau)
    capsys.readouterr()
    with devices_on(bus, {4: path}, {**content, (4, 0x1022, 0): b'\1'}):
        assert main([*arguments, '--output', str(tmp_path / 'second.yml')]) == 1
    assert 'no EDS fits' in capsys.readouterr().err


def test_every_problem_is_said_with_its_remedy(tmp_path: Path, capsys: Output) -> None:
    """Devices without an EDS and with two; then each remedy is taken."""
    mine = written(tmp_path, 'mine.eds', SAMPLE)
    twin = written(tmp_path, 'twin.eds', [*SAMPLE, Row(0x2100, 0, 'More', 7, 'rw', '1')])
    other = written(tmp_path / 'elsewhere', 'other.eds', with_identity(SAMPLE, product=9))
    bus, bus_yml = free_virtual(), tmp_path / 'bus.yml'
    arguments = ['new', '--scan', '--can', bus, *LISTEN, '--output', str(bus_yml)]
    with devices_on(bus, {2: mine, 5: other}):
        assert main([*arguments, str(mine), str(twin)]) == 1
        first, second = capsys.readouterr().err.splitlines()[-2:]
        assert 'node 2' in first
        assert 'choose with NAME=FILE.eds@2' in first
        assert 'node 5 (vendor 0x00000555, product 0x00000009' in second
        assert '--without 5' in second
        assert not bus_yml.exists()
        chosen = f'arm={mine}@2'
        assert main([*arguments, chosen, '--without', '5']) == 0
        assert [node.name for node in load_bus(bus_yml).nodes] == ['arm']
        arguments += ['--force', chosen]
        assert main([*arguments, f'lift={other}@5', '--metre', 'lift=5000']) == 0
        assert load_bus(bus_yml).nodes[1].drive.scale_pos_to_dev == 5000
        capsys.readouterr()
        for more, words in (
            (['leg@9'], 'node 9 does not answer; on the bus: 2, 5'),
            (['leg@2'], 'node 2 is there already, as arm'),
            (['nowhere.eds'], 'no such file'),
            (['--without', '2', '--without', '5'], 'every device was left out'),
        ):
            assert main([*arguments, *more]) != 0
            assert words in capsys.readouterr().err


def test_two_devices_with_one_node_id(tmp_path: Path, capsys: Output) -> None:
    """Both answer; by the scan itself, too, and by a simulated device that stands for two."""
    path = written(tmp_path, 'drive.eds', SAMPLE)
    bus = free_virtual()
    with devices_on(bus, {2: path}), devices_on(bus, {2: path}):
        output = ['--output', str(tmp_path / 'bus.yml')]
        assert main(['new', '--scan', '--can', bus, *LISTEN, str(path), *output]) == 1
        assert 'several devices have this node id; switch' in capsys.readouterr().err
        assert main(['scan', '--can', bus, *LISTEN]) == 1
        assert 'node 2: several devices answer' in capsys.readouterr().err
    with devices_on(bus, {2: path}) as runner:
        inject = partial(
            runner.host.device(2).faults.inject, FaultInjection(Fault.NODE_ID_CONFLICT)
        )
        runner.call(lambda: inject(time.monotonic())).result(DEADLINE)
        assert main(['scan', '--can', bus, *LISTEN]) == 1
        assert 'node 2: several devices answer' in capsys.readouterr().err


def test_a_silent_bus(tmp_path: Path, capsys: Output) -> None:
    """What to look at is said."""
    arguments = ['new', '--scan', '--can', free_virtual(), *LISTEN]
    assert main([*arguments, '--output', str(tmp_path / 'bus.yml')]) == 1
    assert 'is the bus powered, wired and terminated' in capsys.readouterr().err


def test_all_node_ids_used(tmp_path: Path, capsys: Output) -> None:
    """The master needs one."""
    path = written(tmp_path, 'drive.eds', SAMPLE)
    devices = [f'joint{node}={path}@{node}' for node in range(1, 128)]
    turns = [f'--turn=joint{node}=4096' for node in range(1, 128)]
    assert main(['new', *devices, *turns, '--output', str(tmp_path / 'bus.yml')]) == 1
    assert 'put a device on another bus' in capsys.readouterr().err
    assert main(['new', '--output', str(tmp_path / 'bus.yml')]) == 2
    assert '--scan' in capsys.readouterr().err


def test_the_nearest_revision_counts(tmp_path: Path) -> None:
    """The same, else the same major one, else any; other vendors and profiles never."""
    paths = {
        revision: written(tmp_path, f'{revision:x}.eds', with_identity(SAMPLE, revision=revision))
        for revision in (0x10001, 0x10002, 0x20000)
    }
    files = [load_eds(path) for path in paths.values()]
    identity = Identity(0x20192, 0x555, 7, 0x20000)
    assert match_eds(identity, files).eds.path == paths[0x20000]
    assert match_eds(replace(identity, revision_number=0x20001), files).eds.path == paths[0x20000]
    with pytest.raises(SeveralMatchError, match=r'10001\.eds.*10002\.eds'):
        match_eds(replace(identity, revision_number=0x10003), files)
    assert 'differs' in match_eds(replace(identity, revision_number=0x30000), files[2:]).reason
    assert match_eds(identity, [files[2], files[2]]).eds.path == paths[0x20000]
    for wrong in ({'vendor_id': 1}, {'product_code': 1}, {'device_type': 0x30191}):
        with pytest.raises(NoMatchError, match='no EDS fits'):
            match_eds(replace(identity, **wrong), files)
    with pytest.raises(NoMatchError, match='does not say who it is'):
        match_eds(Identity(0x20192), files)
    # many EDS have the numbers in [DeviceInfo] alone
    path = written(tmp_path, 'drive.eds', with_identity(SAMPLE, vendor=0, product=0, revision=0))
    info = 'VendorNumber=0x555\nProductNumber=7\nRevisionNumber=0x20000\n'
    path.write_text(path.read_text().replace('[DeviceInfo]\n', f'[DeviceInfo]\n{info}'))
    assert match_eds(identity, [load_eds(path)]).reason == 'vendor, product and revision agree'


@given(
    prefix=st.integers(-9, 9),
    code=st.sampled_from(sorted(POSITIONS)),
    time=st.sampled_from(sorted(TIMES)),
)
def test_units_of_drives(prefix: int, code: int, time: int) -> None:
    """A power of ten, a unit, and for velocities a time."""
    value = (prefix & 0xFF) << 24 | code << 16
    position, velocity = position_unit(value), velocity_unit(value | time << 8)
    assert position is not None
    assert velocity is not None
    assert position.size == pytest.approx(10.0**prefix * POSITIONS[code].size)
    assert velocity.size == pytest.approx(position.size / TIMES[time][0])
    assert position_unit(value | time << 8) is None
    assert velocity_unit(value) is None
    for nothing in (None, 0, 0x00B50000, 0x00AC0000):  # not there, increments, steps
        assert position_unit(nothing) is velocity_unit(nothing) is None
