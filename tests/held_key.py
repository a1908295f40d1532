# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A terminal with a program in it, and a key that is held."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
import os
import pty
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
