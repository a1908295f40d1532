# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Threads beside a supervisor."""

from __future__ import annotations

import subprocess
import sys
import threading

from small_processes import TIMEOUT

from process_supervisor import join_in_time

PROGRAM = """
import sys, threading
from process_supervisor import console
console.ENDING_TIMEOUT = 0.1
def hang():
    threading.Event().wait()
thread = threading.Thread(target=hang, name='enabling', daemon=True)
thread.start()
print(console.join_in_time(thread))
sys.exit(0)
"""


def test_a_thread_that_has_ended_is_nothing_to_talk_about() -> None:
    """The program goes on."""
    thread = threading.Thread(target=lambda: None, daemon=True)
    thread.start()
    assert not join_in_time(thread)


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
