# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The demo and the bring-up as a newcomer starts them."""

from __future__ import annotations

import re
import signal
from typing import TYPE_CHECKING

from bus_recorder import BusRecorder
from processes import RunningProcess
import psutil
import pytest

if TYPE_CHECKING:
    from isolation import Isolation

pytestmark = pytest.mark.scenario

DISABLED = dict.fromkeys(range(2, 9), 'Switch on disabled')


def start(isolation: Isolation, *arguments: str) -> RunningProcess:
    """Start an executable of arm_bringup by ``ros2 run``, on the test's own bus."""
    command = ['ros2', 'run', 'arm_bringup', *arguments, '--can', isolation.bus]
    return RunningProcess(command, isolation.env)


def children(process: RunningProcess) -> list[psutil.Process]:
    """Return all processes below one."""
    return psutil.Process(process.pid).children(recursive=True)


def test_demo_moves_all_joints_and_leaves_them_disabled(isolation: Isolation) -> None:
    """The demo ends by itself with all seven joints enabled and moved, and exit code 0."""
    with BusRecorder(isolation.bus) as recorder:
        with start(isolation, 'demo', 'panda', '--duration', '6') as demo:
            demo.wait_for('waving', 40.0)
            started = children(demo)
            assert demo.wait(60.0) == 0, demo.output
        assert '7/7 joints enabled' in demo.output
        moved = re.findall(r'^panda_joint\d +\S+ +\S+ +(\S+)', demo.output, re.MULTILINE)
        assert len(moved) == 7
        assert all(float(amount) > 0.1 for amount in moved), demo.output
        assert recorder.last_states() == DISABLED
    gone, alive = psutil.wait_procs(started, timeout=5.0)
    assert not alive
    assert len(gone) >= 3


def test_ctrl_c_ends_the_bring_up_cleanly(isolation: Isolation) -> None:
    """After Ctrl-C the exit code is 0, every drive is disabled and no process is left."""
    with BusRecorder(isolation.bus) as recorder:
        with start(isolation, 'bringup', 'panda', '--simulate') as bringup:
            bringup.wait_for('all is ready', 40.0)
            started = children(bringup)
            assert bringup.stop() == 0, bringup.output
        assert recorder.last_states() == DISABLED
    assert not psutil.wait_procs(started, timeout=5.0)[1]


def test_bring_up_ends_when_the_master_dies(isolation: Isolation) -> None:
    """A killed master ends the bring-up with a reason; the drives notice by its heartbeat."""
    with start(isolation, 'bringup', 'panda', '--simulate') as bringup:
        bringup.wait_for('all is ready', 40.0)
        started = children(bringup)
        master = next(
            child
            for child in started
            if any(word.endswith(('/master', '/motion_node')) for word in child.cmdline())
        )
        master.send_signal(signal.SIGKILL)
        assert bringup.wait(30.0) == 1, bringup.output
    assert 'master' in bringup.lines[-1]
    assert not psutil.wait_procs(started, timeout=5.0)[1]


def test_nothing_is_left_of_a_killed_bring_up(isolation: Isolation) -> None:
    """Killing the bring-up itself ends all that it started."""
    with start(isolation, 'bringup', 'panda', '--simulate') as bringup:
        bringup.wait_for('all is ready', 40.0)
        started = children(bringup)
        # on the system's ROS, `ros2 run` stays as the parent of what it runs
        supervisor = next(
            process
            for process in [psutil.Process(bringup.pid), *started]
            if any(word.endswith('/arm_bringup/bringup') for word in process.cmdline())
        )
        supervisor.kill()
        assert not psutil.wait_procs(started, timeout=20.0)[1]
