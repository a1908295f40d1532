# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Runs the processes of a bring-up in a terminal, each line prefixed with its process."""

from __future__ import annotations

import atexit
from collections.abc import Callable, Mapping, Sequence
import contextlib
from dataclasses import dataclass
import faulthandler
import os
import re
import sys
from tempfile import TemporaryFile
import threading
from typing import TextIO

from .fork_server import ForkServer
from .runner import Runner
from .spec import ProcessSpec, ServiceManager
from .supervision import Notice, Outcome, Phase, Severity

ENDING_TIMEOUT = 10.0  # time in [s] in which a thread that was asked to has to end

USAGE_ERROR = 2  # exit code of a bring-up when nothing was started
REPORTED_STATES = {Phase.RUNNING: 'READY=1', Phase.STOPPING: 'STOPPING=1'}
"""States reported to the service manager of a bring-up, as in sd_notify(3)."""
Shutdown = Callable[[Callable[[str], None], Callable[[], bool]], None]
"""Called at the first Ctrl-C, while all processes still run; they are stopped when it returns.

It gets a function that shows the user a message, and one that returns True when it must give up: a
second Ctrl-C, or a process has ended.
"""


def join_in_time(thread: threading.Thread) -> str:
    """Wait for a daemon thread to end; after a time-out, let the program exit without it.

    Returns:
        Why the wait was given up, with the stacks of all threads; empty if it has ended.
    """
    thread.join(ENDING_TIMEOUT)
    if not thread.is_alive():
        return ''
    atexit.register(leave)
    with TemporaryFile() as file:
        faulthandler.dump_traceback(file)
        file.seek(0)
        doing = file.read().decode(errors='replace').rstrip()
    return f'the thread {thread.name!r} did not end within {ENDING_TIMEOUT:g} s:\n{doing}'


def leave() -> None:
    """End the program with exit code 1, without finalising the interpreter.

    A thread that returns from C++ during finalisation would abort the interpreter.
    """
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(1)


def supervise(
    processes: Sequence[ProcessSpec],
    shutdown: Shutdown | None = None,
    *,
    on_phase: Callable[[Phase], None] = lambda _: None,
    fork_server: ForkServer | None = None,
) -> Outcome:
    """Run processes with their output on standard output, until Ctrl-C or one ends.

    It reports readiness and stopping to systemd, or to another ``NOTIFY_SOCKET``, as in
    sd_notify(3). ``shutdown`` runs in a thread before the stop, if all were ready. ``on_phase`` is
    called when a phase begins; ``fork_server`` starts the programs it can.
    """
    names = [spec.name for spec in processes]
    painter = Painter('bringup', names, wants_colour(sys.stdout, os.environ))
    write = LineWriter(sys.stdout)

    def notify(notice: Notice) -> None:
        write(painter.notice(notice))

    manager = ServiceManager()

    def report(phase: Phase) -> None:
        if phase in REPORTED_STATES:
            manager.report(REPORTED_STATES[phase])
        on_phase(phase)

    def interrupted() -> bool:
        report(Phase.STOPPING)
        if shutdown is None or runner.phase is not Phase.RUNNING:
            return False
        thread.start()
        return True

    def shut_down(do: Shutdown) -> None:
        outcome = Outcome(0, 'stopped by the user')
        try:
            do(
                lambda text: notify(Notice(Severity.INFO, text)),
                lambda: runner.phase is not Phase.RUNNING,
            )
        except Exception as error:  # noqa: BLE001  whatever it is, the processes are stopped
            outcome = Outcome(1, f'{type(error).__name__}: {error}')
        runner.stop(outcome)

    thread = threading.Thread(target=shut_down, args=[shutdown], name='shutdown', daemon=True)
    with Runner(
        processes,
        lambda name, line: write(painter.line(name, line)),
        notify,
        on_interrupt=interrupted,
        on_phase=report,
        fork_server=fork_server,
    ) as runner:
        outcome = runner.run()
        late = join_in_time(thread) if thread.ident is not None else ''
    if outcome.exit_code:
        notify(Notice(Severity.ERROR, explain(outcome)))
    if late:
        notify(Notice(Severity.ERROR, late))
        outcome = Outcome(1, late) if not outcome.exit_code else outcome
    return outcome


def explain(outcome: Outcome) -> str:
    """Return why a bring-up failed, with the last output of the process."""
    if not outcome.last_lines:
        return outcome.reason
    quoted = '\n'.join(f'    {line}' for line in outcome.last_lines)
    return f'{outcome.reason}; it wrote last:\n{quoted}'


RESET = '\x1b[0m'
BOLD = '\x1b[1m'
YELLOW = '\x1b[33m'
RED = '\x1b[31m'

NAME_COLOURS = ('\x1b[36m', '\x1b[32m', '\x1b[35m', '\x1b[34m', '\x1b[96m', '\x1b[92m')
"""Colours of process names, in the order of the bring-up."""

SEVERITY_COLOURS = {Severity.WARNING: YELLOW, Severity.ERROR: RED}  # colours of notices

ROS_SEVERITY = re.compile(r'^\[(DEBUG|INFO|WARN|ERROR|FATAL)\]')
"""Severity at the start of a line of rcutils logging, in the format that the bring-up sets."""

LOUD_SEVERITIES = {'WARN': Severity.WARNING, 'ERROR': Severity.ERROR, 'FATAL': Severity.ERROR}
"""Severities of rcutils as ours; all others are INFO."""


def wants_colour(stream: TextIO, environment: Mapping[str, str]) -> bool:
    """Return whether to colour a stream, by NO_COLOR (https://no-color.org) and TERM."""
    smart = environment.get('TERM', 'dumb') not in {'dumb', 'unknown', ''}
    return stream.isatty() and not environment.get('NO_COLOR') and smart


def severity_of(line: str) -> Severity:
    """Return the severity of an output line of a ROS node.

    Any other line, such as that of a traceback, is a warning, as it is unexpected.
    """
    match = ROS_SEVERITY.match(line)
    return LOUD_SEVERITIES.get(match[1], Severity.INFO) if match else Severity.WARNING


@dataclass(frozen=True, slots=True)
class Painter:
    """Prefixes lines with process names, padded to the widest."""

    own: str  # name of the supervising program
    names: Sequence[str]  # names of its processes
    colour: bool  # use colours

    def line(self, name: str, text: str) -> str:
        """Format a line of a process."""
        prefix = self._prefix(name)
        if not self.colour:
            return f'{prefix} {text}'
        shade = NAME_COLOURS[self.names.index(name) % len(NAME_COLOURS)]
        body = SEVERITY_COLOURS.get(severity_of(text), '')
        return f'{shade}{prefix}{RESET} {body}{text}{RESET if body else ""}'

    def notice(self, notice: Notice) -> str:
        """Format a notice of the program itself."""
        prefix = self._prefix(self.own)
        if not self.colour:
            mark = {Severity.WARNING: 'warning: ', Severity.ERROR: 'error: '}
            return f'{prefix} {mark.get(notice.severity, "")}{notice.text}'
        return f'{BOLD}{prefix} {SEVERITY_COLOURS.get(notice.severity, "")}{notice.text}{RESET}'

    def _prefix(self, name: str) -> str:
        width = max(len(each) for each in (self.own, *self.names))
        return f'{name:<{width}} |'


class LineWriter:
    """Writes and flushes lines; continues silently if the reader is gone."""

    def __init__(self, stream: TextIO) -> None:
        """Write to a stream."""
        self._stream = stream

    def __call__(self, line: str) -> None:
        """Write a line."""
        # a closed terminal or pipe must not keep us from stopping the drives
        with contextlib.suppress(OSError, ValueError):
            self._stream.write(line + '\n')
            self._stream.flush()
