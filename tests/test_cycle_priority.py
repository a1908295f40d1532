# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Every program that owns a cycle runs it with real-time priority, or says how to get it."""

from __future__ import annotations

import os
from pathlib import Path

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


def descendants(pid: int) -> list[int]:
    """Return the processes that a process has started, and theirs."""
    children = [
        int(child)
        for task in Path(f'/proc/{pid}/task').iterdir()
        for child in (task / 'children').read_text(encoding='ascii').split()
    ]
    return children + [each for child in children for each in descendants(child)]


def real_time_threads(pid: int) -> list[int]:
    """Return the threads of a process that have real-time priority."""
    threads = [int(task.name) for task in Path(f'/proc/{pid}/task').iterdir()]
    mask = ~os.SCHED_RESET_ON_FORK
    return [each for each in threads if os.sched_getscheduler(each) & mask == os.SCHED_FIFO]


@pytest.mark.parametrize(
    ('package', 'arguments', 'programs'),
    [
        ('arm_bringup', ['panda', '--simulate'], ['fake_slaves', 'motion_node']),
        ('quad_bringup', ['--simulate'], ['hardware_node', 'controller_node']),
    ],
    ids=['arm', 'quadruped'],
)
def test_cycles_have_real_time_priority(
    package: str, arguments: list[str], programs: list[str], isolation: Isolation
) -> None:
    """One thread of each process; where it is refused, one line for each says how to get it."""
    command = [executable(package, 'bringup'), *arguments]
    if package == 'arm_bringup':
        command += ['--can', isolation.bus]
    with RunningProcess(command, isolation.env) as bringup:
        bringup.wait_for('all is ready', 60.0)
        found = {
            Path(f'/proc/{pid}/cmdline').read_bytes().decode().replace('\0', ' '): pid
            for pid in descendants(bringup.pid)
        }
        for program in programs:
            (pid,) = [pid for line, pid in found.items() if f'/{program} ' in line]
            refused = [line for line in bringup.lines if REFUSED in line and program in line]
            assert len(real_time_threads(pid)) == (0 if refused else 1), (program, found)


def test_without_the_right_to_it_a_cycle_runs_all_the_same(isolation: Isolation) -> None:
    """As for most users, whose memory is not locked either; a warning each has the remedy."""
    command = [executable('arm_bringup', 'bringup'), 'panda', '--simulate', '--can', isolation.bus]
    with RunningProcess([*WITHOUT_RIGHTS, *command], isolation.env) as bringup:
        bringup.wait_for('all is ready', 60.0)
        for program in ('slaves', 'master'):
            lines = [line for line in bringup.lines if line.startswith(program)]
            assert any(REFUSED in line and 'rtprio' in line for line in lines), bringup.output
        assert bringup.stop(30.0) == 0, bringup.output
