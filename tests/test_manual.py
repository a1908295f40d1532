# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The commands of the manual are run as they are printed there, and print what it shows."""

from __future__ import annotations

from contextlib import ExitStack
from itertools import groupby
from operator import attrgetter
import os
from pathlib import Path
import pty
import re
import select
import subprocess
import time

from isolation import Isolation
from manual_page import CHECKOUT, Command, commands, How, line_pattern, PAGES
from processes import RunningProcess
import pytest

pytestmark = pytest.mark.scenario

TIMEOUT = 60.0  # [s] of one command, on a busy machine
HERE = {How.RUN, How.TOGETHER, How.FAILS, How.STAYS, How.INTERRUPTED, How.KEYS}
ESCAPES = re.compile(r'\x1b\[[0-9;?<>=]*[a-zA-Z]|[\r\x1b]')
RUN_HERE = [page for page in PAGES if any(each.how in HERE for each in commands(page))]


@pytest.mark.parametrize(
    'page', RUN_HERE, ids=[str(page.relative_to(CHECKOUT / 'docs')) for page in RUN_HERE]
)
def test_commands_print_what_the_page_shows(
    page: Path, isolation: Isolation, tmp_path: Path
) -> None:
    """One after another, at the top of the checkout; what stays runs until all are through."""
    env = isolation.env | {'HOME': str(tmp_path)}
    with ExitStack() as stack:
        for _, block in groupby(commands(page), attrgetter('block')):
            running = []
            for command in block:
                if command.how is How.KEYS:
                    assert_in_terminal(command, env)
                elif command.how in HERE:
                    shell = ['bash', '-c', f'cd {CHECKOUT} && {command.text}']
                    process = stack.enter_context(RunningProcess(shell, env))
                    if command.how is How.TOGETHER:
                        running.append((command, process))
                    else:
                        assert_printed(command, process)
            for command, process in running:
                assert_printed(command, process)


def assert_printed(command: Command, process: RunningProcess) -> None:
    """Wait for the end of a command, or for all that it has to print."""
    if command.how in {How.STAYS, How.INTERRUPTED}:
        for shown in command.shown:
            if shown.strip() not in {'', '...'}:
                process.wait_for(line_pattern(shown).pattern, TIMEOUT)
        if command.how is How.INTERRUPTED:
            process.stop()
        return
    code = process.wait(TIMEOUT)
    assert (code != 0) is (command.how is How.FAILS), f'{command.text}\n{process.output}'
    assert not command.missing(process.lines), f'{command.text}\n{process.output}'


def assert_in_terminal(command: Command, env: dict[str, str]) -> None:
    """Run a command in a terminal until all was printed, then press the keys that end it."""
    master, slave = pty.openpty()
    try:
        with subprocess.Popen(
            ['bash', '-c', f'cd {CHECKOUT} && exec {command.text}'],
            env=env | {'TERM': 'xterm', 'COLUMNS': '100', 'LINES': '30'},
            stdin=slave,
            stdout=slave,
            stderr=slave,
            start_new_session=True,
        ) as process:
            try:
                assert_shown(command, master)
                os.write(master, command.detail.encode())
                assert process.wait(TIMEOUT) == 0
            finally:
                process.kill()
    finally:
        os.close(master)
        os.close(slave)


def assert_shown(command: Command, terminal: int) -> None:
    """Read a terminal until all that the page shows has come."""
    seen, deadline = b'', time.monotonic() + TIMEOUT
    while command.missing(lines := ESCAPES.sub('', seen.decode(errors='replace')).splitlines()):
        assert time.monotonic() < deadline, '\n'.join(lines)
        if select.select([terminal], [], [], 0.5)[0]:
            seen += os.read(terminal, 65536)
