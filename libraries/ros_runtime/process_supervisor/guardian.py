# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The guardian: a small process that stops the others if their supervisor is killed.

A supervisor that is killed (by SIGKILL, or by the kernel when memory runs out) stops nothing: a
master would go on with enabled drives. So the supervisor starts the guardian first and keeps one
end of a pipe to it. If the pipe closes without ``bye``, the guardian stops the processes in the
supervisor's order and by the same signals: both use :class:`StopSequence`.

It runs ``python -I -S``: it needs only the standard library and starts in a few milliseconds. It
has its own session, so Ctrl-C does not reach it.

Messages are lines of JSON; ``steps`` are signals, each with the time to wait after it in [s]:

=============================================================================  ==================
``{"pid": 7, "name": "master", "order": 0, "steps": [[2, 5.0], [9, 2.0]]}``    watch this process
``{"gone": "master"}``                                                         it has ended
``{"bye": true}``                                                              normal end
=============================================================================  ==================
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
import contextlib
from dataclasses import dataclass
import json
import os
from pathlib import Path
import select
from signal import SIG_IGN, signal, Signals
import subprocess
import sys
import time
from typing import Any


@dataclass(slots=True)
class _Member:
    order: int
    steps: Sequence[tuple[Signals, float]]
    step: int = -1
    deadline: float = 0.0


class StopSequence:
    """Stops processes in ascending ``order``: one group after the other.

    :meth:`exited` reports events, :meth:`advance` the time; the callable ``send`` sends a signal
    to the named process. ``now`` is steady time in [s].
    """

    def __init__(self, send: Callable[[str, Signals], None]) -> None:
        """Begin with no process to stop."""
        self._send = send
        self._members: dict[str, _Member] = {}
        self.forced: set[str] = set()  # names of processes that did not end by their first signal
        self.abandoned: list[str] = []  # names of those that did not even end by their last one

    def add(self, name: str, order: int, steps: Iterable[tuple[Signals, float]]) -> None:
        """Add a running process with its signals, and the time in [s] to wait after each."""
        self._members[name] = _Member(order, tuple(steps))

    @property
    def finished(self) -> bool:
        """Whether no process is left."""
        return not self._members

    @property
    def current(self) -> list[str]:
        """Names of the processes that are being stopped."""
        lowest = min((member.order for member in self._members.values()), default=0)
        return [name for name, member in self._members.items() if member.order == lowest]

    def exited(self, name: str) -> None:
        """Remove a process that has ended."""
        self._members.pop(name, None)

    def advance(self, now: float) -> None:
        """Send the signals that are due: the first to the current group, the next to late ones."""
        while turn := self.current:
            for name in turn:
                self._advance_member(name, now)
            if any(name in self._members for name in turn):
                return

    def _advance_member(self, name: str, now: float) -> None:
        member = self._members[name]
        if member.step >= 0 and now < member.deadline:
            return
        member.step += 1
        if member.step >= len(member.steps):
            self.abandoned.append(name)
            del self._members[name]
            return
        if member.step:
            self.forced.add(name)
        signal, timeout = member.steps[member.step]
        member.deadline = now + timeout
        self._send(name, signal)

    def next_deadline(self) -> float | None:
        """Steady time in [s] at which :meth:`advance` has something to do, None for never."""
        deadlines = [self._members[name].deadline for name in self.current]
        return min(deadlines, default=None)

    def force(self, now: float) -> None:
        """Kill all processes at once, in no order."""
        for name, member in self._members.items():
            member.order = 0
            member.steps = ((Signals.SIGKILL, 2.0),)
            member.step = 0
            member.deadline = now + 2.0
            self.forced.add(name)
            self._send(name, Signals.SIGKILL)


class Guardian:
    """State of the guardian: the processes by name, and how to stop them."""

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
        """Stop all processes in order; return when all have ended."""
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
    """Client in the supervisor: starts the guardian and reports processes to it."""

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
        """End the guardian, after all processes have ended."""
        self._send(bye=True)
        if self._process.stdin is not None:
            with contextlib.suppress(BrokenPipeError):
                self._process.stdin.close()
        self._process.wait()
