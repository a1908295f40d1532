# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A kernel with vcan, as an ordinary process, for machines whose own kernel has none.

Debian's user-mode-linux boots on the host's file system in about two seconds. It has one
processor and slow clocks, so it is for correctness and not for figures.
"""

from __future__ import annotations

from collections.abc import Sequence
import os
from pathlib import Path
import shlex
import shutil
import signal
import subprocess

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
