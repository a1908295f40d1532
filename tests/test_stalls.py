# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What this project's own test runs do when the computer stands still."""

from __future__ import annotations

import os
from pathlib import Path
import subprocess
import sys

import pytest

FAILS_ONCE = """
import hashlib, os, signal, threading, time
from stalls import WATCH
runs = []
def work():
    end = time.monotonic() + 1.0
    while time.monotonic() < end:
        hashlib.sha256(bytes(10_000_000))
def test_first(request):
    runs.append(1)
    if {stalls}:
        watch = request.config.stash[WATCH].process
        os.kill(watch.pid, signal.SIGSTOP)
        time.sleep(0.3)
        os.kill(watch.pid, signal.SIGCONT)
    {says}
    assert len(runs) == {passes}
"""

STARVES = """if len(runs) == 1:
        os.sched_setaffinity(0, [min(os.sched_getaffinity(0))])
        threads = [threading.Thread(target=work) for _ in range(4)]
        [thread.start() for thread in threads]
        work()
        [thread.join() for thread in threads]"""
"""Five threads that compute without the interpreter's lock share a processor for a while."""


@pytest.mark.parametrize(
    ('stalls', 'says', 'passes', 'closing', 'named'),
    [
        ('len(runs) == 1', '', 2, '1 passed, 1 rerun', False),
        ('False', '', 2, '1 failed in', False),
        (
            'False',
            "print('the drives got no processor for 1.00 s')",
            2,
            '1 passed, 1 rerun',
            False,
        ),
        ('False', STARVES, 2, '1 passed, 1 rerun', False),
        ('True', '', 9, '1 failed, 2 rerun', True),
    ],
)
def test_only_a_test_in_a_stall_is_run_again(
    tmp_path: Path, *, stalls: str, says: str, passes: int, closing: str, named: bool
) -> None:
    """A failure without one stays a failure, and so does one that comes back."""
    (tmp_path / 'test_once.py').write_text(
        FAILS_ONCE.format(stalls=stalls, says=says, passes=passes)
    )
    output = subprocess.run(
        [sys.executable, '-m', 'pytest', '-q', '-p', 'stalls', str(tmp_path)],
        env=os.environ | {'PYTHONPATH': str(Path(__file__).parent)},
        capture_output=True,
        text=True,
        check=False,
    ).stdout
    assert closing in output, output
    assert ('this computer stood still' in output) is named, output
