# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The demo of arm motion, as a newcomer starts it."""

from __future__ import annotations

import signal
from typing import TYPE_CHECKING

from bus_recorder import BusRecorder
from manual_page import missing_in_run
from processes import RunningProcess
import psutil
import pytest

if TYPE_CHECKING:
    from isolation import Isolation

pytestmark = pytest.mark.scenario

PARTS = (
    'square, base frame',
    'square, tool frame',
    'singularity',
    'trajectory',
    'cancel',
    'peak jerk',
    'joint tracking error',
    'bus and loop',
)


def start(isolation: Isolation, package: str, *arguments: str) -> RunningProcess:
    """Start an executable by ``ros2 run``, on the test's own bus."""
    command = ['ros2', 'run', package, *arguments, '--can', isolation.bus]
    return RunningProcess(command, isolation.env)


def test_demo_of_motion(isolation: Isolation) -> None:
    """It runs every part, says what was measured, ends with 0 and leaves the drives disabled."""
    with BusRecorder(isolation.bus) as recorder:
        with start(isolation, 'arm_bringup', 'motion_demo', 'gp110', '--duration', '5') as demo:
            demo.wait_for('to the start pose', 60.0)
            started = psutil.Process(demo.pid).children(recursive=True)
            assert demo.wait(150.0) == 0, demo.output
        for part in PARTS:
            assert any(line.startswith(f'{part} ') for line in demo.lines), demo.output
        assert not missing_in_run('index.md', 'make demo-arm', demo.output), demo.output
        assert set(recorder.last_states().values()) == {'Switch on disabled'}
    assert not psutil.wait_procs(started, timeout=5.0)[1]


def test_ctrl_c_in_the_middle_of_the_demo(isolation: Isolation) -> None:
    """The arm comes to rest, the drives are disabled, and what was measured is reported."""
    with BusRecorder(isolation.bus) as recorder:
        with start(isolation, 'arm_bringup', 'motion_demo', 'prbt') as demo:
            demo.wait_for('a square in the base frame', 90.0)
            demo.signal(signal.SIGINT)
            assert demo.wait(40.0) == 0, demo.output
        assert any(line.startswith('peak jerk') for line in demo.lines), demo.output
        assert set(recorder.last_states().values()) == {'Switch on disabled'}
