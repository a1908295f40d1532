# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Where recordings of faults go, and how many of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
import os
from pathlib import Path

WINDOW = 60.0  # [s]
WINDOW_MAX = 600.0  # [s] longer, and a recording is the better tool
FOLDER = 'black_box'
PAUSE_SHARE = 0.75  # of the window


@dataclass(frozen=True, slots=True)
class BlackBoxSettings:
    """How a black box behaves; times in [s].

    Attributes:
        folder: Where its recordings go; it is made when it is needed.
        window: How far back a recording reaches.
        after: How long after a fault it is written, so that what follows is in it.
        kept: How many recordings stay in the folder; the oldest are removed.
    """

    folder: Path
    window: float = WINDOW
    after: float = 3.0
    kept: int = 20

    @property
    def pause(self) -> float:
        """Least time between two recordings, so that a fault that repeats does not fill the disk.

        Less than the window: a fault in the pause is in the next recording, with what came before.
        """
        return PAUSE_SHARE * self.window


def default_folder(environ: Mapping[str, str] = os.environ) -> Path:
    """Return the folder ``black_box`` beside the logs of ROS, wherever these go.

    That is ROS_LOG_DIR, or ``log`` in ROS_HOME, or ``~/.ros/log``, as rcl_logging has it.
    """
    if logs := environ.get('ROS_LOG_DIR'):
        return Path(logs).expanduser() / FOLDER
    home = environ.get('ROS_HOME') or '~/.ros'
    return Path(home).expanduser() / 'log' / FOLDER
