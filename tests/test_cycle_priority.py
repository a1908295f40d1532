# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A program without the right to real-time priority says how to get it, and runs all the same."""

from __future__ import annotations

from isolation import Isolation
from processes import executable, RunningProcess
import pytest

pytestmark = [pytest.mark.scenario, pytest.mark.slow]

REFUSED = 'has no real-time priority'
WITHOUT_RIGHTS = [
    'prlimit',
    '--rtprio=0',
    '--',
    'setpriv',
    '--inh-caps=-all',
    '--bounding-set=-all',
]


def test_without_the_right_to_it_a_cycle_runs_all_the_same(isolation: Isolation) -> None:
    """As for most users, whose memory is not locked either; a warning each has the remedy."""
    command = [executable('arm_bringup', 'bringup'), 'panda', '--simulate', '--can', isolation.bus]
    with RunningProcess([*WITHOUT_RIGHTS, *command], isolation.env) as bringup:
        bringup.wait_for('all is ready', 60.0)
        for program in ('slaves', 'master'):
            lines = [line for line in bringup.lines if line.startswith(program)]
            assert any(REFUSED in line and 'rtprio' in line for line in lines), bringup.output
        assert bringup.stop(30.0) == 0, bringup.output
