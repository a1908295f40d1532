# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A bring-up on standard output, with a shutdown before everything is stopped."""

from __future__ import annotations

import atexit
from collections.abc import Callable
import re
import signal
import subprocess
import sys
import threading

import pytest
from small_processes import program, service_manager, TIMEOUT

from process_supervisor import LineWriter, Outcome, Shutdown, supervise, terminal

Say = Callable[[str], None]
GivenUp = Callable[[], bool]


def ctrl_c() -> None:
    """Do as the terminal does."""
    signal.raise_signal(signal.SIGINT)


def run_until(
    capsys: pytest.CaptureFixture[str], *kinds: str, shutdown: Shutdown | None
) -> tuple[Outcome, list[str]]:
    """Run small processes; they write bye when they are stopped."""
    outcome = supervise([program(kind, notifies_ready=True) for kind in kinds], shutdown=shutdown)
    return outcome, capsys.readouterr().out.splitlines()


class CtrlC:
    """Presses Ctrl-C in a thread, when a line was written; and once more, if that is wanted."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, words: str, times: int = 1) -> None:
        self._words, self._left = words, times
        write = LineWriter.__call__
        monkeypatch.setattr(
            LineWriter, '__call__', lambda writer, line: self._see(write, writer, line)
        )

    def _see(self, write: Callable[..., None], writer: object, line: str) -> None:
        write(writer, line)
        if self._words in line and self._left:
            self._left -= 1
            ctrl_c()


def test_systemd_gets_readiness_and_the_stop(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Before the shutdown; each once, and none of its processes reports to systemd itself."""

    def shutdown(say: Say, given_up: GivenUp) -> None:
        received.extend(manager.recv(100) for _ in range(2))

    received: list[bytes] = []
    CtrlC(monkeypatch, 'all is ready')
    with service_manager() as (address, manager):
        monkeypatch.setenv('NOTIFY_SOCKET', address)
        run_until(capsys, 'good', shutdown=shutdown)
        assert received == [b'READY=1', b'STOPPING=1']
        manager.setblocking(False)
        with pytest.raises(BlockingIOError):
            manager.recv(100)


def test_systemd_gets_no_readiness_when_one_is_missing(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Only that everything is stopped."""
    with service_manager() as (address, manager):
        monkeypatch.setenv('NOTIFY_SOCKET', address)
        run_until(capsys, 'good', 'dies', shutdown=None)
        assert manager.recv(100) == b'STOPPING=1'


def test_a_shutdown_is_done_before_anybody_is_stopped(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """What it says is among the lines; the exit code is 0."""

    def shutdown(say: Say, given_up: GivenUp) -> None:
        assert not given_up()
        say('lying down')

    CtrlC(monkeypatch, 'all is ready')
    outcome, lines = run_until(capsys, 'good', shutdown=shutdown)
    assert outcome == Outcome(0, 'stopped by the user')
    announced = [index for index, line in enumerate(lines) if 'lying down' in line]
    byes = [index for index, line in enumerate(lines) if line.endswith('| bye')]
    assert len(announced) == len(byes) == 1
    assert announced < byes


def test_ctrl_c_again_ends_a_shutdown(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """``given_up`` says that it is no longer wanted, and everything is stopped at once."""
    given_up_in_time = threading.Event()

    def shutdown(say: Say, given_up: GivenUp) -> None:
        wait = threading.Event()
        for _ in range(round(TIMEOUT / 0.1)):
            signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
            if given_up():
                given_up_in_time.set()
                return
            wait.wait(0.1)

    CtrlC(monkeypatch, 'all is ready')
    outcome, _ = run_until(capsys, 'good', shutdown=shutdown)
    assert outcome.exit_code == 0
    assert given_up_in_time.is_set()


def test_a_shutdown_that_fails_stops_everything_all_the_same(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """No process is left because of a mistake in it."""

    def shutdown(say: Say, given_up: GivenUp) -> None:
        raise ZeroDivisionError('in the shutdown')

    CtrlC(monkeypatch, 'all is ready')
    outcome, lines = run_until(capsys, 'good', shutdown=shutdown)
    assert outcome == Outcome(1, 'ZeroDivisionError: in the shutdown')
    assert any(line.endswith('| bye') for line in lines)


def test_a_shutdown_that_hangs_keeps_nobody_from_the_end(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It says what all threads are doing; the processes were stopped before."""
    monkeypatch.setattr(terminal, 'ENDING_TIMEOUT', 0.1)
    test_over = threading.Event()
    threads: list[threading.Thread] = []

    def shutdown(say: Say, given_up: GivenUp) -> None:
        threads.append(threading.current_thread())
        while not given_up():
            signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
            test_over.wait(0.1)
        test_over.wait(TIMEOUT)

    CtrlC(monkeypatch, 'all is ready')
    outcome = supervise([program('good', notifies_ready=True)], shutdown=shutdown)
    test_over.set()
    threads[0].join(TIMEOUT)
    atexit.unregister(terminal.leave)  # this process goes on
    assert outcome.exit_code == 1
    assert outcome.reason.startswith("the thread 'shutdown' did not end within 0.1 s")
    captured = capsys.readouterr()
    assert '| bye' in captured.out
    assert re.search(r'line \d+ in shutdown', captured.out), captured.out


def test_without_readiness_there_is_no_shutdown(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ctrl-C during the start stops at once."""

    def shutdown(say: Say, given_up: GivenUp) -> None:
        say('never')

    CtrlC(monkeypatch, 'good is ready')
    specs = [program('good', notifies_ready=True), program('silent', notifies_ready=True)]
    outcome = supervise(specs, shutdown=shutdown)
    assert outcome.exit_code == 0
    assert 'never\n' not in capsys.readouterr().out


PROGRAM = """
import sys, threading
from process_supervisor import terminal
terminal.ENDING_TIMEOUT = 0.1
def hang():
    threading.Event().wait()
thread = threading.Thread(target=hang, name='enabling', daemon=True)
thread.start()
print(terminal.join_in_time(thread))
sys.exit(0)
"""


def test_a_program_ends_without_a_thread_that_hangs() -> None:
    """It says what that is doing; the exit code is 1, whatever the program would have said."""
    ended = subprocess.run(
        [sys.executable, '-c', PROGRAM],
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
        check=False,
    )
    assert ended.returncode == 1, ended.stderr
    assert ended.stdout.startswith("the thread 'enabling' did not end within 0.1 s:\n")
    assert 'in hang' in ended.stdout
