# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Programs that are forked are as if they had been executed."""

from __future__ import annotations

from collections.abc import Iterator
import os
from pathlib import Path
import signal
import sys

import pytest
from small_processes import wait_for_end

from process_supervisor import Executable, ForkServer, ProcessSpec, Runner

pytestmark = pytest.mark.slow

PROGRAM = """\
import os, pathlib, signal, sys
own = pathlib.Path('/proc/self')
print(__name__, sys.argv[1:], sys.path[0] == str(pathlib.Path(__file__).parent))
print('wave' in sys.modules, os.environ['WORD'], 'PYTEST_CURRENT_TEST' in os.environ)
print(os.getsid(0) == os.getpid(), sorted(os.listdir('/proc/self/fd'))[:3], os.nice(0))
print((own / 'comm').read_text().strip(), (own / 'cmdline').read_bytes().split(b'\\0')[1:])
print(signal.pthread_sigmask(signal.SIG_BLOCK, []), file=sys.stderr)
if len(sys.argv) > 1: sys.exit(int(sys.argv[1]))
os.kill(os.getpid(), signal.SIGTERM)
"""


@pytest.fixture
def server() -> Iterator[ForkServer]:
    """Start one that has nothing to import but what does not exist."""
    with ForkServer([Executable('none', 'such')]) as server:
        yield server


def run(server: ForkServer | None, *argv: str) -> tuple[str, list[str]]:
    """Run a program to its end; return how it ended, and its output."""
    lines: list[str] = []
    spec = ProcessSpec('it', argv, environment={'WORD': 'ä'})
    write, notify = (lambda _, line: lines.append(line)), (lambda _: None)
    with Runner([spec], write, notify, fork_server=server) as runner:
        return runner.run().reason, lines


@pytest.fixture
def script(tmp_path: Path) -> str:
    """Write the program as an executable of this interpreter."""
    path = tmp_path / 'a_long_program_name'
    path.write_text(f'#!{sys.executable}\n{PROGRAM}')
    path.chmod(0o755)
    return str(path)


@pytest.mark.parametrize('words', [('7', 'x y'), ()])
def test_a_forked_program_is_as_an_executed_one(
    server: ForkServer, script: str, words: tuple[str, ...]
) -> None:
    """Output, exit code or signal, variables, session, signal mask, niceness, name in ps."""
    command = ('nice', '-n', '3', script, *words)
    forked, executed = run(server, *command), run(None, *command)
    assert forked == executed
    assert forked[0] == ('it ended with exit code 7' if words else 'it was killed by SIGTERM')
    assert len(forked[1]) == 5


def test_what_is_no_program_of_this_interpreter_is_executed(
    server: ForkServer, tmp_path: Path
) -> None:
    """A shell script, and what does not exist, as ever."""
    path = tmp_path / 'shell'
    path.write_text('#!/bin/sh\necho $WORD $1; exit 3\n')
    path.chmod(0o755)
    assert run(server, str(path), 'b') == ('it ended with exit code 3', ['ä b'])
    assert run(server, '/none/such')[0].startswith('it cannot be started: /none/such: No such')


def test_programs_start_without_the_server_when_it_was_killed(
    server: ForkServer, script: str
) -> None:
    """The supervisor executes them."""
    os.kill(server.pid, signal.SIGKILL)
    assert not wait_for_end([server.pid])
    assert run(server, script, '7')[0] == 'it ended with exit code 7'


def test_the_server_ignores_what_stops_a_bring_up(server: ForkServer, script: str) -> None:
    """A supervisor that manages services may signal all processes of one; exit codes count."""
    run(server, script, '0')  # it has begun
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        os.kill(server.pid, number)
    assert run(server, script, '7')[0] == 'it ended with exit code 7'
