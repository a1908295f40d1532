# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_planning srdf`` on xacro files; tests/ compares what it makes of our robots."""

from __future__ import annotations

from pathlib import Path

import pytest

from arm_bringup.srdf import main

pytestmark = pytest.mark.slow

ROBOTS = Path(__file__).parents[1] / 'robots'
SAMPLES = ('--samples', '3000')


def test_a_xacro_file_is_enough(capsys: pytest.CaptureFixture[str]) -> None:
    """The SRDF goes to stdout, the report to stderr."""
    assert main([str(ROBOTS / 'gp110' / 'gp110.urdf.xacro'), *SAMPLES]) == 0
    out, err = capsys.readouterr()
    assert '<chain base_link=' in out
    assert 'pose ready found' in err


def test_a_robot_that_is_not_there(capsys: pytest.CaptureFixture[str]) -> None:
    """It is refused with its path."""
    assert main(['./nothing']) == 2
    assert 'nothing does not exist' in capsys.readouterr().err
