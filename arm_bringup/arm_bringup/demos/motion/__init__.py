# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_bringup motion_demo``: a simulated arm is jogged and follows trajectories."""

from __future__ import annotations

from importlib.util import find_spec
import sys

from process_supervisor import USAGE_ERROR

from ...motion import MAKE_MOVE


def main() -> int:
    """Run the demo where arm_servo, which arm_bringup does without, is built.

    Returns:
        The exit code of the process.
    """
    if find_spec('arm_servo') is None:
        sys.stderr.write(f'{MAKE_MOVE}\n')
        return USAGE_ERROR
    from .main import DEMO

    return DEMO.main()
