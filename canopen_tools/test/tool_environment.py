# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The environment of a tool that is started as a process: ours from the checkout, and no ROS."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TypeAlias

import pytest

REPOSITORY = Path(__file__).parents[2]
ENVIRONMENT = os.environ | {
    'PYTHONPATH': os.pathsep.join(
        str(REPOSITORY / package)
        for package in (
            'arm_canopen',
            'canopen_core',
            'canopen_tools',
            'libraries/recording',
            'libraries/robot_primitives',
            'libraries/ros_runtime',
        )
    )
}

Output: TypeAlias = pytest.CaptureFixture[str]
"""What a tool has printed, in a test that runs it in its own process."""
