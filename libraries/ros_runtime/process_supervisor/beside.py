# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Threads that work beside a supervisor, and may not keep it from its end."""

from __future__ import annotations

import atexit
import faulthandler
import os
import sys
from tempfile import TemporaryFile
import threading

ENDING_TIMEOUT = 10.0
"""Time in [s] in which a thread that was asked to has to end."""


def join_in_time(thread: threading.Thread) -> str:
    """Wait for a thread that was asked to end; when it does not, the program ends without it.

    Args:
        thread: One that does not keep the interpreter alive (``daemon``).

    Returns:
        Why it is given up, with what all threads are doing; empty when it has ended.
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
    """End the program at its end, with exit code 1.

    A thread that comes back from C++ into an interpreter that is being taken down aborts it.
    """
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(1)
