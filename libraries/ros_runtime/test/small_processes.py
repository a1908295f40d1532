# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Small real processes for the tests of the supervisor, and how to wait for their end."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
import os
import select
from signal import Signals
import socket
import sys
import time

from process_supervisor import ProcessSpec, StopStep

TIMEOUT = 30.0  # longest time in [s] that a test waits for something that should happen at once

QUICK = tuple(
    StopStep(signal, timeout)
    for signal, timeout in [(Signals.SIGTERM, 0.3), (Signals.SIGINT, 0.3), (Signals.SIGKILL, 9)]
)
"""A ladder with short time-outs, for processes that ignore signals."""
PATIENT = (StopStep(Signals.SIGTERM, TIMEOUT), StopStep(Signals.SIGKILL, 9.0))
"""One for processes that end by the first signal, when they get the processor."""

NOTIFY = """
def notify():
    import socket
    if 'NOTIFY_SOCKET' not in os.environ:
        return
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as supervisor:
        supervisor.sendto(b'READY=1', '\\0' + os.environ['NOTIFY_SOCKET'][1:])
"""
"""Reports that a process is ready, as node_runner does."""

PROGRAMS = {
    # never says that it is ready
    'silent': """
        print('waiting', flush=True)
        while True: signal.pause()
    """,
    # reports that it is ready, and writes bye when it is stopped
    'good': """
        def leave(number, frame):
            os.write(1, b'bye\\n')  # print is not re-entrant
            os._exit(0)
        signal.signal(signal.SIGINT, leave)
        signal.signal(signal.SIGTERM, leave)
        print('ready', os.getpid(), os.getsid(0), flush=True)
        notify()
        while True: signal.pause()
    """,
    'deaf': """
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        print('ready', os.getpid(), flush=True)
        notify()
        while True: signal.pause()
    """,
    'dies': """
        print('first words', flush=True)
        print('last words', file=sys.stderr, flush=True)
        sys.exit(7)
    """,
    'unfinished': """
        sys.stdout.write('no end')
        sys.stdout.flush()
    """,
    'floods': """
        for i in range(50000): print('line', i)
        print('ready', flush=True)
        notify()
        signal.pause()
    """,
    # leaves a child behind in its process group
    'parent': """
        child = os.fork()
        if child == 0:
            while True: signal.pause()
        print('child', child, flush=True)
    """,
    # leaves a child behind in a session of its own, which writes for as long as its output is read
    'daemon': """
        os.write(1, b'first words\\n')
        if os.fork() == 0:
            os.setsid()
            while True: os.write(1, b'noise\\n')
        os.write(1, b'last words\\n')
        os._exit(7)
    """,
}
"""Source of each program."""


def program(kind: str, name: str = '', **options: object) -> ProcessSpec:
    """Describe one of the programs, named after its kind or otherwise."""
    lines = PROGRAMS[kind].strip('\n').split('\n')
    code = f'import os, signal, sys\n{NOTIFY}' + '\n'.join(line[8:] for line in lines)
    # isolated and without site: it starts in milliseconds
    argv = (sys.executable, '-I', '-S', '-c', code)
    steps = QUICK if kind == 'deaf' else PATIENT
    values: dict[str, object] = {'stop_steps': steps, 'ready_timeout': TIMEOUT, **options}
    return ProcessSpec(name or kind, argv, **values)  # type: ignore[arg-type]


@contextmanager
def service_manager() -> Iterator[tuple[str, socket.socket]]:
    """Open a socket as systemd has it; its address is for NOTIFY_SOCKET."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
        manager.bind('')  # the kernel chooses a name
        manager.settimeout(TIMEOUT)
        yield f'@{manager.getsockname()[1:].decode()}', manager


def wait_for_end(pids: Iterable[int]) -> list[int]:
    """Wait until processes have ended; return those that have not after the time-out."""
    deadline = time.monotonic() + TIMEOUT
    left = []
    for pid in pids:
        try:
            pidfd = os.pidfd_open(pid)
        except ProcessLookupError:
            continue
        ended, _, _ = select.select([pidfd], [], [], max(0.0, deadline - time.monotonic()))
        os.close(pidfd)
        if not ended:
            left.append(pid)
    return left
