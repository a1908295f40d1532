# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_bringup wave_master``: the master of arm_canopen with the wave inside.

It takes what ``ros2 run arm_canopen master`` takes, and robot_description for its node /wave.
"""

from __future__ import annotations

from arm_canopen import run_master

from ...exceptions import BringupError
from .node import WaveNode


def main(argv: list[str] | None = None) -> int:
    """Run the master with the wave until Ctrl-C.

    Args:
        argv: ROS arguments; None takes those of the process.

    Returns:
        The exit code of the master, 1 when the wave cannot be planned.
    """
    return run_master(argv, extend=lambda master: [WaveNode(master)], errors=[BringupError])
