# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The bring-up as a program, with small processes in place of the real ones."""

from __future__ import annotations

from pathlib import Path
import signal

from isolation import Isolation
import pytest
from small_bringup import read_until, SmallWorkspace
from small_processes import TIMEOUT

from quad_bringup import bringup

pytestmark = pytest.mark.slow

LINES = {
    ('quad_sim', 'fake_xgo'): '[INFO] [fake_xgo]: lite at {--link} -> /dev/pts/7',
    ('quad_hardware', 'hardware_node'): '[INFO] [hardware_node]: running: {port}',
    ('quad_controller', 'controller_node'): '[INFO] [controller_node]: ready: joints known',
    ('robot_viewer', 'robot_state_publisher'): '[INFO] [publisher]: Robot initialized',
}

LIES = """
import sys
from types import SimpleNamespace
sys.modules['quad_msgs.srv'] = SimpleNamespace(SetMode=None)
from quad_bringup import mode_client
robot = SimpleNamespace(state='lie', wait_until=lambda *_: None, close=lambda: None)
mode_client.ModeClient = lambda *_: robot
"""
"""The small controller is in no ROS graph."""


@pytest.fixture
def workspace(tmp_path: Path, isolation: Isolation) -> SmallWorkspace:
    """Install the small programs, in a ROS domain of their own."""
    libraries = tuple(
        f'libraries/{name}' for name in ('recording', 'robot_primitives', 'ros_runtime')
    )
    sources = ('quad_bringup', 'quad_description', 'quad_hardware', *libraries)
    workspace = SmallWorkspace(tmp_path, 'quad_bringup', LINES, sources)
    workspace.environment['ROS_DOMAIN_ID'] = str(isolation.domain_id)
    workspace.setup = LIES
    return workspace


def test_ctrl_c_ends_it_with_0_in_order(workspace: SmallWorkspace) -> None:
    """The controller first, the simulator last; nothing is left in the temporary folder."""
    with workspace.bringup('--simulate') as process:
        seen = read_until(process, 'all is ready')
        process.send_signal(signal.SIGINT)
        rest, _ = process.communicate(timeout=TIMEOUT)
    assert process.returncode == 0, rest
    assert 'XGO lite, simulated' in seen
    assert 'robot_state is ready' in seen
    byes = [line.split()[0] for line in rest.splitlines() if line.endswith('| bye')]
    assert byes[0] == 'controller'
    assert set(byes[1:3]) == {'hardware', 'robot_state'}
    assert byes[3:] == ['fake_xgo']
    assert list(workspace.folder.glob('quad_bringup-*/')) == []


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
        # an option that is cut short is not taken for the one that it begins
        (['--simulat'], '--simulate --port'),
        (['--port', '/dev/ttyAMA0', '--hol'], 'unrecognized arguments: --hol'),
    ],
)
def test_what_cannot_be_started_says_so_at_once(
    isolation: Isolation,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    words: str,
) -> None:
    """With exit code 2, and no traceback."""
    monkeypatch.setenv('ROS_DOMAIN_ID', str(isolation.domain_id))
    try:
        code: object = bringup.main(arguments)
    except SystemExit as end:
        code = end.code
    assert code == 2
    assert words in capsys.readouterr().err


def test_a_second_bring_up_on_the_same_port_is_refused(workspace: SmallWorkspace) -> None:
    """By whatever name it calls the port, in whatever namespace; and in the same namespace."""
    port, name = workspace.folder / 'port', workspace.folder / 'other_name'
    port.touch()
    name.symlink_to(port)
    with workspace.bringup('--port', str(port)) as first:
        read_until(first, 'all is ready')
        for arguments, what in (
            (['--port', str(name), '--namespace', 'dog'], 'port'),
            (['--port', '/dev/other'], '--namespace'),
        ):
            code, output = workspace.run(*arguments)
            assert code == 2
            assert f'process {first.pid}' in output
            assert what in output
        first.send_signal(signal.SIGINT)
        first.communicate(timeout=TIMEOUT)
        assert first.returncode == 0
