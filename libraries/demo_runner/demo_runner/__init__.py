# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Runs a demo: its scenario in a thread beside the supervisor of its processes.

:mod:`.program` is the program around it, :mod:`.scenario` what every scenario shares,
:mod:`.display` and :mod:`.picture` show its figures: a live table where there is room, lines
elsewhere.
"""

from .display import choose_display, Display, LineDisplay, Setting, TableDisplay, View
from .picture import compose, DemoStatus
from .program import run_demo
from .scenario import DemoClient, DemoResult, DemoScenario, REFRESH_PERIOD

__version__ = '0.1.0'

__all__ = [
    'REFRESH_PERIOD',
    'DemoClient',
    'DemoResult',
    'DemoScenario',
    'DemoStatus',
    'Display',
    'LineDisplay',
    'Setting',
    'TableDisplay',
    'View',
    'choose_display',
    'compose',
    'run_demo',
]
