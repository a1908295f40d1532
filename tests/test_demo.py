# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The demos as a newcomer starts them, and how a bring-up ends."""

from __future__ import annotations

from dataclasses import dataclass
import json
import re
import shutil
import signal
from typing import TYPE_CHECKING

from bus_watch import BusRecorder
from canopen_interfaces.srv import COTargetDouble
from manual_page import CHECKOUT, missing_in_run
from processes import find_children, RunningProcess
import psutil
import pytest
from ros_client import RosClient
from sensor_msgs.msg import JointState

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from isolation import Isolation

pytestmark = pytest.mark.scenario


@dataclass(frozen=True)
class Demo:
    """A demo that ends by itself."""

    command: tuple[str, ...]  # package, program and arguments of `ros2 run`
    target: str  # target of `make` by which docs/index.md starts it
    begun: str  # line of its output by which all its processes run
    drives: range = range(0)  # their node ids
    patterns: tuple[str, ...] = ()  # what its output has besides what the page shows


DEMOS = (
    Demo(('arm_bringup', 'demo', 'panda', '--duration', '6'), 'make demo ', 'waving', range(2, 9)),
    Demo(
        ('arm_bringup', 'motion_demo', 'gp110', '--duration', '5'),
        'make demo-arm',
        'to the start pose',
        range(2, 8),
    ),
    Demo(
        ('arm_bringup', 'plan_demo', 'gp110', '--duration', '1'),
        'make demo-plan',
        'to the part, by free motion',
        range(2, 8),
        (
            r'^blocked goal +GOAL_IN_COLLISION: goal: \w+ touches pillar',
            r'^box in the way  at rest .* planned anew in \d+ ms \([2-9] plans\)$',
        ),
    ),
    Demo(('quad_bringup', 'demo', '--duration', '8'), 'make demo-quad', 'standing up'),
)
OFF = 'Switch on disabled'
WITHOUT_RIGHTS = (
    *('prlimit', '--rtprio=0', '--', 'setpriv', '--inh-caps=-all', '--bounding-set=-all'),
)
REFUSED = 'has no real-time priority'


def start(
    isolation: Isolation, program: str, *arguments: str, prefix: Sequence[str] = ()
) -> RunningProcess:
    """Start an executable of arm_bringup by ``ros2 run``, on the test's own bus."""
    command = ['ros2', 'run', 'arm_bringup', program, *arguments, '--can', isolation.bus]
    return RunningProcess([*prefix, *command], isolation.env)


def children(process: RunningProcess) -> list[psutil.Process]:
    """Return all processes below one."""
    return psutil.Process(process.pid).children(recursive=True)


@pytest.mark.timeout(400)
@pytest.mark.parametrize('demo', DEMOS, ids=lambda demo: demo.target.strip())
def test_a_demo_prints_what_the_manual_shows(isolation: Isolation, demo: Demo) -> None:
    """It ends by itself with exit code 0; no process is left, and no drive is enabled."""
    of_arm = demo.command[0] == 'arm_bringup'
    command = ['ros2', 'run', *demo.command, *(['--can', isolation.bus] if of_arm else [])]
    with BusRecorder(isolation.bus) as recorder:
        with RunningProcess(command, isolation.env) as process:
            process.wait_for(demo.begun, 120.0)
            started = children(process)
            assert process.wait(240.0) == 0, process.output
        assert recorder.last_states() == dict.fromkeys(demo.drives, OFF)
    assert not missing_in_run('index.md', demo.target, process.output), process.output
    for pattern in demo.patterns:
        assert re.search(pattern, process.output, re.MULTILINE), process.output
    moved = re.findall(r'^panda_joint\d +\S+ +\S+ +(\S+)', process.output, re.MULTILINE)
    assert len(moved) == (7 if demo is DEMOS[0] else 0)
    assert all(float(amount) > 0.1 for amount in moved), process.output
    gone, alive = psutil.wait_procs(started, timeout=5.0)
    assert not alive
    assert len(gone) >= 3


@pytest.mark.timeout(400)
def test_the_demo_of_an_arm_of_others_says_what_it_leaves_out(
    isolation: Isolation, tmp_path: Path
) -> None:
    """No place to pick and place is searched for; the arm moves there and back around a box."""
    robots = CHECKOUT / 'arm_bringup' / 'robots' / 'gp110'
    files = {'description': 'gp110.urdf.xacro', 'semantic': 'gp110.srdf', 'limits': 'limits.yaml'}
    for name in ('bus.yml', 'cia402_slave.eds'):
        shutil.copy(robots / name, tmp_path)
    named = {key: str(robots / name) for key, name in files.items()}
    (tmp_path / 'robot.yaml').write_text(json.dumps(named), encoding='utf-8')
    with start(isolation, 'plan_demo', f'{tmp_path}/', '--duration', '1') as demo:
        demo.wait_for('home, by free motion', 120.0)
        demo.wait_for('to the farthest pose, by free motion', 60.0)
        assert demo.wait(240.0) == 0, demo.output
    assert re.search(r'^pick and place +left out: no place', demo.output, re.MULTILINE)
    assert re.search(r'^box in the way +at rest', demo.output, re.MULTILINE), demo.output


def test_ctrl_c_in_the_middle_of_a_demo(isolation: Isolation) -> None:
    """The arm comes to rest, the drives are disabled, and what was measured is reported."""
    with BusRecorder(isolation.bus) as recorder:
        with start(isolation, 'motion_demo', 'prbt') as demo:
            demo.wait_for('a square in the base frame', 90.0)
            demo.signal(signal.SIGINT)
            assert demo.wait(40.0) == 0, demo.output
        assert any(line.startswith('bus and loop') for line in demo.lines), demo.output
        assert recorder.last_states() == dict.fromkeys(range(3, 9), OFF)


def test_a_drive_that_is_commanded_from_elsewhere_leaves_the_wave(isolation: Isolation) -> None:
    """It goes where it was sent and stays there; the others wave on."""
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
        wait_for(lambda position: abs(position - 1.2) < 0.01, 'target')
        first = len(states)
        client.spin_until(lambda: len(states) > first + 100, 15.0, 'a second of states')
        assert all(abs(each.position[0] - 1.2) < 0.02 for each in states[first:])
        others = client.listen(JointState, '/panda_joint2/joint_states')
        client.spin_until(lambda: len(others) > 200, 15.0, 'two seconds of another joint')
        places = [each.position[0] for each in others]
        assert max(places) - min(places) > 0.1
        assert demo.stop() == 0, demo.output


def test_bring_up_ends_when_the_master_dies(isolation: Isolation) -> None:
    """With a reason; the drives notice by its heartbeat.

    It runs without the right to real-time priority, as for most users: a warning of each program
    with a cycle has the remedy.
    """
    with start(isolation, 'bringup', 'panda', '--simulate', prefix=WITHOUT_RIGHTS) as bringup:
        bringup.wait_for('all is ready', 60.0)
        for program in ('slaves', 'master'):
            lines = [line for line in bringup.lines if line.startswith(program)]
            assert any(REFUSED in line and 'rtprio' in line for line in lines), bringup.output
        started = children(bringup)
        master = find_children(bringup.pid, '/master', '/motion_node')[0]
        master.send_signal(signal.SIGKILL)
        assert bringup.wait(30.0) == 1, bringup.output
    assert 'master' in bringup.lines[-1]
    assert not psutil.wait_procs(started, timeout=5.0)[1]
