# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``canopen first-motion`` as a process at a pseudo-terminal, with simulated drives on a bus."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
import math
import os
from pathlib import Path
import pty
import re
import select
import signal
import subprocess
import sys
import time

from can_addresses import free_multicast
import pytest
from tool_environment import ENVIRONMENT, Output, REPOSITORY

from arm_canopen import DriveState, load_bus
from arm_canopen.config import FactorGroup
from canopen_sim import DeviceRunner, Fault, FaultInjection, simulated_devices
from canopen_tools.cli.main import main
from canopen_tools.first_motion.checks import AxisFacts
from canopen_tools.first_motion.motion import Record
from first_motion import Outcome

pytestmark = pytest.mark.slow

DRIVE = REPOSITORY / 'arm_canopen' / 'eds' / 'cia402_drive.eds'
PER_TURN = 36_000  # [inc] of the simulated joints
DEADLINE = 60.0  # [s]
REPEAT = 0.03  # [s] of a keyboard
RELEASE = 0.6  # [s] after which a key is up in any case
ESCAPES = re.compile(r'\x1b\[[0-9;?<>=]*[a-zA-Z]|[\r\x1b]')


class Person:
    """Sits at a terminal without key releases, as most are."""

    def __init__(self, master: int, process: subprocess.Popen[bytes]) -> None:
        self.master = master
        self.process = process
        self.screen = ''
        self._read = 0

    def type(self, text: str) -> None:
        """Type characters; those that nobody takes any more are lost."""
        with suppress(OSError):
            os.write(self.master, text.encode())

    def await_text(self, pattern: str, *, hold: str = '') -> str:
        """Wait for a text behind that of the last call; a key may be held meanwhile."""
        deadline = time.monotonic() + DEADLINE
        while (match := re.compile(pattern).search(self.screen, self._read)) is None:
            assert time.monotonic() < deadline, f'no {pattern!r} in\n{self.screen}'
            self._repeat(hold)
            if not self._look(REPEAT):
                match = re.compile(pattern).search(self.screen, self._read)
                assert match is not None, f'no {pattern!r} at the end of\n{self.screen}'
                break
        self._read = match.end()
        return match[0]

    def await_true(self, condition: Callable[[], bool], *, hold: str = '') -> None:
        """Wait until something is so; a key may be held meanwhile."""
        deadline = time.monotonic() + DEADLINE
        while not condition():
            assert time.monotonic() < deadline, self.screen
            self._repeat(hold)
            self._look(REPEAT)

    def await_end(self) -> int:
        """Read until the program has ended; return its exit code."""
        deadline = time.monotonic() + DEADLINE
        while self.process.poll() is None:
            assert time.monotonic() < deadline, self.screen
            self._look(REPEAT)
        while self._look(0.0):
            pass
        return self.process.returncode

    def hang_up(self) -> None:
        """Close the window."""
        os.close(self.master)
        self.master = -1

    def _repeat(self, key: str) -> None:
        """Send a held key once more; let go of it first where the program wants that."""
        last = max(map(self.screen.rfind, ('moving |', 'at rest |')))
        if key and self.screen.rfind('release the key') > last:
            end = time.monotonic() + RELEASE
            while time.monotonic() < end:
                self._look(REPEAT)
        self.type(key)

    def _look(self, wait: float) -> bool:
        """Read what is shown; return whether there may be more."""
        if self.master < 0:
            time.sleep(wait)
            return False
        if not select.select([self.master], [], [], wait)[0]:
            return wait > 0.0
        try:
            data = os.read(self.master, 65536)
        except OSError:
            return False
        self.screen += ESCAPES.sub('', data.decode(errors='replace'))
        return bool(data)


@contextmanager
def person_at(arguments: list[str]) -> Iterator[Person]:
    """Start the program in a session of its own, whose terminal is a new one."""
    master, slave = pty.openpty()
    command = ['setsid', '--ctty', sys.executable, '-m', 'canopen_tools.cli.main', *arguments]
    environment = ENVIRONMENT | {'TERM': 'xterm', 'COLUMNS': '120', 'SSH_CONNECTION': 'away'}
    with subprocess.Popen(
        command, env=environment, stdin=slave, stdout=slave, stderr=slave
    ) as process:
        os.close(slave)
        person = Person(master, process)
        try:
            yield person
        finally:
            process.kill()
            if person.master >= 0:
                os.close(person.master)


def robot(folder: Path, per_turn: float, mode: int) -> Path:
    """Write the bus.yml of two joints."""
    path = folder / 'bus.yml'
    joints = ('shoulder', 'elbow')
    devices = [f'{name}={DRIVE}@{node}' for node, name in enumerate(joints, 2)]
    turns = [f'--turn={name}={per_turn}' for name in joints]
    modes = [f'--mode={name}={mode}' for name in joints]
    assert main(['new', *devices, *turns, *modes, '--output', str(path)]) == 0
    return path


def increments(runner: DeviceRunner) -> float:
    """Return where the motor of the shoulder is, in truth."""
    return runner.call(lambda: runner.host.device(2).drives[0].position).result(DEADLINE)


def speed(runner: DeviceRunner) -> float:
    """Return how fast it turns in [inc/s]."""
    return runner.call(lambda: runner.host.device(2).drives[0].velocity).result(DEADLINE)


def state(runner: DeviceRunner) -> DriveState:
    """Return the state of the drive of the shoulder."""
    return runner.call(lambda: runner.host.device(2).drives[0].state).result(DEADLINE)


def test_a_wrong_sign_and_scale_are_found_and_corrected(tmp_path: Path) -> None:
    """Encoder lines in the place of edges, the other way round; in the drive's own mode 1."""
    name = free_multicast()
    truth, mine = tmp_path / 'truth', tmp_path / 'mine'
    sim = robot(truth, PER_TURN, 1)
    bus_yml = robot(mine, -PER_TURN / 4, 1)
    arguments = ['first-motion', str(bus_yml), 'shoulder', '--can', name, '--speed', '2deg']
    with simulated_devices(sim, bus=name) as runner, person_at(arguments) as person:
        person.await_text(r'enable shoulder and move it\? \[y/N\] ')
        assert state(runner) is not DriveState.OPERATION_ENABLED
        person.type('y\n')
        person.await_text('Hold the space bar')
        person.await_true(lambda: increments(runner) < -5, hold=' ')
        person.await_text('moving')
        person.await_text('at rest')
        person.await_true(lambda: abs(speed(runner)) < 1.0)
        person.await_text('which way', hold=' ')
        assert state(runner) is not DriveState.OPERATION_ENABLED
        seen = increments(runner) * 360 / PER_TURN  # [deg]
        assert seen == pytest.approx(-0.25, abs=0.05)
        person.type('-\n')
        person.await_text('how far')
        person.type(f'{abs(seen):.2f}\n')
        person.await_text('wrong sign and wrong scale')
        person.await_text('edges')
        person.await_text('change them')
        person.type('y\n')
        person.await_text('repeat the motion')
        before = increments(runner)
        person.type('y\n')
        person.await_text('enable shoulder')
        person.type('y\n')
        person.await_text('Hold the space bar')
        person.await_text('which way', hold=' ')
        assert (increments(runner) - before) * 360 / PER_TURN == pytest.approx(1.0, abs=0.1)
        person.type('+\n')
        person.await_text('how far')
        person.type('\n')
        person.await_text('direction and distance are right')
        assert person.await_end() == 0
    shoulder, elbow = (node.drive for node in load_bus(bus_yml).nodes)
    assert shoulder.scale_pos_to_dev == pytest.approx(PER_TURN / math.tau)
    assert shoulder.scale_eff_to_dev == 1.0
    assert elbow.scale_pos_to_dev == pytest.approx(-PER_TURN / 4 / math.tau)


@pytest.mark.parametrize('end', ['release', 'ctrl_c', 'hang_up', 'terminate', 'fault'])
def test_whatever_ends_it_the_drive_stands_without_power(end: str, tmp_path: Path) -> None:
    """Released, it stands; interrupted, hung up, terminated or faulted, it is disabled, too."""
    name = free_multicast()
    bus_yml = robot(tmp_path, PER_TURN, 8)
    arguments = ['first-motion', str(bus_yml), 'shoulder', '--can', name, '--distance', '20deg']
    with simulated_devices(bus_yml, bus=name) as runner, person_at(arguments) as person:
        person.await_text(r'enable shoulder and move it\? \[y/N\] ')
        person.type('y\n')
        person.await_text('Hold the space bar')
        start = increments(runner)
        person.await_true(lambda: increments(runner) > start + 10, hold=' ')
        assert state(runner) is DriveState.OPERATION_ENABLED
        if end == 'release':
            person.await_text('moving')
            person.await_text('at rest')
            person.await_true(lambda: abs(speed(runner)) < 1.0)
            assert state(runner) is DriveState.OPERATION_ENABLED
            person.type('\n')
            person.await_text('ended by you before the target')
            person.await_text('which way')
            person.type('q\n')
            person.await_text('type one of')
            person.hang_up()
        elif end == 'ctrl_c':
            person.type('\x03')
        elif end == 'hang_up':
            person.hang_up()
        elif end == 'terminate':
            person.process.send_signal(signal.SIGTERM)
        else:
            fault = FaultInjection(Fault.OVER_CURRENT)
            device = runner.host.device(2)
            runner.call(lambda: device.faults.inject(fault, time.monotonic())).result(DEADLINE)
        code = person.await_end()
        assert state(runner) is not DriveState.OPERATION_ENABLED
        assert increments(runner) < start + PER_TURN * 10 / 360
    if end in {'release', 'hang_up'}:
        assert code != 0
        return
    words = {
        'ctrl_c': 'shoulder stands without power: 0x0250.*ended by you',
        'terminate': 'shoulder stands without power: 0x0250.*interrupted',
        'fault': 'shoulder stands without power: .*0x0218.*the drive cannot go on: .*0x2310',
    }
    assert re.search(words[end], person.screen, re.DOTALL), person.screen
    assert code == (128 + signal.SIGTERM if end == 'terminate' else 1)


def test_who_does_not_agree_moves_nothing(tmp_path: Path) -> None:
    """Enter is a no; what is no first motion is refused before."""
    name = free_multicast()
    bus_yml = robot(tmp_path, PER_TURN, 8)
    arguments = ['first-motion', str(bus_yml), 'shoulder', '--can', name]
    with simulated_devices(bus_yml, bus=name) as runner, person_at(arguments) as person:
        person.await_text(r'\[y/N\] ')
        person.type('\n')
        person.await_text('nothing was moved')
        assert person.await_end() == 1
        assert increments(runner) == 0.0


@pytest.mark.parametrize(
    ('options', 'words'),
    [
        (['--distance', '90deg'], 'a first motion is short'),
        (['--speed', '60deg'], 'a first motion is slow'),
        (['--speed', '2mm'], 'a first motion is slow'),
        ([], "no joint 'wrist'.*shoulder, elbow"),
    ],
)
def test_what_is_no_first_motion(
    options: list[str], words: str, tmp_path: Path, capsys: Output, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is refused before the bus is opened."""
    bus_yml = robot(tmp_path, PER_TURN, 8)
    monkeypatch.setattr('sys.stdin.isatty', lambda: True, raising=False)
    assert main(['first-motion', str(bus_yml), 'wrist', '--can', 'no:such', *options]) == 1
    assert re.search(words, capsys.readouterr().err)


@pytest.mark.parametrize(
    ('write', 'seen', 'changes', 'factor', 'code'),
    [
        (True, ['-', '', 'n'], True, -1.0, 1),
        (False, ['-', '', 'n'], False, -1.0, 1),
        (True, ['+', '0.019', ''], False, 1.0, 1),
        (True, ['+', '0.019', '2', 'y', 'n'], True, 180 / math.pi, 1),
        (True, ['+', '17', 'n'], False, 17.0, 1),
        (True, ['+', '1.2'], False, 1.0, 0),
        (True, ['x', '0'], False, 1.0, 1),
        (True, ['o'], False, 1.0, 1),
    ],
)
def test_what_is_changed_and_what_is_asked(
    *,
    write: bool,
    seen: list[str],
    changes: bool,
    factor: float,
    code: int,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """With --write nothing is asked where one cause fits; a choice and an estimate are."""
    bus_yml = robot(tmp_path, PER_TURN, 8)
    before = bus_yml.read_text()
    axis = replace(load_bus(bus_yml).nodes[0].drive, name='shoulder')
    factors = FactorGroup(gear=50.0)
    record = Record(
        Outcome.REACHED, 'there', 0.0, math.radians(1), AxisFacts(axis, factors, None, None, 0.01)
    )
    monkeypatch.setattr('canopen_tools.first_motion.program.move', lambda *_: record)
    monkeypatch.setattr('sys.stdin.isatty', lambda: True, raising=False)
    answers = iter(seen)
    monkeypatch.setattr('builtins.input', lambda _: next(answers))
    options = ['--write'] if write else []
    assert main(['first-motion', str(bus_yml), 'shoulder', *options]) == code
    assert next(answers, None) is None
    assert (bus_yml.read_text() != before) is changes
    if changes:
        scale = load_bus(bus_yml).nodes[0].drive.scale_pos_to_dev
        assert scale == pytest.approx(PER_TURN / math.tau * factor)


def test_without_the_keyboard_library(
    tmp_path: Path, capsys: Output, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As in an environment of `pip install ./canopen_tools`: the extra that it needs is named."""
    bus_yml = robot(tmp_path, PER_TURN, 8)
    for module in [each for each in sys.modules if each.startswith('canopen_tools.first_motion.')]:
        monkeypatch.delitem(sys.modules, module)
    monkeypatch.setitem(sys.modules, 'operator_input', None)
    assert main(['first-motion', str(bus_yml), 'shoulder']) == 2
    assert './canopen_tools[first_motion]' in capsys.readouterr().err


def test_without_a_terminal_nothing_is_begun(
    tmp_path: Path, capsys: Output, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A script holds no key."""
    bus_yml = robot(tmp_path, PER_TURN, 8)
    monkeypatch.setattr('sys.stdin.isatty', lambda: False, raising=False)
    assert main(['first-motion', str(bus_yml), 'shoulder', '--can', 'virtual:none']) == 1
    assert 'start this in a terminal' in capsys.readouterr().err
    assert main(['first-motion', str(bus_yml), 'shoulder', '--speed', 'fast']) == 2
    assert '--speed' in capsys.readouterr().err
