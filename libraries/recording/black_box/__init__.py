# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Keeps the latest data in memory and writes it to a folder when a fault occurs."""

from .box import (
    BlackBox,
    BlackBoxSettings,
    Contents,
    default_folder,
    LogPlayer,
    Pause,
    PlaybackError,
    Replay,
    WINDOW,
    WINDOW_MAX,
)

__all__ = [
    'WINDOW',
    'WINDOW_MAX',
    'BlackBox',
    'BlackBoxSettings',
    'Contents',
    'LogPlayer',
    'Pause',
    'PlaybackError',
    'Replay',
    'default_folder',
]
