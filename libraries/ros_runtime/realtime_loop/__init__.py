# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Cycle timing without bursts, real-time priority and locked memory for cyclic threads."""

from .privileges import (
    Cycle,
    CycleTimer,
    Outcome,
    PRIORITY_MAX,
    raise_priority,
    settle_memory,
    unsettle_memory,
)

__all__ = [
    'PRIORITY_MAX',
    'Cycle',
    'CycleTimer',
    'Outcome',
    'raise_priority',
    'settle_memory',
    'unsettle_memory',
]
