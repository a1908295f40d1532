# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A real terminal for programs that are used with keys."""

from __future__ import annotations

from pathlib import Path
import re
import subprocess
import time

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
