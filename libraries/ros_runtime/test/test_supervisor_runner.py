# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The supervisor with real processes, signals and pipes."""

from __future__ import annotations

from collections.abc import Callable
import contextlib
from dataclasses import replace
import os
from pathlib import Path
import select
import signal
import subprocess
import sys
import textwrap
import threading

import pytest
from small_processes import program, TIMEOUT, wait_for_end

from process_supervisor import Notice, Outcome, ProcessSpec, Runner, StopStep
from process_supervisor.runner import LEAVE_SIGNALS

pytestmark = pytest.mark.slow


class Watch:
    """Runs a bring-up and keeps what it wrote; does something when all is ready."""

    def __init__(self, *specs: ProcessSpec, when_ready: Callable[[Runner], None]) -> None:
        self.lines: list[tuple[str, str]] = []
        self.notices: list[str] = []
        self._when_ready = when_ready
        self.runner = Runner(specs, lambda *line: self.lines.append(line), self._notice)

    def _notice(self, notice: Notice) -> None:
        self.notices.append(notice.text)
        if notice.text.startswith('all is ready'):
            self._when_ready(self.runner)

    def run(self) -> Outcome:
        """Run it in this thread."""
        with self.runner:
            return self.runner.run()

    def said(self, name: str) -> list[str]:
        """Return the lines of one process."""
        return [text for who, text in self.lines if who == name]


def ctrl_c(_: Runner) -> None:
    """Do as the terminal does."""
    signal.raise_signal(signal.SIGINT)


def nothing(_: Runner) -> None:
    """Do nothing."""


def test_ctrl_c_in_the_terminal_reaches_the_supervisor_only() -> None:
    """Each process has a session of its own; afterwards Ctrl-C means what it meant before."""
    before = [signal.getsignal(number) for number in LEAVE_SIGNALS]
    watch = Watch(program('good', notifies_ready=True), when_ready=ctrl_c)
    watch.run()
    _, pid, session = watch.said('good')[0].split()
    assert pid == session != str(os.getsid(0))
    assert [signal.getsignal(number) for number in LEAVE_SIGNALS] == before
    assert signal.set_wakeup_fd(-1) == -1


def test_a_python_program_that_hangs_says_what_it_does() -> None:
    """Before it is killed, by SIGABRT."""
    deaf = program('deaf', notifies_ready=True)
    unisolated = tuple(word for word in deaf.argv if word != '-I')  # it reads no variables
    steps = tuple(StopStep(number, TIMEOUT) for number in (signal.SIGABRT, signal.SIGKILL))
    watch = Watch(replace(deaf, argv=unisolated, stop_steps=steps), when_ready=ctrl_c)
    watch.run()
    assert 'Fatal Python error: Aborted' in watch.said('deaf')
    assert any('in <module>' in line for line in watch.said('deaf'))


def test_a_flood_of_output_loses_nothing_and_starves_nobody() -> None:
    """All lines arrive in order, and another process gets ready beside it."""
    watch = Watch(
        program('floods', notifies_ready=True),
        program('good', notifies_ready=True),
        when_ready=ctrl_c,
    )
    assert watch.run().exit_code == 0
    assert watch.said('floods')[:50000] == [f'line {i}' for i in range(50000)]


def test_a_last_line_without_an_end_is_a_line() -> None:
    """It is written when the process has ended."""
    watch = Watch(program('unfinished'), when_ready=nothing)
    watch.run()
    assert watch.said('unfinished') == ['no end']


def test_lines_come_before_the_end_of_their_process() -> None:
    """However late they are read: the end is handled after the last line."""
    lines: list[str] = []

    def write_slowly(_: str, line: str) -> None:
        lines.append(line)
        select.select([runner._children['dies'].pidfd], [], [], TIMEOUT)

    with Runner([program('dies')], write_slowly, lambda note: lines.append(note.text)) as runner:
        outcome = runner.run()
    end = 'dies ended with exit code 7'
    assert lines[-3:] == ['first words', 'last words', end]
    assert outcome == Outcome(1, end, 'dies', ('first words', 'last words'))


def test_a_pipe_that_somebody_else_holds_open_keeps_nobody_waiting() -> None:
    """A daemon that a process leaves behind writes on; the process has ended all the same."""
    watch = Watch(program('daemon'), when_ready=nothing)
    assert watch.run().reason == 'daemon ended with exit code 7'
    assert {'first words', 'last words'} <= set(watch.said('daemon'))


def test_what_a_process_leaves_behind_is_killed() -> None:
    """A child in the same process group does not survive its parent."""
    watch = Watch(program('parent'), when_ready=nothing)
    watch.run()
    assert wait_for_end(int(text.split()[1]) for text in watch.said('parent')) == []


def test_a_missing_executable_is_a_failure_with_its_name() -> None:
    """What was started before it is stopped."""
    missing = ProcessSpec('master', ('/no/such/master',))
    watch = Watch(program('good', notifies_ready=True), missing, when_ready=nothing)
    outcome = watch.run()
    assert outcome.exit_code == 1
    assert '/no/such/master' in outcome.reason
    ready = [text for text in watch.said('good') if text.startswith('ready')]
    assert wait_for_end(int(text.split()[1]) for text in ready) == []


def test_stop_works_from_another_thread() -> None:
    """And its outcome is the one that run returns."""

    def stop(runner: Runner) -> None:
        threading.Thread(target=runner.stop, args=[Outcome(3, 'enough')]).start()

    assert Watch(program('good', notifies_ready=True), when_ready=stop).run() == Outcome(
        3, 'enough'
    )


def test_an_error_in_the_supervisor_stops_its_processes() -> None:
    """Leaving the context stops what runs, also by an exception."""
    pids: list[int] = []

    def write(name: str, line: str) -> None:
        if line.startswith('ready'):
            pids.append(int(line.split()[1]))
            raise RuntimeError('broken')

    runner = Runner([program('good', notifies_ready=True)], write, lambda _: None)
    with pytest.raises(RuntimeError, match='broken'), runner:
        runner.run()
    assert len(pids) == 1
    assert wait_for_end(pids) == []


def test_a_killed_guardian_is_no_reason_to_end() -> None:
    """The supervisor goes on without it."""

    def kill(runner: Runner) -> None:
        assert runner._guardian is not None
        os.kill(runner._guardian.pid, signal.SIGKILL)
        ctrl_c(runner)

    watch = Watch(program('good', notifies_ready=True), when_ready=kill)
    assert watch.run().exit_code == 0


SUPERVISOR = textwrap.dedent("""
    import sys
    from process_supervisor import Runner
    from small_processes import program
    specs = [
        program('deaf', 'slaves', notifies_ready=True, stop_order=2),
        program('good', 'master', notifies_ready=True, stop_order=0),
    ]
    def write(name, line):
        print(name, line, flush=True)
    with Runner(specs, write, lambda notice: write('supervisor', notice.text)) as runner:
        print('guardian', 'ready', runner._guardian.pid, flush=True)
        sys.exit(runner.run().exit_code)
""")


@pytest.mark.parametrize('number', [signal.SIGKILL, signal.SIGTERM], ids=['killed', 'terminated'])
def test_no_process_outlives_its_supervisor(number: signal.Signals, tmp_path: Path) -> None:
    """Not even when the supervisor is SIGKILLed, and a process ends by nothing but SIGKILL."""
    folders = [str(Path(__file__).parent), str(Path(__file__).parents[1])]
    environment = {**os.environ, 'PYTHONPATH': os.pathsep.join(folders)}
    with subprocess.Popen(
        [sys.executable, '-c', SUPERVISOR],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env=environment,
        start_new_session=True,
    ) as supervisor:
        watchdog = threading.Timer(TIMEOUT, supervisor.kill)
        watchdog.start()
        try:
            assert supervisor.stdout is not None
            pids = {'supervisor': supervisor.pid}
            for line in supervisor.stdout:
                words = line.split()
                if words[1:2] == ['ready']:
                    pids[words[0]] = int(words[2])
                if 'all is ready' in line:
                    supervisor.send_signal(number)
                    break
            assert set(pids) == {'supervisor', 'guardian', 'master', 'slaves'}
            supervisor.stdout.read()
            assert wait_for_end(pids.values()) == []
            assert supervisor.wait(TIMEOUT) == (1 if number is signal.SIGTERM else -number)
        finally:
            watchdog.cancel()
            with contextlib.suppress(ProcessLookupError):
                os.killpg(supervisor.pid, signal.SIGKILL)
