# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Threads that work beside a supervisor, and may not keep it from its end."""

from __future__ import annotations

import faulthandler
import threading

ENDING_TIMEOUT = 10.0
"""Time in [s] in which a thread that was asked to has to end."""
_STANDARD_ERROR = 2


def join_in_time(thread: threading.Thread) -> str:
    """Wait for a thread that was asked to end; print what all are doing when it does not.

    Args:
        thread: One that does not keep the interpreter alive (``daemon``).

    Returns:
        Why it is given up; empty when it has ended.
    """
    thread.join(ENDING_TIMEOUT)
    if not thread.is_alive():
        return ''
    faulthandler.dump_traceback(_STANDARD_ERROR)
    return f'the thread {thread.name!r} did not end within {ENDING_TIMEOUT:g} s'
