# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The same on a real vcan0: of this kernel where it has one, else of a kernel in user mode."""

from __future__ import annotations

from collections.abc import Sequence
import os
from pathlib import Path
import re
import shlex
import shutil
import signal
import subprocess
import sys
from typing import TYPE_CHECKING

import pytest
from simulated_arm import panda_bus

from canopen_core.can import can_interfaces

if TYPE_CHECKING:
    from isolation import Isolation


KERNEL = 'linux.uml'
PROGRAMS: dict[str, str] = {
    KERNEL: 'user-mode-linux',
    'candump': 'can-utils',
    'insmod': 'kmod',
    'ip': 'iproute2',
}
"""What is needed, and the Debian package that has it."""

SEARCH_PATH = '/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin'
MODULES = (
    'net/can/can.ko',
    'net/can/can-raw.ko',
    'net/can/can-bcm.ko',
    'drivers/net/can/dev/can-dev.ko',
    'drivers/net/can/vcan.ko',
    'net/sched/sch_tbf.ko',
)

INIT = """#!/bin/bash
export PATH={path} HOME=/root
mount -t proc proc /proc
mount -t sysfs sys /sys
mount -t tmpfs tmpfs /run
mkdir -p /dev/shm
mount -t tmpfs tmpfs /dev/shm
for module in {modules}; do insmod /usr/lib/uml/modules/$(uname -r)/kernel/$module; done
ip link set lo up
ip link set lo multicast on
ip route add 224.0.0.0/4 dev lo
ip link add dev vcan0 type vcan
ip link set vcan0 txqueuelen 1000
ip link set up vcan0
cd {folder}
{variables} {command} > {output} 2>&1
echo $? > {status}
sync
poweroff -f
"""


LARGE_STATE = 'amx_tile'
"""Flag of processors with more registers (11 kB) than linux.uml 6.1 saves: it panics there."""


def what_is_missing() -> str:
    """Return why there can be no guest here, empty when there can."""
    if LARGE_STATE in Path('/proc/cpuinfo').read_text().split():
        return f'no vcan0 here; user-mode Linux 6.1 cannot boot on a processor with {LARGE_STATE}'
    packages = [
        package
        for program, package in PROGRAMS.items()
        if shutil.which(program, path=SEARCH_PATH) is None
    ]
    if packages:
        return f'no vcan0 here; for one in user-mode Linux: apt-get install {" ".join(packages)}'
    if os.geteuid() != 0:
        return 'no vcan0 here; user-mode Linux on the root file system wants root'
    return ''


def run_in_guest(command: Sequence[str], scratch: Path, timeout: float) -> tuple[int, str]:
    """Run a command in a guest that has vcan0, on the same files and in the same folder.

    Args:
        command: The command and its arguments.
        scratch: An empty folder for files that pass between host and guest.
        timeout: Longest time in [s].

    Returns:
        Exit code and output of the command; code -1 when the guest did not come to its end.
    """
    output, status, init = scratch / 'output', scratch / 'status', scratch / 'init.sh'
    # python's caches would be shared with the host's processes
    variables = dict(os.environ) | {
        'PYTHONDONTWRITEBYTECODE': '1',
        'HYPOTHESIS_STORAGE_DIRECTORY': '/run/hypothesis',
        'TMPDIR': '/run',
    }
    init.write_text(
        INIT.format(
            path=SEARCH_PATH,
            modules=' '.join(MODULES),
            folder=shlex.quote(str(Path.cwd())),
            variables='env ' + shlex.join(f'{key}={value}' for key, value in variables.items()),
            command=shlex.join(command),
            output=shlex.quote(str(output)),
            status=shlex.quote(str(status)),
        )
    )
    init.chmod(0o755)
    _boot(init, timeout)
    text = output.read_text(errors='replace') if output.exists() else ''
    code = status.read_text().strip() if status.exists() else ''
    return (int(code) if code else -1), text


def _boot(init: Path, timeout: float) -> None:
    # on one processor it is several times faster than on two
    processor = str(min(os.sched_getaffinity(0)))
    kernel = f'{KERNEL} mem=2G root=/dev/root rootfstype=hostfs rootflags=/ rw'
    console = 'con0=fd:0,fd:1 con=null quiet'
    arguments = ['taskset', '-c', processor, *kernel.split(), *console.split(), f'init={init}']
    guest = subprocess.Popen(
        arguments,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    try:
        guest.wait(timeout)
    except subprocess.TimeoutExpired:
        os.killpg(guest.pid, signal.SIGKILL)
        guest.wait()


pytestmark = [pytest.mark.scenario, pytest.mark.vcan]

VCAN = can_interfaces().get('vcan0')
HAS_VCAN = VCAN is not None and VCAN.is_up
ROOT = Path(__file__).parents[1]
IN_GUEST = (
    'canopen_core/test/test_can_bus.py',
    'canopen_core/test/test_can_socketcan.py',
    'tests/test_real_vcan.py',
)
LOG_LINE = re.compile(r'\(\d+\.\d{6}\) vcan0 [0-9A-F]{3}#[0-9A-F]*')


@pytest.mark.skipif(HAS_VCAN, reason='the tests run on this kernel itself')
@pytest.mark.skipif(bool(what_is_missing()), reason=what_is_missing())
@pytest.mark.timeout(900)
def test_in_user_mode_linux(tmp_path: Path) -> None:
    """The tests that need a vcan0 pass in a guest that has one, and none is skipped for it."""
    options = ['-q', '-p', 'no:cacheprovider', '--timeout', '500', '--rootdir', str(ROOT)]
    command = [sys.executable, '-m', 'pytest', *options, *(str(ROOT / test) for test in IN_GUEST)]
    code, output = run_in_guest(command, tmp_path, timeout=850.0)
    assert code == 0, output
    assert 'no vcan0' not in output
    assert re.search(r'\d+ passed', output), output


JOINT = 'panda_joint1'
NODE_IDS = range(2, 9)
COMMAND = re.compile(r' 202#.{6}C8000000$')
"""As candump writes a target of 0.2 rad behind controlword and mode: 200 increments."""


def copy_robot(folder: Path) -> Path:
    """Copy a robot with a slower SYNC: a guest carries about 1,000 frames of Python a second."""
    robot = folder / 'panda'
    shutil.copytree(panda_bus().parent, robot)
    bus = robot / 'bus.yml'
    slow = bus.read_text().replace('sync_period: 10000', 'sync_period: 50000')
    bus.write_text(slow.replace('period: 10 ', 'period: 50 '))
    settings = robot / 'robot.yaml'  # so that no pose is looked for, which takes a guest long
    settings.write_text('start_positions: {panda_joint4: -1.5}\n')
    return robot


@pytest.mark.skipif(not HAS_VCAN, reason='this kernel has no vcan0; see test_in_user_mode_linux')
@pytest.mark.timeout(500)
def test_bring_up_on_vcan0_seen_by_candump(isolation: Isolation, tmp_path: Path) -> None:
    """All drives boot, one moves, and can-utils' candump sees the same frames as ours."""
    from canopen_interfaces.srv import COTargetDouble
    from processes import RunningProcess
    from ros_client import RosClient

    log = tmp_path / 'real.log'

    def start(*command: str) -> RunningProcess:
        return RunningProcess(command, isolation.env)

    with start('bash', '-c', f'exec candump -L vcan0 > {log}') as candump:
        robot = f'{copy_robot(tmp_path)}/'
        options = ['--simulate', '--can', 'vcan0', '--timeout', '60']
        with start('ros2', 'run', 'arm_bringup', 'bringup', robot, *options) as bringup:
            bringup.wait_for('all is ready', 90.0)
            with RosClient(isolation.domain_id) as client:
                for service in ('init', 'position_mode'):
                    answer = client.trigger(f'/{JOINT}/{service}', 120.0)
                    assert answer.success, answer.message
                target = COTargetDouble.Request(target=0.2)
                assert client.call(COTargetDouble, f'/{JOINT}/target', target, 120.0).success
            with start('ros2', 'run', 'arm_canopen', 'candump', 'vcan0', '-n', '40') as ours:
                assert ours.wait(60.0) == 0, ours.output
            assert bringup.stop(30.0) == 0, bringup.output
        candump.stop()
    lines = log.read_text().splitlines()
    assert all(LOG_LINE.fullmatch(line) for line in lines)
    assert any(COMMAND.search(line) for line in lines), 'the target was not sent'
    seen = {line.split()[2].split('#')[0] for line in lines}
    assert {f'{0x180 + node_id:03X}' for node_id in NODE_IDS} <= seen
    state = f' {0x180 + NODE_IDS[0]:03X}#'
    last = [line for line in lines if state in line][-1]
    assert last.split('#')[1].startswith('50'), f'not disabled at the end: {last}'
