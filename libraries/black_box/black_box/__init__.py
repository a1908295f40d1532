# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What happened before a fault: kept in memory, written into a folder when it comes."""

from .box import BlackBox, Contents, Pause
from .settings import BlackBoxSettings, default_folder, WINDOW, WINDOW_MAX

__all__ = [
    'WINDOW',
    'WINDOW_MAX',
    'BlackBox',
    'BlackBoxSettings',
    'Contents',
    'Pause',
    'default_folder',
]
