# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Runs a bring-up as a program, with small processes in place of the real ones."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
import contextlib
import os
from pathlib import Path
import subprocess
import sys

from small_processes import NOTIFY, TIMEOUT

SOURCES = Path(__file__).parents[3]  # the checkout

PROGRAM = """#!{python} -IS
import os, signal, sys
{notify}
def leave(number, frame):
    os.write(1, b'bye\\n')
    os._exit(0)
signal.signal(signal.SIGTERM, leave)
arguments = dict(word.split(':=', 1) for word in sys.argv if ':=' in word)
arguments |= {{word: after for word, after in zip(sys.argv, sys.argv[1:])}}
print({line!r}.format_map(arguments), flush=True)
if {ready}: notify()
{then}
while True: signal.pause()
"""


class SmallWorkspace:
    """Installed packages whose programs only report that they are ready.

    Attributes:
        folder: Where they are installed; the bring-up has its temporary files there, too.
        environment: Of the bring-up.
        setup: Statements that its process runs first.
    """

    setup = ''

    def __init__(
        self,
        folder: Path,
        package: str,
        lines: Mapping[tuple[str, str], str],
        sources: Sequence[str],
        prefixes: Sequence[Path] = (),
    ) -> None:
        """Install the programs.

        Args:
            folder: An empty folder.
            package: Whose bring-up it is.
            lines: What each program of a package writes, with ``{port}`` for its parameter and
                ``{--link}`` for what follows that option.
            sources: Packages whose source is used.
            prefixes: Of packages that are installed elsewhere.
        """
        self.folder = folder
        self._package, self._lines = package, lines
        for of, name in lines:
            self.install(of, name)
        self.environment = {
            **os.environ,
            'NO_VIEW': '1',
            'AMENT_PREFIX_PATH': os.pathsep.join(map(str, (folder / 'prefix', *prefixes))),
            'PYTHONPATH': os.pathsep.join(str(SOURCES / name) for name in sources),
            'TMPDIR': str(folder),
        }

    def install(
        self,
        package: str,
        name: str,
        then: str = '',
        line: str | None = None,
        *,
        ready: bool = True,
    ) -> None:
        """Install a program.

        Args:
            package: Whose it is.
            name: What it is called.
            then: A statement that it runs after that.
            line: What it writes; None takes the usual line.
            ready: It reports that it is ready.
        """
        prefix = self.folder / 'prefix'
        marker = prefix / 'share' / 'ament_index' / 'resource_index' / 'packages' / package
        file = prefix / 'lib' / package / name
        for path in (marker, file):
            path.parent.mkdir(parents=True, exist_ok=True)
        marker.touch()
        line = self._lines[package, name] if line is None else line
        file.write_text(
            PROGRAM.format(python=sys.executable, notify=NOTIFY, line=line, ready=ready, then=then)
        )
        file.chmod(0o755)

    @contextlib.contextmanager
    def bringup(self, *arguments: str) -> Iterator[subprocess.Popen[str]]:
        """Start a bring-up."""
        run = f'import sys; from {self._package}.bringup import main; sys.exit(main())'
        code = f'{self.setup}\n{run}'
        with subprocess.Popen(
            [sys.executable, '-c', code, *arguments],
            env=self.environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        ) as process:
            try:
                yield process
            finally:
                process.kill()

    def run(self, *arguments: str) -> tuple[int, str]:
        """Run a bring-up to its end."""
        with self.bringup(*arguments) as process:
            output, _ = process.communicate(timeout=TIMEOUT)
            return process.returncode, output


def read_until(process: subprocess.Popen[str], words: str) -> str:
    """Read the output of a bring-up until some words come."""
    assert process.stdout is not None
    seen = ''
    for line in process.stdout:
        seen += line
        if words in line:
            return seen
    raise AssertionError(f'no {words!r} in:\n{seen}')
