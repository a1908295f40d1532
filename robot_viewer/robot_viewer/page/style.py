# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Colors by what a button does, and marks of panels for the overlay's style sheet.

Red is for STOP and faults alone. Contrast with the text on it is at least 4.5.
"""

from __future__ import annotations

from typing import TypeAlias

Color: TypeAlias = tuple[int, int, int]

NEUTRAL: Color = (233, 236, 239)
"""Of buttons that move as long as they are held, look, stop or choose."""
WANTED: Color = (24, 100, 171)
"""Of the action that is wanted next, which gives power or executes what was shown."""
CAUTION: Color = (255, 212, 59)
"""Of what moves the robot by itself, or takes the torque: it may sink."""

THREE_COLUMNS = '<b class="rv-pad3"></b>'
"""Marks a panel whose buttons stand in three columns."""
JOINT_ROWS = '<b class="rv-pad"></b>'
"""Marks a panel of rows: a cell, and two buttons."""
