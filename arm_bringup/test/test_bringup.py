# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The bring-up as a program, with small processes in place of the real ones."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import os
from pathlib import Path
import shutil
import signal
import subprocess
import sys

import pytest

PATIENCE = 30.0
"""Longest time in [s] that a test waits for something that should happen at once."""

PACKAGE = Path(__file__).parents[1]
PANDA = PACKAGE / 'robots' / 'panda'

READY = {
    'fake_slaves': '[INFO] [fake_slaves]: 7 simulated drives on {bus}',
    'master': '[INFO] [master]: all 7 devices operational',
    'canopen_joint_state_publisher': '[INFO] [publisher]: publishing 7 joints: a, b',
}

PROGRAM = """#!{python} -IS
import os, signal, sys
def leave(number, frame):
    os.write(1, b'bye\\n')
    os._exit(0)
signal.signal(signal.SIGINT, leave)
bus = [word for word in sys.argv if 'can_interface_name' in word]
print({ready!r}.format(bus=bus), flush=True)
{then}
while True: signal.pause()
"""


class Workspace:
    """An installed arm_canopen whose programs only say that they are ready."""

    def __init__(self, folder: Path, arm_bringup: Path) -> None:
        self.folder = folder
        self._bin = folder / 'prefix' / 'lib' / 'arm_canopen'
        self._bin.mkdir(parents=True)
        index = folder / 'prefix' / 'share' / 'ament_index' / 'resource_index' / 'packages'
        index.mkdir(parents=True)
        (index / 'arm_canopen').touch()
        for name in READY:
            self.install(name)
        self.environment = {
            **os.environ,
            'AMENT_PREFIX_PATH': f'{folder / "prefix"}:{arm_bringup}',
            'PYTHONPATH': os.pathsep.join(
                str(PACKAGE.parent / name)
                for name in ('arm_bringup', 'arm_canopen', 'process_supervisor')
            ),
            'TMPDIR': str(folder),  # its locks are nobody else's
        }

    def install(self, name: str, then: str = '') -> None:
        """Install a program; it runs a statement after it has said that it is ready."""
        file = self._bin / name
        file.write_text(PROGRAM.format(python=sys.executable, ready=READY[name], then=then))
        file.chmod(0o755)

    @contextlib.contextmanager
    def bringup(self, *arguments: str) -> Iterator[subprocess.Popen[str]]:
        """Start a bring-up."""
        code = 'import sys; from arm_bringup.bringup import main; sys.exit(main())'
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
def workspace(tmp_path: Path, prefix: Path) -> Workspace:
    """Install the small programs."""
    return Workspace(tmp_path, prefix)


def read_until(process: subprocess.Popen[str], words: str) -> str:
    """Read the output of a bring-up until some words come."""
    assert process.stdout is not None
    seen = ''
    for line in process.stdout:
        seen += line
        if words in line:
            return seen
    raise AssertionError(f'no {words!r} in:\n{seen}')


def test_ctrl_c_ends_it_with_0_after_the_master_the_listeners_and_the_slaves(
    workspace: Workspace,
) -> None:
    """Every process says good-bye in its turn; nothing is left in the temporary folder."""
    with workspace.bringup('panda', '--simulate', '--can', 'udp_multicast') as process:
        seen = read_until(process, 'all is ready')
        process.send_signal(signal.SIGINT)
        rest, _ = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, rest
    assert 'panda on CAN bus udp_multicast' in seen
    byes = [line.split()[0] for line in rest.splitlines() if line.endswith('| bye')]
    assert byes == ['master', 'joint_states', 'slaves']
    assert list(workspace.folder.glob('arm_bringup-*/')) == []


def test_hardware_is_on_can0_unless_said_otherwise(workspace: Workspace) -> None:
    """And no slaves are started: the master would find two drives for each."""
    with workspace.bringup('panda') as process:
        seen = read_until(process, 'all is ready')
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=PATIENCE)
    assert process.returncode == 0
    assert 'panda on CAN bus can0' in seen
    assert 'slaves' not in seen


def test_a_master_that_dies_ends_it_with_its_last_words(workspace: Workspace) -> None:
    """The exit code is 1, the reason is in the last lines."""
    workspace.install('master', then="print('[FATAL] [master]: no bus'); sys.exit(3)")
    code, output = workspace.run('panda', '--simulate', '--can', 'udp_multicast')
    assert code == 1
    tail = output.split('bringup')[-1]
    assert 'master ended with exit code 3' in tail
    assert '[FATAL] [master]: no bus' in tail


def test_a_master_that_never_gets_ready_ends_it(workspace: Workspace) -> None:
    """After the time-out that was asked for; what it waited for is said."""
    workspace.install('fake_slaves')
    (workspace.folder / 'prefix/lib/arm_canopen/master').write_text(
        PROGRAM.format(python=sys.executable, ready='waiting for panda_joint3', then='')
    )
    code, output = workspace.run('panda', '--simulate', '--can', 'auto', '--timeout', '1')
    assert code == 1
    assert 'master did not get ready' in output
    assert 'waiting for panda_joint3' in output.split('error: ')[-1]


@pytest.mark.parametrize(
    ('arguments', 'words'),
    [
        (['pandora'], "no robot 'pandora'; robots: gp110, panda"),
        (['./nowhere'], 'does not exist'),
        (['panda', '--timeout', 'soon'], 'soon'),
        (['panda', '--timeout', 'nan'], 'no number of seconds above 0'),
        ([], 'robot'),
    ],
    ids=['unknown', 'no folder', 'no number', 'no time', 'nothing'],
)
def test_what_cannot_be_started_says_so_at_once(
    workspace: Workspace, arguments: list[str], words: str
) -> None:
    """With exit code 2, and no traceback."""
    code, output = workspace.run(*arguments)
    assert code == 2
    assert words in output
    assert 'Traceback' not in output


def test_a_robot_without_its_eds_says_which_file_and_line(workspace: Workspace) -> None:
    """Before anything is started."""
    folder = workspace.folder / 'my_arm'
    folder.mkdir()
    shutil.copy(PANDA / 'bus.yml', folder)
    shutil.copy(PANDA / 'panda.urdf.xacro', folder / 'my_arm.urdf.xacro')
    code, output = workspace.run(f'{folder}/', '--simulate')
    assert code == 2
    assert 'my_arm/bus.yml' in output
    assert 'cia402_slave.eds' in output
    assert 'ready' not in output


def test_a_workspace_that_is_not_built_says_how(workspace: Workspace) -> None:
    """A missing executable is told with the remedy."""
    (workspace.folder / 'prefix/lib/arm_canopen/fake_slaves').unlink()
    code, output = workspace.run('panda', '--simulate', '--can', 'auto')
    assert code == 2
    assert 'make build' in output


@pytest.mark.parametrize(
    ('bus', 'domain', 'what'),
    [('udp_multicast', '7', 'bus udp_multicast'), ('udp_multicast:239.9.9.9', '5', 'domain 5')],
    ids=['same bus', 'same domain'],
)
def test_a_second_bring_up_on_the_same_is_refused(
    workspace: Workspace, bus: str, domain: str, what: str
) -> None:
    """The first goes on; the message says which process it is and what to do."""
    workspace.environment['ROS_DOMAIN_ID'] = '5'
    with workspace.bringup('panda', '--simulate', '--can', 'udp_multicast') as first:
        read_until(first, 'all is ready')
        workspace.environment['ROS_DOMAIN_ID'] = domain
        code, output = workspace.run('panda', '--simulate', '--can', bus)
        assert code == 2
        assert f'process {first.pid}' in output
        assert what in output
        first.send_signal(signal.SIGINT)
        assert 'bye' in first.communicate(timeout=PATIENCE)[0]
        assert first.returncode == 0


def test_bring_ups_on_other_buses_and_domains_run_side_by_side(workspace: Workspace) -> None:
    """Neither hears of the other."""
    with contextlib.ExitStack() as stack:
        running = []
        for number in (5, 6):
            workspace.environment['ROS_DOMAIN_ID'] = str(number)
            bus = f'udp_multicast:239.9.9.{number}'
            arguments = ('panda', '--simulate', '--can', bus)
            running.append(stack.enter_context(workspace.bringup(*arguments)))
            seen = read_until(running[-1], 'all is ready')
            assert f'can_interface_name:={bus}' in seen
        for process in running:
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=PATIENCE)
            assert process.returncode == 0


def test_help_names_the_robots(workspace: Workspace) -> None:
    """And what each argument means."""
    code, output = workspace.run('--help')
    assert code == 0
    for words in ('robots: gp110, panda', '--simulate', '--can', 'can0', 'Ctrl-C'):
        assert words in output
