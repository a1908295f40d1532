# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_bringup plan_demo``: a simulated arm picks and places among obstacles."""

from __future__ import annotations

from importlib.util import find_spec
import sys

from process_supervisor import USAGE_ERROR

NEEDED = ('arm_servo', 'arm_planning')
"""Packages that arm_bringup does without, and this demo does not."""


def main() -> int:
    """Run the demo where what it needs is built.

    Returns:
        The exit code of the process.
    """
    if missing := [name for name in NEEDED if find_spec(name) is None]:
        sys.stderr.write(f'build {" and ".join(missing)} (make build) for planned motions\n')
        return USAGE_ERROR
    from .main import DEMO

    return DEMO.main()
