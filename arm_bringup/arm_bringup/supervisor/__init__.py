# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A process supervisor: starts processes, waits until they are ready, stops them in order.

The decisions are in :mod:`.supervision` and :mod:`.stopping`, which know no process, no clock and
no signal handler: they are told what happened and when, and say what to do through callables.
:mod:`.runner` does it with real processes; :mod:`.guardian` does it when the runner was killed.
"""

from .runner import Runner
from .spec import POLITE, ProcessSpec, StopStep
from .supervision import Notice, Outcome, Phase, Severity, Supervision

__all__ = [
    'POLITE',
    'Notice',
    'Outcome',
    'Phase',
    'ProcessSpec',
    'Runner',
    'Severity',
    'StopStep',
    'Supervision',
]
