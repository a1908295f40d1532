# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Terminals with a program in them: one in which a key is held, and one of tmux to look at."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
import os
from pathlib import Path
import pty
import re
import select
import subprocess
import threading
import time

PERIOD = 0.05  # [s] between two strokes


@contextmanager
def held_key(key: str, command: Sequence[str], env: Mapping[str, str]) -> Iterator[None]:
    """Run a program in a terminal in which a key is held; none with an empty one."""
    terminal, inside = pty.openpty()
    released = threading.Event()

    def repeat() -> None:
        stroke = time.monotonic()
        while not released.is_set():
            if select.select([terminal], [], [], PERIOD)[0]:
                os.read(terminal, 65536)
            if time.monotonic() >= stroke:
                stroke = time.monotonic() + PERIOD
                os.write(terminal, key.encode())

    try:
        with subprocess.Popen(
            ['setsid', '--ctty', *command],
            env={**env, 'TERM': 'xterm'},
            stdin=inside,
            stdout=inside,
            stderr=inside,
        ) as process:
            holding = threading.Thread(target=repeat, name='key')
            holding.start()
            try:
                yield
            finally:
                released.set()
                holding.join()
                process.kill()
    finally:
        os.close(terminal)
        os.close(inside)


TIMEOUT = 30.0  # [s] of a test on a busy machine


class Pane:
    """One pane of a tmux server of its own."""

    def __init__(self, folder: Path, environment: dict[str, str]) -> None:
        self._socket = str(folder / 'tmux.socket')
        self._environment = environment
        self.tmux('-f', '/dev/null', 'new-session', '-d', '-x', '100', '-y', '30', 'sh')

    def tmux(self, *arguments: str) -> str:
        """Run a tmux command."""
        return subprocess.run(
            ['tmux', '-S', self._socket, *arguments],
            env=self._environment,
            capture_output=True,
            text=True,
            timeout=TIMEOUT,
            check=True,
        ).stdout

    def press(self, *keys: str) -> None:
        """Press keys."""
        self.tmux('send-keys', *keys)

    def screen(self) -> str:
        """Return what a person sees."""
        return self.tmux('capture-pane', '-p')

    def wait_for(self, pattern: str) -> str:
        """Wait until something is on the screen."""
        deadline = time.monotonic() + TIMEOUT
        while not re.search(pattern, screen := self.screen()):
            assert time.monotonic() < deadline, f'no {pattern!r} in\n{screen}'
            time.sleep(0.05)
        return screen

    def stop(self) -> None:
        """End the server and what runs in it."""
        self.tmux('kill-server')
