# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The guardian: a small process that stops the others when their supervisor was killed.

A supervisor that gets SIGKILL (or is the victim of the memory killer) cannot stop anybody, and its
processes would go on: a master with enabled drives. So the supervisor starts this process first
and keeps one end of a pipe to it. When the pipe ends without ``bye``, the supervisor is gone,
and the guardian stops the processes in the same order and by the same signals.

It runs ``python -I -S``, so it needs the standard library only and starts in a few milliseconds,
in its own session, so that no Ctrl-C reaches it.

Messages are lines of JSON:

=====================================================  ==================================
``{"pid": 7, "name": "master", "order": 0, "steps": [[2, 5.0], [9, 2.0]]}``  take it in
``{"gone": "master"}``                                 it has ended
``{"bye": true}``                                      the supervisor ends by itself
=====================================================  ==================================
"""

from __future__ import annotations

from collections.abc import Mapping
import contextlib
import json
import os
from pathlib import Path
import select
from signal import SIG_IGN, signal, Signals
import subprocess
import sys
import time
from typing import Any

from .stopping import StopSequence


class Guardian:
    """What the guardian knows: the processes, by name, and how to stop them."""

    def __init__(self) -> None:
        self._pidfds: dict[str, int] = {}
        self._pids: dict[str, int] = {}
        self._sequence = StopSequence(self._send)
        self.dismissed = False

    def take(self, message: Mapping[str, Any]) -> None:
        """Process a message of the supervisor."""
        if 'pid' in message:
            self._watch(message)
        elif 'gone' in message:
            self._forget(message['gone'])
        else:
            self.dismissed = True

    def _watch(self, message: Mapping[str, Any]) -> None:
        name = message['name']
        with contextlib.suppress(ProcessLookupError):  # it has already ended
            self._pidfds[name] = os.pidfd_open(message['pid'])
            self._pids[name] = message['pid']
            steps = [(Signals(number), timeout) for number, timeout in message['steps']]
            self._sequence.add(name, message['order'], steps)

    def _forget(self, name: str) -> None:
        self._sequence.exited(name)
        self._pids.pop(name, None)
        if (pidfd := self._pidfds.pop(name, None)) is not None:
            os.close(pidfd)

    def _send(self, name: str, number: Signals) -> None:
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(self._pids[name], number)

    def stop_all(self) -> None:
        """Stop all processes in order; return when they have ended."""
        while not self._sequence.finished:
            self._sequence.advance(time.monotonic())
            self._wait()

    def _wait(self) -> None:
        deadline = self._sequence.next_deadline()
        timeout = None if deadline is None else max(0.0, deadline - time.monotonic())
        names = {pidfd: name for name, pidfd in self._pidfds.items()}
        for pidfd in select.select(list(names), [], [], timeout)[0]:
            self._send(names[pidfd], Signals.SIGKILL)  # what it may have left behind in its group
            self._forget(names[pidfd])


def main() -> None:
    """Watch over the processes that standard input names, until it ends."""
    for number in (Signals.SIGINT, Signals.SIGTERM, Signals.SIGHUP, Signals.SIGPIPE):
        signal(number, SIG_IGN)
    guardian = Guardian()
    for line in sys.stdin:
        guardian.take(json.loads(line))
    if not guardian.dismissed:
        with contextlib.suppress(OSError):  # the terminal may be gone, too
            sys.stderr.write('the supervisor was killed: stopping what it had started\n')
        guardian.stop_all()


class GuardianLink:
    """The supervisor's end: starts the guardian and sends it what runs."""

    def __init__(self) -> None:
        package = Path(__file__).resolve().parent
        code = (
            f'import sys; sys.path.insert(0, {str(package.parent)!r})\n'
            f'from {__name__} import main; main()'
        )
        self._process = subprocess.Popen(
            [sys.executable, '-I', '-S', '-c', code],
            stdin=subprocess.PIPE,
            start_new_session=True,
            text=True,
            bufsize=1,
        )

    @property
    def pid(self) -> int:
        """Its process id."""
        return self._process.pid

    def _send(self, **message: object) -> None:
        if self._process.stdin is not None:
            with contextlib.suppress(BrokenPipeError):  # killed; the supervisor goes on without it
                self._process.stdin.write(json.dumps(message) + '\n')

    def watch(self, name: str, pid: int, order: int, steps: list[tuple[Signals, float]]) -> None:
        """Report a process that has been started as the leader of its own group."""
        self._send(pid=pid, name=name, order=order, steps=steps)

    def gone(self, name: str) -> None:
        """Report that a process has ended."""
        self._send(gone=name)

    def dismiss(self) -> None:
        """Everything has ended: the guardian may go."""
        self._send(bye=True)
        if self._process.stdin is not None:
            with contextlib.suppress(BrokenPipeError):
                self._process.stdin.close()
        self._process.wait()
