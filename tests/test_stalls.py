# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What this project's own test runs do when the computer stands still."""

from __future__ import annotations

import os
from pathlib import Path
import subprocess
import sys

COMMON = """
import hashlib, os, signal, threading, time
from stalls import WATCH
def work():
    end = time.monotonic() + 1.0
    while time.monotonic() < end:
        hashlib.sha256(bytes(10_000_000))
"""
FAILS_ONCE = """
def test_{name}(request, runs=[]):
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


SAYS = "print('the drives got no processor for 1.00 s')"


def test_only_a_test_in_a_stall_is_run_again(tmp_path: Path) -> None:
    """A failure without one stays a failure, and so does one that comes back."""
    cases = [
        ('fails', 'False', '', 2),
        ('stalls', 'len(runs) == 1', '', 2),
        ('says', 'False', SAYS, 2),
        ('starves', 'False', STARVES, 2),
        ('stalls_again', 'True', '', 9),
    ]
    tests = (
        FAILS_ONCE.format(name=name, stalls=stalls, says=says, passes=passes)
        for name, stalls, says, passes in cases
    )
    (tmp_path / 'test_once.py').write_text(COMMON + ''.join(tests))
    output = subprocess.run(
        [sys.executable, '-m', 'pytest', '-q', '-p', 'stalls', str(tmp_path)],
        env=os.environ | {'PYTHONPATH': str(Path(__file__).parent)},
        capture_output=True,
        text=True,
        check=False,
    ).stdout
    assert '2 failed, 3 passed, 5 rerun' in output, output
    first, _, again = output.partition('_ test_stalls_again _')
    assert '_ test_fails _' in first, output
    assert 'this computer stood still' not in first, output
    assert 'this computer stood still' in again, output
