# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Real-time priority of a thread, where the system grants it."""

from __future__ import annotations

import os


def prefer_this_thread(priority: int) -> str:
    """Give the calling thread a real-time priority.

    Args:
        priority: SCHED_FIFO priority; 0 asks for none.

    Returns:
        What became of it, in words; empty when none was asked for.
    """
    if not priority:
        return ''
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except (OSError, AttributeError) as error:  # not granted, or no system for it
        return (
            f'no real-time priority ({error}): cycles may be late by milliseconds; allow rtprio'
            ' in /etc/security/limits.d, or set thread_priority to 0'
        )
    return f'real-time priority {priority}'
