# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Processes under test: their output as events, and their end as a certainty."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
import os
import re
import select
import signal
import subprocess
import threading
import time
from types import TracebackType
from typing import TYPE_CHECKING

from ament_index_python.packages import get_package_prefix
import psutil

from process_supervisor.spec import ReadinessSocket, VARIABLE

if TYPE_CHECKING:
    from typing_extensions import Self

ENDING_TIMEOUT = 45.0
"""Time in [s] for its end; a bring-up gives its master 24 s, and its own threads 10 s."""
ABORTING_TIMEOUT = 2.0
"""Time in [s] in which one that hangs can say where."""
LAST_LINES = 60
"""How much of what a process said a failure is reported with."""


def executable(package: str, name: str) -> str:
    """Return the path of an installed executable."""
    return f'{get_package_prefix(package)}/lib/{package}/{name}'


def find_children(pid: int, *programs: str) -> list[psutil.Process]:
    """Return the descendants of a process that run one of the programs.

    Args:
        pid: Id of the process; it is looked at too.
        programs: Ends of a word of the command line, such as "/web_viewer".
    """
    parent = psutil.Process(pid)
    found = []
    for process in [parent, *parent.children(recursive=True)]:
        with suppress(psutil.NoSuchProcess):  # it has ended meanwhile, or is a zombie
            if any(word.endswith(programs) for word in process.cmdline()):
                found.append(process)
    return found


_started: list[RunningProcess] = []


def outputs() -> Iterator[tuple[str, str]]:
    """Yield command and last output of the processes of a test, to find the cause of a failure."""
    for process in _started:
        state = 'running' if process.is_running() else 'ended'
        yield f'{process.command} ({state})', '\n'.join(process.lines[-LAST_LINES:])


def forget_ended() -> None:
    """Leave out of :func:`outputs` what has ended; those of a fixture of several tests go on."""
    _started[:] = [process for process in _started if process.is_running()]


class RunningProcess:
    """A child process in a session of its own."""

    def __init__(self, arguments: Sequence[str], env: Mapping[str, str]) -> None:
        self.command = ' '.join(arguments)  # program and arguments as one text
        # what it has printed so far, standard output and error together
        self.lines: list[str] = []
        self._changed = threading.Condition()
        self._readiness = ReadinessSocket()
        self._process = subprocess.Popen(
            arguments,
            env={**env, VARIABLE: self._readiness.address},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors='replace',
            start_new_session=True,
        )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        _started.append(self)

    @property
    def pid(self) -> int:
        """Its process id."""
        return self._process.pid

    @property
    def output(self) -> str:
        """All lines as one text."""
        return '\n'.join(self.lines)

    def is_running(self) -> bool:
        """Return whether it has not ended yet."""
        return self._process.poll() is None

    def wait_for(self, pattern: str, timeout: float = 60.0, count: int = 1) -> str:
        """Wait until lines match a regular expression, and return the last of them.

        Args:
            pattern: Searched in each line, from the first on.
            timeout: Longest time in [s].
            count: How many lines must match.
        """
        expression = re.compile(pattern)

        def found() -> str | None:
            matches = [line for line in self.lines if expression.search(line)]
            return matches[count - 1] if len(matches) >= count else None

        return self._wait(found, pattern, timeout)

    def wait_until_last(self, pattern: str, timeout: float = 60.0) -> str:
        """Wait until the last line matches a regular expression, and return it.

        Args:
            pattern: Searched in it.
            timeout: Longest time in [s].
        """
        expression = re.compile(pattern)

        def found() -> str | None:
            last = self.lines[-1] if self.lines else ''
            return last if expression.search(last) else None

        return self._wait(found, pattern, timeout)

    def _wait(self, found: Callable[[], str | None], pattern: str, timeout: float) -> str:
        deadline = time.monotonic() + timeout
        with self._changed:
            while (line := found()) is None:
                left = deadline - time.monotonic()
                if left <= 0 or (not self.is_running() and not self._reader.is_alive()):
                    state = 'running' if self.is_running() else f'ended: {self._process.poll()}'
                    raise AssertionError(f'no {pattern!r} ({state}) in:\n{self.output}')
                self._changed.wait(min(left, 0.5))
            return line

    def wait_until_ready(self, timeout: float = 60.0) -> None:
        """Wait until it reports that it is ready.

        Args:
            timeout: Longest time in [s].
        """
        deadline = time.monotonic() + timeout
        while not self._readiness.is_ready():
            left = deadline - time.monotonic()
            assert left > 0, f'not ready in:\n{self.output}'
            assert self.is_running(), f'ended: {self._process.poll()}:\n{self.output}'
            select.select([self._readiness], [], [], min(left, 0.5))

    def signal(self, number: signal.Signals) -> None:
        """Send it a signal."""
        self._process.send_signal(number)

    def wait(self, timeout: float = 15.0) -> int:
        """Wait for its end and return the exit code."""
        code = self._process.wait(timeout)
        self._reader.join(timeout)
        return code

    def stop(self, timeout: float = 15.0) -> int:
        """Press Ctrl-C, wait for the end and return the exit code."""
        if self.is_running():
            self.signal(signal.SIGINT)
        return self.wait(timeout)

    def __enter__(self) -> Self:
        """Use it in a with statement."""
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Leave nothing of its session behind; one that hangs says where, and is a failure."""
        hangs = False
        if self.is_running() and psutil.Process(self.pid).status() != psutil.STATUS_STOPPED:
            try:
                self.stop(ENDING_TIMEOUT)
            except subprocess.TimeoutExpired:
                hangs = True
                self.signal(signal.SIGABRT)
                with suppress(subprocess.TimeoutExpired):
                    self.wait(ABORTING_TIMEOUT)
        if not self._gave_its_id_away():
            with suppress(ProcessLookupError):
                os.killpg(self.pid, signal.SIGKILL)
        self._process.wait()
        self._reader.join()
        self._readiness.close()
        if hangs and exc is None:
            raise AssertionError(f'{self.command} did not end in:\n{self.output}')

    def _gave_its_id_away(self) -> bool:
        """Return whether another process has its id: in minutes a suite uses all that there are.

        What is left of its session keeps the id from being given away.
        """
        return self._process.returncode is not None and psutil.pid_exists(self.pid)

    def _read(self) -> None:
        for line in self._process.stdout or ():
            with self._changed:
                self.lines.append(line.rstrip('\n'))
                self._changed.notify_all()
        with self._changed:
            self._changed.notify_all()
