# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Every program that owns a cycle runs it with real-time priority, or says how to get it."""

from __future__ import annotations

import os
from pathlib import Path

from isolation import Isolation
from processes import executable, find_children, RunningProcess
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


def real_time_threads(pid: int) -> list[int]:
    """Return the threads of a process that have real-time priority."""
    threads = [int(task.name) for task in Path(f'/proc/{pid}/task').iterdir()]
    mask = ~os.SCHED_RESET_ON_FORK
    return [each for each in threads if os.sched_getscheduler(each) & mask == os.SCHED_FIFO]


def test_cycles_have_real_time_priority(isolation: Isolation) -> None:
    """One thread of each process; where it is refused, one line for each says how to get it."""
    arm = [executable('arm_bringup', 'bringup'), 'panda', '--simulate', '--can', isolation.bus]
    dog = [executable('quad_bringup', 'bringup'), '--simulate', '--namespace', 'dog']
    with (
        RunningProcess(arm, isolation.env) as arm_bringup,
        RunningProcess(dog, isolation.env) as dog_bringup,
    ):
        for bringup, programs in (
            (arm_bringup, ('fake_slaves', 'motion_node')),
            (dog_bringup, ('hardware_node', 'controller_node')),
        ):
            bringup.wait_for('all is ready', 60.0)
            for program in programs:
                (process,) = find_children(bringup.pid, f'/{program}')
                refused = [line for line in bringup.lines if REFUSED in line and program in line]
                assert len(real_time_threads(process.pid)) == (0 if refused else 1), program


def test_without_the_right_to_it_a_cycle_runs_all_the_same(isolation: Isolation) -> None:
    """As for most users, whose memory is not locked either; a warning each has the remedy."""
    command = [executable('arm_bringup', 'bringup'), 'panda', '--simulate', '--can', isolation.bus]
    with RunningProcess([*WITHOUT_RIGHTS, *command], isolation.env) as bringup:
        bringup.wait_for('all is ready', 60.0)
        for program in ('slaves', 'master'):
            lines = [line for line in bringup.lines if line.startswith(program)]
            assert any(REFUSED in line and 'rtprio' in line for line in lines), bringup.output
        assert bringup.stop(30.0) == 0, bringup.output
