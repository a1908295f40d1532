# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Timing of a cycle, with real-time priority, locked memory and a frozen garbage collector.

A process runs on without a refused privilege; the outcome is one line with the consequence and the
remedy.
"""

from __future__ import annotations

import ctypes
import gc
import os
from pathlib import Path
import resource
from typing import NamedTuple


class Cycle(NamedTuple):
    """Timing of one cycle."""

    time: float  # its time on the grid
    late: float  # how long after its deadline it begins
    skipped: int  # deadlines that had passed as a whole before; their cycles are left out


class CycleTimer:
    """Computes when the next cycle is due; cycles missed in a stall are skipped, not repeated.

    So each cycle starts on the time grid, and its command lasts for a period: after a stall, a
    motion is late but not faster.
    """

    def __init__(self, period: float, now: float) -> None:
        """Make the first cycle due now.

        Raises:
            ValueError: The period is not positive.
        """
        if not period > 0.0:
            raise ValueError(f'period is {period}; it must be positive')
        self.period = period  # time between two cycles
        self.deadline = now  # when the next one is due

    def begin(self, now: float) -> Cycle:
        """Begin the due cycle; the next deadline is the first grid point after ``now``."""
        late = max(0.0, now - self.deadline)
        skipped = int(late / self.period)
        time = self.deadline + skipped * self.period
        self.deadline = time + self.period
        return Cycle(time, late, skipped)


PRIORITY_MAX = 99
CAP_IPC_LOCK = 14
MCL_CURRENT, MCL_FUTURE, MCL_ONFAULT = 1, 2, 4  # sys/mman.h

LIMITS = (
    "allow it by the lines '* - rtprio 98' and '* - memlock unlimited' in "
    '/etc/security/limits.d/realtime.conf and a new login; in a container by --ulimit rtprio=98 '
    '--ulimit memlock=-1 --cap-add=SYS_NICE'
)


class Outcome(NamedTuple):
    """Outcome of a request for a privilege."""

    granted: bool  # whether the system has granted it
    text: str  # the outcome in words; empty when nothing was requested


def raise_priority(priority: int, what: str) -> Outcome:
    """Raise the calling thread to a real-time priority; new threads do not inherit it."""
    if not priority:
        return Outcome(granted=False, text='')
    try:
        policy = os.SCHED_FIFO | os.SCHED_RESET_ON_FORK
        os.sched_setscheduler(0, policy, os.sched_param(priority))
    except (OSError, AttributeError) as error:  # not granted, or no system for it
        return Outcome(
            granted=False,
            text=f'{what} has no real-time priority ({error}), and may be late on a busy machine: '
            f'{LIMITS}; or set thread_priority to 0',
        )
    return Outcome(granted=True, text=f'{what} runs with real-time priority {priority}')


def settle_memory() -> Outcome:
    """Exclude current objects from garbage collection and lock memory; call before the cycle.

    Pages are locked on first use, so the process does not grow.

    Returns:
        Whether the memory is locked.
    """
    gc.collect()
    gc.freeze()  # what is there now is there to stay, and need not be looked through
    if not _may_lock():
        limit = resource.getrlimit(resource.RLIMIT_MEMLOCK)[0] // 1024  # [kB]
        return Outcome(granted=False, text=f'the memory is not locked (memlock is {limit} kB)')
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT):
        reason = os.strerror(ctypes.get_errno())
        return Outcome(granted=False, text=f'the memory is not locked ({reason})')
    return Outcome(granted=True, text='the memory is locked')


def unsettle_memory() -> None:
    """Undo the freeze of :func:`settle_memory`; call it at the end of the program.

    Otherwise libraries report leaked objects on stderr when the interpreter ends.
    """
    if gc.get_freeze_count():
        gc.unfreeze()
        gc.collect()


def _may_lock() -> bool:
    """Whether locked memory is unlimited; under a limit, a growing process would fail."""
    if resource.getrlimit(resource.RLIMIT_MEMLOCK)[0] == resource.RLIM_INFINITY:
        return True
    try:
        status = Path('/proc/self/status').read_text(encoding='ascii')
    except OSError:
        return False
    capabilities = status.partition('CapEff:')[2].split()
    return bool(capabilities) and bool(int(capabilities[0], 16) >> CAP_IPC_LOCK & 1)
