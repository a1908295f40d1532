# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The demo and the bring-up as a newcomer starts them."""

from __future__ import annotations

import re
import signal
import time
from typing import TYPE_CHECKING

from bus_recorder import BusRecorder
from canopen_interfaces.srv import COTargetDouble
from manual_page import missing_in_run
from processes import RunningProcess
import psutil
import pytest
from ros_client import RosClient
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

if TYPE_CHECKING:
    from collections.abc import Callable

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
        assert not missing_in_run('index.md', 'make demo ', demo.output), demo.output
        moved = re.findall(r'^panda_joint\d +\S+ +\S+ +(\S+)', demo.output, re.MULTILINE)
        assert len(moved) == 7
        assert all(float(amount) > 0.1 for amount in moved), demo.output
        assert recorder.last_states() == DISABLED
    gone, alive = psutil.wait_procs(started, timeout=5.0)
    assert not alive
    assert len(gone) >= 3


def wait_for_silence(client: RosClient, topic: str, duration: float) -> None:
    """Wait until no target has come for a time in [s]."""
    targets = client.listen(Float64, topic)
    seen, since = 0, time.monotonic()

    def silent() -> bool:
        nonlocal seen, since
        if len(targets) != seen:
            seen, since = len(targets), time.monotonic()
        return time.monotonic() - since > duration

    client.spin_until(silent, 10.0, 'silence')


def test_a_drive_that_is_commanded_from_elsewhere_leaves_the_wave(isolation: Isolation) -> None:
    """It goes where it was sent and stays there, the others wave on; asked to, it comes back."""
    with start(isolation, 'demo', 'panda') as demo, RosClient(isolation.domain_id) as client:
        demo.wait_for('waving', 40.0)
        states = client.listen(JointState, '/panda_joint1/joint_states')

        def wait_for(reached: Callable[[float], bool], what: str) -> None:
            client.spin_until(
                lambda: any(reached(each.position[0]) for each in states[-1:]), 15.0, what
            )

        wait_for(lambda position: abs(position) > 0.1, 'motion')
        answer = client.call(
            COTargetDouble, '/panda_joint1/target', COTargetDouble.Request(target=1.2)
        )
        assert answer.success
        demo.wait_for('panda_joint1 left the wave: it was halted or sent elsewhere', 15.0)
        wait_for(lambda position: abs(position - 1.2) < 0.01, 'target')
        wait_for_silence(client, '/panda_joint1/target', 0.5)
        assert client.trigger('/panda_joint1/cyclic_position_mode').success
        assert client.trigger('/wave/start').success
        wait_for(lambda position: position < 0.5, 'wave')
        assert demo.stop() == 0, demo.output
    assert demo.output.count('left the wave') == 1


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
