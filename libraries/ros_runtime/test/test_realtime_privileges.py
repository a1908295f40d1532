# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Priority and memory: requested in a process of its own, which may get them or not."""

from __future__ import annotations

import os
from pathlib import Path
import resource
import subprocess
import sys
import threading

import pytest

from realtime_loop import raise_priority

PACKAGE = Path(__file__).parents[1]


def in_process(code: str) -> str:
    """Run code in a process of its own; return what it printed."""
    environment = {**os.environ, 'PYTHONPATH': str(PACKAGE)}
    command = [sys.executable, '-c', code]
    return subprocess.run(
        command, check=True, capture_output=True, text=True, env=environment, timeout=60.0
    ).stdout.strip()


def test_the_kernel_has_the_priority_that_was_granted_for_that_thread_alone() -> None:
    """Other threads, and those that the thread starts, stay as they were."""
    ask = 'from realtime_loop import raise_priority; print(raise_priority(1, "x").granted)'
    if in_process(ask) != 'True':
        pytest.skip('no real-time priority for this user')
    seen: dict[str, int] = {}

    def look(name: str) -> None:
        seen[name] = os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK

    def run() -> None:
        assert raise_priority(7, 'the cycle').granted
        look('cycle')
        seen['priority'] = os.sched_getparam(0).sched_priority
        child = threading.Thread(target=look, args=['child'])
        child.start()
        child.join()

    thread = threading.Thread(target=run)
    thread.start()
    thread.join()
    look('main')
    assert seen == {
        'cycle': os.SCHED_FIFO,
        'priority': 7,
        'child': os.SCHED_OTHER,
        'main': os.SCHED_OTHER,
    }


def test_what_is_refused_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """One line, with the thread and the remedy."""

    def refuse(*_: object) -> None:
        raise PermissionError(1, 'Operation not permitted')

    monkeypatch.setattr(os, 'sched_setscheduler', refuse)
    outcome = raise_priority(40, 'the CANopen cycle')
    assert not outcome.granted
    assert 'the CANopen cycle' in outcome.text
    assert 'limits.d' in outcome.text
    assert '\n' not in outcome.text


def test_none_is_requested() -> None:
    """Priority 0 leaves the thread alone, and says nothing."""
    before = os.sched_getscheduler(0)
    assert raise_priority(0, 'the cycle').text == ''
    assert os.sched_getscheduler(0) == before


def test_memory_is_locked_and_does_not_grow_by_it() -> None:
    """VmLck shows it; only what is used is resident, not all that is mapped."""
    granted, locked, before, after = in_process(
        'from realtime_loop import settle_memory\n'
        'def status(key):\n'
        '    lines = open("/proc/self/status").read().splitlines()\n'
        '    return next(int(line.split()[1]) for line in lines if line.startswith(key))\n'
        'import mmap; room = mmap.mmap(-1, 256 << 20)\n'
        'before = status("VmRSS")\n'
        'granted = settle_memory().granted\n'
        'print(granted, status("VmLck"), before, status("VmRSS"))'
    ).split()
    if granted != 'True':
        pytest.skip('no locked memory for this user')
    assert int(locked) > 0
    assert int(after) - int(before) < 64 << 10  # [kB] of 256 MB


def test_below_a_limit_nothing_is_locked() -> None:
    """A process that may lock a little would end when it grows beyond."""
    soft, hard = resource.getrlimit(resource.RLIMIT_MEMLOCK)
    assert (
        in_process(
            'import resource; from realtime_loop import privileges\n'
            'privileges.CAP_IPC_LOCK = 63\n'
            f'resource.setrlimit(resource.RLIMIT_MEMLOCK, (4096, {hard}))\n'
            'print(privileges.settle_memory().granted)'
        )
        == 'False'
    ), (soft, hard)


def test_the_garbage_collector_leaves_alone_what_is_there_until_the_end() -> None:
    """Frozen objects are not looked through again; in the end a cycle of them is collected."""
    left = in_process(
        'import gc, weakref; from realtime_loop import settle_memory, unsettle_memory\n'
        'class Thing: pass\n'
        'thing = Thing(); thing.own = thing; seen = weakref.ref(thing)\n'
        'settle_memory(); del thing; gc.collect()\n'
        'print(gc.get_freeze_count() > 1000, gc.isenabled(), seen() is not None, end=" ")\n'
        'unsettle_memory(); print(seen() is None, gc.get_freeze_count())'
    )
    assert left == 'True True True True 0'
