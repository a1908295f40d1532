# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Interrupts: kept while they would do harm, and never lost."""

from __future__ import annotations

import math
import os
import signal
import threading

import pytest

from ros2_frontend.cli import interrupts
from ros2_frontend.cli.interrupts import deferred_interrupts, signals_interrupt


@pytest.fixture(autouse=True)
def long_ago(monkeypatch: pytest.MonkeyPatch) -> None:
    """No signal of another test counts."""
    monkeypatch.setattr(interrupts, '_taken', [-math.inf])


def interrupt(number: signal.Signals, times: int, done: list[str]) -> None:
    """Send signals to this process in a block that defers them."""
    with deferred_interrupts():
        for _ in range(times):
            os.kill(os.getpid(), number)
        done.append('the rest')


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_comes_at_the_end_of_the_block(number: signal.Signals) -> None:
    """What the block does is done first; the handlers are as before."""
    before = signal.getsignal(number)
    done: list[str] = []
    with pytest.raises(KeyboardInterrupt):
        interrupt(number, 1, done)
    assert done == ['the rest']
    assert signal.getsignal(number) is before


@pytest.mark.parametrize('echo', [True, False])
def test_a_second_interrupt_is_not_kept(monkeypatch: pytest.MonkeyPatch, *, echo: bool) -> None:
    """Who presses Ctrl-C twice does not want to wait; `timeout` sends one interrupt twice."""
    monkeypatch.setattr(interrupts, 'ECHO_TIME', 60.0 if echo else 0.0)
    done: list[str] = []
    with pytest.raises(KeyboardInterrupt):
        interrupt(signal.SIGINT, 2, done)
    assert done == (['the rest'] if echo else [])


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_that_is_ignored_is_an_interrupt_while_a_command_runs(
    number: signal.Signals,
) -> None:
    """A background job of a script has SIGINT ignored, and still ends."""
    before = signal.signal(number, signal.SIG_IGN)
    try:
        with pytest.raises(KeyboardInterrupt), signals_interrupt():
            os.kill(os.getpid(), number)
        assert signal.getsignal(number) is signal.SIG_IGN
    finally:
        signal.signal(number, before)


def test_threads_can_use_the_blocks() -> None:
    """Only the main thread may set handlers; others just run."""
    done = []

    def work() -> None:
        with signals_interrupt(), deferred_interrupts():
            done.append('work')

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert done == ['work']
