# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 run`: the executable takes the place of the command."""

from __future__ import annotations

from collections.abc import Mapping
import os
from pathlib import Path
import signal
import subprocess

from fake_prefix import add_package
from frontend_cli import PROGRAM, Ros2, with_frontend
from processes import RunningProcess
import pytest

pytestmark = pytest.mark.slow

PRINT_ARGUMENTS = '#!/bin/sh\nfor word in "$@"; do echo "[$word]"; done\nexit 7\n'
EVERYTHING = 'broken, count_signals, print_arguments, print_ignored, twice, twice'
COUNT_SIGNALS = """\
#!/usr/bin/env python3
import signal, sys
count = 0
def take(number, frame):
    global count
    count += 1
    print('got', number, count, flush=True)
    if count == 2:
        sys.exit(3)
signal.signal(signal.SIGINT, take)
signal.signal(signal.SIGUSR1, take)
print('ready', flush=True)
while True:
    signal.pause()
"""
PRINT_IGNORED = '#!/bin/sh\ngrep SigIgn /proc/self/status\n'


@pytest.fixture
def env(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Mapping[str, str]:
    """Install a package with programs."""
    programs = {
        'print_arguments': PRINT_ARGUMENTS,
        'count_signals': COUNT_SIGNALS,
        'print_ignored': PRINT_IGNORED,
        'broken': '#!/no/such/interpreter\n',
        'a/twice': '#!/bin/sh\n',
        'b/twice': '#!/bin/sh\n',
    }
    add_package(tmp_path, 'demo', programs)
    add_package(tmp_path, 'empty')
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(tmp_path))
    return with_frontend(os.environ)


@pytest.mark.usefixtures('env')
def test_launch_names_what_to_run_instead(ros2: Ros2) -> None:
    """The executable with the name of the launch file, or all of the package."""
    for words, expected in (
        (['demo', 'twice.launch.py', 'a:=1'], 'ros2 run demo twice --help'),
        (['demo', 'other.launch.xml'], f'Executables of demo (ros2 run demo NAME): {EVERYTHING}'),
        (['empty'], 'empty has no executables'),
        (['dem', 'x.launch.py'], "Did you mean 'demo'?"),
    ):
        outcome = ros2('launch', *words)
        assert outcome.code == 1
        assert expected in outcome.err


def run(env: Mapping[str, str], *words: str) -> subprocess.CompletedProcess[str]:
    """Run a command line as a process."""
    return subprocess.run(
        [*PROGRAM, 'run', *words], env=env, capture_output=True, text=True, check=False
    )


def test_arguments_and_exit_code_pass(env: Mapping[str, str]) -> None:
    """Whatever stands behind the executable is its own, options too; its code is ours."""
    words = ('--ros-args', '-p', 'a:=b c', '--help', '--prefix', 'x')
    done = run(env, 'demo', 'print_arguments', *words)
    assert done.stdout.splitlines() == [f'[{word}]' for word in words]
    assert (done.returncode, done.stderr) == (7, '')


def test_prefix_goes_before_the_executable(env: Mapping[str, str], tmp_path: Path) -> None:
    """A wrapper gets the executable's path and arguments."""
    done = run(env, '--prefix', 'echo "two words" -x', 'demo', 'print_arguments', 'one')
    assert done.stdout == f'two words -x {tmp_path}/lib/demo/print_arguments one\n'


def test_a_signal_reaches_the_executable_once(env: Mapping[str, str]) -> None:
    """There is one process, the executable itself: no signal is doubled, lost or kept from it."""
    with RunningProcess([*PROGRAM, 'run', 'demo', 'count_signals'], env) as process:
        process.wait_for('^ready$')
        command = Path(f'/proc/{process.pid}/cmdline').read_bytes()
        assert b'count_signals' in command
        assert b'ros2_frontend' not in command
        process.signal(signal.SIGINT)
        process.wait_for(r'^got 2 1$')
        process.signal(signal.SIGUSR1)
        assert process.wait() == 3
        assert [line for line in process.lines if line.startswith('got')] == [
            'got 2 1',
            'got 10 2',
        ]


def test_sigpipe_is_as_the_shell_gave_it(env: Mapping[str, str]) -> None:
    """Python ignores SIGPIPE; a program started from a shell does not."""
    ignored = run(env, 'demo', 'print_ignored').stdout
    assert not int(ignored.split()[1], 16) & 1 << (signal.SIGPIPE - 1)


@pytest.mark.usefixtures('env')
@pytest.mark.parametrize(
    ('words', 'message'),
    [
        (('dmo', 'x'), "Package 'dmo' not found\nDid you mean 'demo'?\n"),
        (('demo', 'print_argument'), "No executable found\nDid you mean 'print_arguments'?\n"),
        (('demo', 'zzz'), f'No executable found\ndemo has: {EVERYTHING}\n'),
        (
            ('empty', 'x'),
            "No executable found\nPackage 'empty' has no executables; is it built?\n",
        ),
    ],
)
def test_what_is_not_there(ros2: Ros2, words: tuple[str, ...], message: str) -> None:
    """ros2cli's sentence, then what there is."""
    outcome = ros2('run', *words)
    assert (outcome.code, outcome.out, outcome.err) == (1, '', message)


def test_several_of_one_name_are_listed(
    ros2: Ros2, env: Mapping[str, str], tmp_path: Path
) -> None:
    """The user has to choose."""
    folder = tmp_path / 'lib/demo'
    expected = f'Multiple executables found:\n- {folder}/a/twice\n- {folder}/b/twice\n'
    assert ros2('run', 'demo', 'twice').err == expected


def test_what_cannot_be_started_says_why(
    ros2: Ros2, env: Mapping[str, str], tmp_path: Path
) -> None:
    """A missing interpreter or prefix is no traceback; this process takes signals as before."""
    numbers = (signal.SIGPIPE, signal.SIGTERM)
    before = [signal.getsignal(number) for number in numbers]
    broken = ros2('run', 'demo', 'broken')
    assert broken.code == 1
    assert broken.err == f'Cannot run {tmp_path}/lib/demo/broken: No such file or directory\n'
    missing = ros2('run', '--prefix', 'no-such-debugger', 'demo', 'print_arguments')
    assert missing.err == 'Cannot run no-such-debugger: No such file or directory\n'
    assert [signal.getsignal(number) for number in numbers] == before
