# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
import select
import signal
import subprocess
import sys
from time import monotonic

from isolation import Isolation
import pytest

pytestmark = pytest.mark.slow

PROGRAM = Path(__file__).with_name('runner_program.py')
TIMEOUT = 30.0  # [s]


@contextmanager
def running(
    isolation: Isolation, *words: str, prefix: tuple[str, ...] = (), ignored: str = ''
) -> Iterator[subprocess.Popen[str]]:
    """Start the program, with a signal ignored; it is gone afterwards."""
    ignoring = [f'--ignore-signal={ignored}'] if ignored else []
    process = subprocess.Popen(
        # tests that run under nohup ignore SIGHUP, which the program would inherit
        ['env', '--default-signal=HUP', *ignoring, *prefix, sys.executable, str(PROGRAM), *words],
        env=isolation.env,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def said(process: subprocess.Popen[str]) -> str:
    """Return the next line of a process."""
    assert process.stdout is not None
    assert select.select([process.stdout], [], [], TIMEOUT)[0], 'nothing more is said'
    return process.stdout.readline().strip()


def ignores(process: subprocess.Popen[str], number: signal.Signals) -> bool:
    """Return whether the kernel drops a signal to a process."""
    status = Path(f'/proc/{process.pid}/status').read_text(encoding='ascii')
    mask = int(status.partition('SigIgn:')[2].split()[0], 16)
    return bool(mask >> (number - 1) & 1)


def test_help_starts_nothing(isolation: Isolation) -> None:
    """Also of a program that has no help of its own."""
    with running(isolation, '--help') as process:
        output, errors = process.communicate(timeout=TIMEOUT)
    assert (process.returncode, errors) == (0, '')
    assert output.startswith('usage: careful --ros-args')
    assert 'ready' not in output


@pytest.mark.scenario
@pytest.mark.parametrize(
    ('first', 'ignored'),
    [(signal.SIGINT, ''), (signal.SIGTERM, ''), (signal.SIGHUP, ''), (signal.SIGINT, 'INT')],
)
def test_the_first_signal_ends_it_and_a_sigterm_does_not_cut_the_end_short(
    isolation: Isolation, first: signal.Signals, ignored: str
) -> None:
    """Whatever the signal, the program ends its own way, though others follow; with its own code.

    Shells start the background jobs of a script with SIGINT ignored. A patient program, which has
    a terminal to restore, does so however often Ctrl-C is pressed.
    """
    words = ('--patient', '--ros-args', '-p', 'code:=7') if ignored else ()
    with running(isolation, *words, ignored=ignored) as process:
        assert said(process) == 'ready'
        process.send_signal(first)
        assert said(process) == 'stopping'
        for more in (signal.SIGTERM, signal.SIGHUP, *([signal.SIGINT] if ignored else [])):
            process.send_signal(more)
        output, errors = process.communicate('go on\n', timeout=TIMEOUT)
        assert (output.strip(), process.returncode) == ('ended', 7 if ignored else 0), errors


@pytest.mark.scenario
def test_a_second_ctrl_c_ends_it_at_once(isolation: Isolation) -> None:
    """A program that hangs in its end is left with a second SIGINT, which is in its exit code."""
    deadline = monotonic() + TIMEOUT
    with running(isolation) as process:
        assert said(process) == 'ready'
        process.send_signal(signal.SIGINT)
        assert said(process) == 'stopping'
        while process.returncode is None and monotonic() < deadline:
            process.send_signal(signal.SIGINT)
            with suppress(subprocess.TimeoutExpired):
                process.wait(0.1)
        assert process.returncode == -signal.SIGINT


@pytest.mark.scenario
def test_nohup_is_respected(isolation: Isolation) -> None:
    """A SIGHUP that was ignored when the program began does not end it."""
    with running(isolation, prefix=('nohup',)) as process:
        assert said(process) == 'ready'
        assert ignores(process, signal.SIGHUP)
        process.send_signal(signal.SIGTERM)
        assert said(process) == 'stopping'
        process.communicate('go on\n', timeout=TIMEOUT)
        assert process.returncode == 0


WRONG = {
    'range': (('-p', 'rate:=0.5'), 'rate is 0.5: it must be 1.0 to 100.0'),
    'misspelt': (('-p', 'ratte:=5.0'), "unknown parameter 'ratte'; did you mean 'rate'?"),
    'no rule': (('-p', 'rate'), "'-p rate'"),
    'no file': (('--params-file', '/nowhere.yaml'), '/nowhere.yaml'),
    'no option': (('--bogus',), '--bogus'),
    'rclpy': (('-p', 'start_type_description_service:=5'), 'start_type_description_service'),
}


@pytest.mark.scenario
@pytest.mark.parametrize('case', WRONG)
def test_what_is_refused_is_one_line(isolation: Isolation, case: str) -> None:
    """Parameters and arguments that are wrong end it with 1 and a line, without a traceback."""
    words, reason = WRONG[case]
    with running(isolation, '--ros-args', *words) as process:
        output, errors = process.communicate(timeout=TIMEOUT)
        assert process.returncode == 1
        assert reason in errors
        assert errors.count('[FATAL]') == 1
        assert 'Traceback' not in errors + output
