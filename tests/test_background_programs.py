# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Programs without a node of their own end by SIGINT as background jobs of a script, too.

Shells start those with SIGINT ignored, which a program inherits. The exit code is the program's
own: one that the signal kills, or that ends by a traceback, has another.
"""

from __future__ import annotations

from pathlib import Path
import signal
import subprocess
import time

from isolation import Isolation
from processes import executable, RunningProcess
import pytest

from canopen_core.can import open_bus
from canopen_tools.cli.main import INTERRUPTED
from quad_pty_peer import PtyPeer

pytestmark = [pytest.mark.scenario, pytest.mark.slow]

POLICY = ['trot_ppo', '--walk', '0.1', '0', '0', '--duration', '600']
DOCTOR = ['quad_hardware', 'doctor', '--port', '/dev/null']
IGNORING = ['env', '--ignore-signal=INT']


@pytest.mark.parametrize(
    ('command', 'begun', 'code'),
    [
        (['operator_input', 'show_gamepad', '--device', 'no such pad'], 'no gamepad yet', 0),
        (['quad_controller', 'check_policy', *POLICY], 'order of joints', INTERRUPTED),
        ([*DOCTOR, '--duration', '300'], '.', INTERRUPTED),
    ],
    ids=lambda each: each[1] if isinstance(each, list) else '',
)
def test_a_program_ends(command: list[str], begun: str, code: int, isolation: Isolation) -> None:
    """Whatever it does at that moment."""
    package, name, *arguments = command
    program = [*IGNORING, executable(package, name), *arguments]
    with RunningProcess(program, isolation.env) as process:
        process.wait_for(begun, 30.0)
        process.signal(signal.SIGINT)
        assert process.wait(30.0) == code, process.output


def test_a_scan_ends(isolation: Isolation) -> None:
    """While it waits for answers of devices that are not there."""
    program = [*IGNORING, executable('canopen_tools', 'canopen'), 'scan', '--query']
    with (
        open_bus(isolation.bus) as bus,
        RunningProcess([*program, '--can', isolation.bus], isolation.env) as process,
    ):
        deadline = time.monotonic() + 30.0
        while not bus.receive(1.0):
            assert time.monotonic() < deadline, process.output
        process.signal(signal.SIGINT)
        assert process.wait(30.0) == INTERRUPTED


def test_a_calibration_ends(isolation: Isolation, tmp_path: Path) -> None:
    """While it waits for the person, and the servos hold."""
    program = [*IGNORING, executable('quad_hardware', 'calibrate'), 'joints', '--output']
    with PtyPeer(tmp_path / 'port') as peer:
        process = subprocess.Popen(
            [*program, str(tmp_path / 'found.yaml'), '--port', str(peer.link)],
            env=isolation.env,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        try:
            assert process.stdout is not None
            assert '12 joints' in process.stdout.readline()
            process.send_signal(signal.SIGINT)
            assert process.wait(30.0) == 1  # nothing was written
        finally:
            process.kill()
            process.communicate()
        assert peer.torque
