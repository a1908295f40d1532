# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The bring-up as a program, with small processes in place of the real ones."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import os
from pathlib import Path
import re
import signal
import subprocess
import sys

import pytest

PATIENCE = 30.0
"""Longest time in [s] that a test waits for something that should happen at once."""
WORKSPACE = Path(__file__).parents[2]

READY = {
    (
        'quad_hardware',
        'fake_xgo',
    ): 'fake_xgo: lite at {link} -> /dev/pts/7',
    ('quad_hardware', 'hardware_node'): '[INFO] [hardware_node]: running: {port}',
    (
        'quad_controller',
        'controller_node',
    ): '[INFO] [controller_node]: ready: joints known',
    ('robot_viewer', 'robot_state_publisher'): '[INFO] [publisher]: Robot initialized',
}

PROGRAM = """#!{python} -IS
import os, signal, sys
def leave(number, frame):
    os.write(1, b'bye\\n')
    os._exit(0)
signal.signal(signal.SIGINT, leave)
port = [word for word in sys.argv if word.startswith('port:=')]
link = sys.argv[sys.argv.index('--link') + 1] if '--link' in sys.argv else ''
print({ready!r}.format(port=port, link=link), flush=True)
{then}
while True: signal.pause()
"""


class Workspace:
    """Installed packages whose programs only say that they are ready."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        for package, name in READY:
            self.install(package, name)
        packages = ('quad_bringup', 'quad_description', 'process_supervisor')
        self.environment = {
            **os.environ,
            'AMENT_PREFIX_PATH': str(folder / 'prefix'),
            'PYTHONPATH': os.pathsep.join(str(WORKSPACE / name) for name in packages),
            'TMPDIR': str(folder),  # its locks are nobody else's
        }

    def install(self, package: str, name: str, then: str = '') -> None:
        """Install a program; it runs a statement after it has said that it is ready."""
        prefix = self.folder / 'prefix'
        marker = prefix / 'share' / 'ament_index' / 'resource_index' / 'packages' / package
        file = prefix / 'lib' / package / name
        for path in (marker, file):
            path.parent.mkdir(parents=True, exist_ok=True)
        marker.touch()
        ready = READY[package, name]
        file.write_text(PROGRAM.format(python=sys.executable, ready=ready, then=then))
        file.chmod(0o755)

    @contextlib.contextmanager
    def bringup(self, *arguments: str) -> Iterator[subprocess.Popen[str]]:
        """Start a bring-up."""
        code = 'import sys; from quad_bringup.bringup import main; sys.exit(main())'
        with subprocess.Popen(
            [sys.executable, '-c', code, *arguments],
            env=self.environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        ) as process:
            try:
                yield process
            finally:
                process.kill()

    def run(self, *arguments: str) -> tuple[int, str]:
        """Run a bring-up to its end."""
        with self.bringup(*arguments) as process:
            output, _ = process.communicate(timeout=PATIENCE)
            return process.returncode, output


@pytest.fixture
def workspace(tmp_path: Path) -> Workspace:
    """Install the small programs."""
    return Workspace(tmp_path)


def read_until(process: subprocess.Popen[str], words: str) -> str:
    """Read the output of a bring-up until some words come."""
    assert process.stdout is not None
    seen = ''
    for line in process.stdout:
        seen += line
        if words in line:
            return seen
    raise AssertionError(f'no {words!r} in:\n{seen}')


def test_ctrl_c_ends_it_with_0_in_order(workspace: Workspace) -> None:
    """The controller first, the simulator last; nothing is left in the temporary folder."""
    with workspace.bringup('--simulate', '--hold') as process:
        seen = read_until(process, 'all is ready')
        process.send_signal(signal.SIGINT)
        rest, _ = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, rest
    assert 'XGO lite, simulated' in seen
    byes = [line.split()[0] for line in rest.splitlines() if line.endswith('| bye')]
    assert byes[0] == 'controller'
    assert set(byes[1:3]) == {'hardware', 'robot_state'}
    assert byes[3:] == ['fake_xgo']
    assert list(workspace.folder.glob('quad_bringup-*/')) == []


def test_a_real_robot_is_on_the_port_that_was_named(workspace: Workspace) -> None:
    """And nothing is simulated."""
    with workspace.bringup('--port', '/dev/ttyAMA0', '--preset', 'mini', '--hold') as process:
        seen = read_until(process, 'all is ready')
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=PATIENCE)
    assert process.returncode == 0
    assert 'XGO mini on /dev/ttyAMA0' in seen
    assert "running: ['port:=/dev/ttyAMA0']" in seen
    assert 'fake_xgo' not in seen


@pytest.mark.parametrize('process', ['controller', 'hardware'])
def test_a_process_that_dies_ends_it_with_its_last_words(
    workspace: Workspace, process: str
) -> None:
    """The exit code is 1, the reason is in the last lines."""
    package, name = next(key for key in READY if key[1] == f'{process}_node')
    workspace.install(package, name, then="print('[FATAL] [node]: no way'); sys.exit(3)")
    code, output = workspace.run('--simulate')
    assert code == 1
    tail = re.split(r'^bringup +\|', output, flags=re.MULTILINE)[-1]
    assert f'{process} ended with exit code 3' in tail
    assert '[FATAL] [node]: no way' in tail


@pytest.mark.parametrize(
    ('arguments', 'words'),
    [
        ([], '--simulate --port'),
        (['--simulate', '--port', '/dev/ttyAMA0'], 'not allowed with'),
        (['--simulate', '--preset', 'maxi'], 'maxi'),
        (['--simulate', '--gait', 'gallop'], 'gallop'),
        (['--simulate', '--policy', 'nowhere.onnx'], 'no file nowhere.onnx'),
        (['--simulate', '--calibration', 'nowhere.yaml'], 'no file nowhere.yaml'),
        (['--port', '/dev/ttyAMA0', '--servo', 'firm'], 'for a simulated robot'),
        (['--simulate', '--timeout', 'nan'], 'no number of seconds above 0'),
    ],
    ids=['nothing', 'both', 'preset', 'gait', 'policy', 'calibration', 'servo', 'time'],
)
def test_what_cannot_be_started_says_so_at_once(
    workspace: Workspace, arguments: list[str], words: str
) -> None:
    """With exit code 2, and no traceback."""
    code, output = workspace.run(*arguments)
    assert code == 2
    assert words in output
    assert 'Traceback' not in output


def test_a_second_bring_up_on_the_same_port_is_refused(workspace: Workspace) -> None:
    """By whatever name it calls the port; another ROS domain does not help."""
    port, name = workspace.folder / 'port', workspace.folder / 'other_name'
    port.touch()
    name.symlink_to(port)
    workspace.environment['ROS_DOMAIN_ID'] = '5'
    with workspace.bringup('--port', str(port), '--hold') as first:
        read_until(first, 'all is ready')
        for domain, second, what in (('7', name, 'port'), ('5', '/dev/other', 'ROS domain 5')):
            workspace.environment['ROS_DOMAIN_ID'] = domain
            code, output = workspace.run('--port', str(second))
            assert code == 2
            assert f'process {first.pid}' in output
            assert what in output
        first.send_signal(signal.SIGINT)
        first.communicate(timeout=PATIENCE)
        assert first.returncode == 0


def test_simulations_in_other_domains_run_side_by_side(workspace: Workspace) -> None:
    """Each has a port of its own."""
    with contextlib.ExitStack() as stack:
        running, ports = [], set()
        for number in (5, 6):
            workspace.environment['ROS_DOMAIN_ID'] = str(number)
            running.append(stack.enter_context(workspace.bringup('--simulate', '--hold')))
            seen = read_until(running[-1], 'all is ready')
            ports.add(next(line for line in seen.splitlines() if 'simulated, on' in line))
        assert len(ports) == 2
        for process in running:
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=PATIENCE)
            assert process.returncode == 0
