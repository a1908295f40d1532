# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What every thread that owns a cycle needs: deadlines without bursts, priority, memory."""

from .cycle_timer import Cycle, CycleTimer
from .privileges import Outcome, PRIORITY_MAX, raise_priority, settle_memory, unsettle_memory

__all__ = [
    'PRIORITY_MAX',
    'Cycle',
    'CycleTimer',
    'Outcome',
    'raise_priority',
    'settle_memory',
    'unsettle_memory',
]
