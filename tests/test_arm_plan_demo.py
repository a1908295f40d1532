# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The demo of planned motions, as a newcomer starts it."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from bus_recorder import BusRecorder
from manual_page import missing_in_run
from processes import RunningProcess
import psutil
import pytest

if TYPE_CHECKING:
    from isolation import Isolation

pytestmark = pytest.mark.scenario

PARTS = ('pick', 'place', 'box in the way', 'blocked goal', 'viewer', 'planning', 'bus and loop')


def test_demo_of_planning(isolation: Isolation) -> None:
    """It picks, places, goes around what appears, is refused, and leaves the drives disabled."""
    command = ['ros2', 'run', 'arm_bringup', 'plan_demo', 'gp110', '--duration', '1']
    with BusRecorder(isolation.bus) as recorder:
        with RunningProcess([*command, '--can', isolation.bus], isolation.env) as demo:
            demo.wait_for('to the part, by free motion', 120.0)
            started = psutil.Process(demo.pid).children(recursive=True)
            assert demo.wait(240.0) == 0, demo.output
        assert set(recorder.last_states().values()) == {'Switch on disabled'}
    for part in PARTS:
        assert any(line.startswith(f'{part} ') for line in demo.lines), demo.output
    assert not missing_in_run('index.md', 'make demo-plan', demo.output), demo.output
    refusal = r'^blocked goal +GOAL_IN_COLLISION: goal: \w+ touches pillar'
    assert re.search(refusal, demo.output, re.MULTILINE), demo.output
    around = r'^box in the way  at rest .* planned anew in \d+ ms \([2-9] plans\)$'
    assert re.search(around, demo.output, re.MULTILINE), demo.output
    assert not psutil.wait_procs(started, timeout=5.0)[1]
