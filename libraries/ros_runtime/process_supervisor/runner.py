# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Runs a supervision with real processes: pipes, signals and the clock."""

from __future__ import annotations

from collections.abc import Callable, Iterable
import contextlib
from functools import partial
import os
import queue
import selectors
import signal
import socket
import subprocess
import threading
import time
from types import TracebackType
from typing import final

from .fork_server import ForkServer
from .guardian import GuardianLink
from .spec import ProcessSpec, ReadinessSocket, StartError, TRACES, VARIABLE
from .supervision import Notice, Outcome, Phase, Supervision

LONGEST_LINE = 16384
"""Maximum length of a line in [byte]; longer ones are cut, to limit memory."""

CHUNK = 65536  # bytes read from a pipe at once
LAST_CHUNKS = 64
"""Maximum reads of a pipe after its process has ended: its children may keep writing."""
LEAVE_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)  # signals that end the supervisor


class LineSplitter:
    """Splits a byte stream into complete lines."""

    def __init__(self) -> None:
        self._rest = b''

    def feed(self, data: bytes) -> list[str]:
        """Add bytes and return the completed lines; a chunk may end inside a character."""
        *lines, rest = (self._rest + data).split(b'\n')
        while len(rest) > LONGEST_LINE:
            lines.append(rest[:LONGEST_LINE])
            rest = rest[LONGEST_LINE:]
        self._rest = rest
        return [_decode(line) for line in lines]

    def flush(self) -> list[str]:
        """Return the rest when the pipe has ended: an unterminated line, or nothing."""
        rest, self._rest = self._rest, b''
        return [_decode(rest)] if rest else []


def _decode(line: bytes) -> str:
    return line.decode(errors='replace').rstrip('\r')


class _Child:
    """A running process with its pipe and the handle that becomes readable at its end."""

    def __init__(self, spec: ProcessSpec, fork_server: ForkServer | None) -> None:
        self.readiness = ReadinessSocket() if spec.notifies_ready else None
        environment = {**os.environ, TRACES: '1', **spec.environment}
        environment.pop(VARIABLE, None)  # this process may have a supervisor itself
        if self.readiness is not None:
            environment[VARIABLE] = self.readiness.address
        self.output, output = os.pipe()
        try:
            forked = fork_server and fork_server.start(spec.argv, environment, output)
            self.process = forked or subprocess.Popen(
                spec.argv,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                env=environment,
                start_new_session=True,  # Ctrl-C of the terminal reaches the supervisor only
            )
        except OSError as error:
            os.close(self.output)
            if self.readiness is not None:
                self.readiness.close()
            raise StartError(f'{spec.argv[0]}: {error.strerror}') from error
        finally:
            os.close(output)
        self.name = spec.name
        self.pidfd = os.pidfd_open(self.process.pid)
        self.splitter = LineSplitter()
        os.set_blocking(self.output, False)

    def send(self, number: signal.Signals) -> None:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.process.pid, number)

    def reap(self) -> int:
        """Collect the exit code of the ended process, and kill the rest of its group."""
        self.send(signal.SIGKILL)
        returncode = self.process.wait()
        os.close(self.pidfd)
        if self.readiness is not None:
            self.readiness.close()
        os.close(self.output)
        return returncode


@final
class Runner:
    """Starts the processes of a bring-up and supervises them until they have ended.

    Use it as a context manager in the main thread; :meth:`stop` is thread-safe.
    """

    def __init__(
        self,
        specs: Iterable[ProcessSpec],
        write: Callable[[str, str], None],
        notify: Callable[[Notice], None],
        *,
        on_interrupt: Callable[[], bool] | None = None,
        on_phase: Callable[[Phase], None] = lambda _: None,
        fork_server: ForkServer | None = None,
    ) -> None:
        """Plan the run; nothing is started yet. ``write`` gets each line with its process name."""
        self._fork_server = fork_server
        self._write = write
        self._children: dict[str, _Child] = {}
        self._guardian: GuardianLink | None = None
        self._selector = selectors.DefaultSelector()
        self._wake_read, self._wake_write = socket.socketpair()
        self._requests: queue.SimpleQueue[Outcome] = queue.SimpleQueue()
        self._supervision = Supervision(
            specs, self._start, self._send, notify, on_interrupt=on_interrupt, on_phase=on_phase
        )
        self._restore: list[Callable[[], object]] = []

    def __enter__(self) -> Runner:
        """Start the guardian and install signal handlers."""
        for end in (self._wake_read, self._wake_write):
            end.setblocking(False)
        self._selector.register(self._wake_read, selectors.EVENT_READ, self._wake)
        self._guardian = GuardianLink()
        if threading.current_thread() is threading.main_thread():
            self._listen_to_signals()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Stop running processes, and restore signal handlers and close handles."""
        self._supervision.stop(Outcome(1, f'{error}'), time.monotonic())
        self._loop()
        for restore in reversed(self._restore):
            restore()
        if self._guardian is not None:
            self._guardian.dismiss()
        self._selector.close()
        self._wake_read.close()
        self._wake_write.close()

    def _listen_to_signals(self) -> None:
        previous = signal.set_wakeup_fd(self._wake_write.fileno(), warn_on_full_buffer=False)
        self._restore.append(lambda: signal.set_wakeup_fd(previous))
        for number in LEAVE_SIGNALS:
            if number is signal.SIGHUP and signal.getsignal(number) is signal.SIG_IGN:
                continue  # started by nohup
            handler = signal.signal(number, lambda *_: None)  # the wake-up byte is its number
            self._restore.append(partial(signal.signal, number, handler))

    @property
    def phase(self) -> Phase:
        """Current phase of the supervision."""
        return self._supervision.phase

    def run(self) -> Outcome:
        """Start all processes; return when all have ended."""
        self._supervision.begin(time.monotonic())
        self._loop()
        return self._supervision.outcome or Outcome(0, 'nothing was to be run')

    def stop(self, outcome: Outcome) -> None:
        """Request an orderly stop; thread-safe, no effect after the end."""
        self._requests.put(outcome)
        with contextlib.suppress(OSError):  # full of wake-ups: it will wake up; or it has ended
            self._wake_write.send(b'\0')

    def _loop(self) -> None:
        while self._supervision.phase is not Phase.STOPPED:
            deadline = self._supervision.next_deadline()
            left = None if deadline is None else max(0.0, deadline - time.monotonic())
            for key, _ in self._selector.select(left):
                # an earlier handler of this round may have closed it
                if self._selector.get_map().get(key.fd) is key:
                    key.data()
            self._supervision.advance(time.monotonic())

    def _start(self, spec: ProcessSpec) -> None:
        child = _Child(spec, self._fork_server)
        if self._guardian is not None:
            steps = [(step.signal, step.timeout) for step in spec.stop_steps]
            self._guardian.watch(spec.name, child.process.pid, spec.stop_order, steps)
        self._children[spec.name] = child
        self._selector.register(child.output, selectors.EVENT_READ, lambda: self._read(child))
        if child.readiness is not None:
            self._selector.register(
                child.readiness, selectors.EVENT_READ, lambda: self._check_ready(child)
            )
        self._selector.register(child.pidfd, selectors.EVENT_READ, lambda: self._ended(child))

    def _send(self, name: str, number: signal.Signals) -> None:
        self._children[name].send(number)

    def _check_ready(self, child: _Child) -> None:
        if child.readiness is not None and child.readiness.is_ready():
            self._drain(child)  # what it wrote before that comes first
            self._supervision.ready(child.name, time.monotonic(), child.readiness.status)

    def _read(self, child: _Child) -> bool:
        """Read once; false when there is nothing (more) to read."""
        try:
            data = os.read(child.output, CHUNK)
        except BlockingIOError:
            return False
        if not data:
            self._selector.unregister(child.output)
            return False
        self._pass_on(child.name, child.splitter.feed(data))
        return True

    def _drain(self, child: _Child) -> None:
        for _ in range(LAST_CHUNKS):
            if child.output not in self._selector.get_map() or not self._read(child):
                break

    def _ended(self, child: _Child) -> None:
        if child.readiness is not None:
            self._check_ready(child)
            self._selector.unregister(child.readiness)
        self._drain(child)
        if child.output in self._selector.get_map():
            self._selector.unregister(child.output)
        self._selector.unregister(child.pidfd)
        self._pass_on(child.name, child.splitter.flush())
        returncode = child.reap()
        if self._guardian is not None:
            self._guardian.gone(child.name)
        self._supervision.exited(child.name, returncode, time.monotonic())

    def _pass_on(self, name: str, lines: Iterable[str]) -> None:
        for line in lines:
            self._write(name, line)
            self._supervision.line(name, line)

    def _wake(self) -> None:
        numbers = self._wake_read.recv(256)
        while not self._requests.empty():
            self._supervision.stop(self._requests.get(), time.monotonic())
        for number in numbers:
            if number in LEAVE_SIGNALS:
                self._supervision.interrupt(time.monotonic())
