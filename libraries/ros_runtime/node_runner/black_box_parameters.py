# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The parameters of a black box, which all programs that have one share."""

from __future__ import annotations

from pathlib import Path

from black_box import BlackBoxSettings, default_folder, WINDOW, WINDOW_MAX

from .parameter_reader import ParameterReader


def declare_black_box(read: ParameterReader) -> BlackBoxSettings | None:
    """Declare ``black_box_window`` and ``black_box_folder``; return None where it is off."""
    window = read.number(
        'black_box_window',
        WINDOW,
        (0.0, WINDOW_MAX),
        'how much is written when a fault happens [s]; 0 for nothing',
    )
    folder = read.text(
        'black_box_folder',
        '',
        'where that goes; by default black_box beside the logs of ROS (~/.ros/log/black_box)',
    )
    if window == 0.0:
        return None
    return BlackBoxSettings(Path(folder).expanduser() if folder else default_folder(), window)
