# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Programs that the set-up runs, one set-up at a time."""

from pathlib import Path
import subprocess
import sys

import pytest

from workspace.layout import NetworkError, StepFailedError
from workspace.process import clean_environment, exclusive, Runner


def test_foreign_settings_do_not_leak() -> None:
    """Another ROS, another environment and an outer make are left behind; the rest stays."""
    foreign = {
        'AMENT_PREFIX_PATH': '/opt/ros/humble',
        'PYTHONPATH': '/opt/ros/humble/lib',
        'LD_LIBRARY_PATH': '/opt/ros/humble/lib',
        '_ROS_WHEELS_BOOTSTRAP_COMPLETE': '1',
        'MAKEFLAGS': '--jobserver-auth=3,4',
        'VIRTUAL_ENV': '/other',
    }
    cleaned = clean_environment({**foreign, 'HOME': '/home', 'HTTPS_PROXY': 'proxy'})
    assert not foreign.keys() & cleaned.keys()
    assert (cleaned['HOME'], cleaned['HTTPS_PROXY']) == ('/home', 'proxy')


def test_chosen_lines_are_shown(runner: Runner, capsys: pytest.CaptureFixture[str]) -> None:
    """Of a program's output a person sees the lines that begin so."""
    code = 'print("news"); print("noise")'
    runner.run('it', [sys.executable, '-c', code], show=('news',))
    assert capsys.readouterr().out.split() == ['news']


def test_failure_shows_the_last_lines(runner: Runner) -> None:
    """The message has the program's exit code and what it said last, stderr too."""
    code = 'import sys; print("out"); sys.exit("cause")'
    with pytest.raises(StepFailedError, match=r'(?s)it failed \(exit code 1\).*out.*cause'):
        runner.run('it', [sys.executable, '-c', code])


@pytest.mark.parametrize(
    ('said', 'problem'),
    [
        ('dns error: failed to lookup address information: Name or service not known', None),
        ("NewConnectionError('Failed to establish a new connection: [Errno 101]')", None),
        ('tcp connect error: Connection refused (os error 111)', None),
        ('Temporary failure in name resolution', None),
        ('Hash mismatch for numpy', 'Hash mismatch'),  # a wrong file is no missing connection
    ],
)
def test_missing_network_is_distinguished(runner: Runner, said: str, problem: str | None) -> None:
    """What pip and uv say without a network becomes one clear sentence."""
    error = NetworkError if problem is None else StepFailedError
    with pytest.raises(error, match=problem or 'No network: it could not be downloaded'):
        runner.run('it', [sys.executable, '-c', f'import sys; sys.exit({said!r})'])


HOLD = 'import sys; print("holding", flush=True); sys.stdin.read()'


def test_second_holder_waits_for_the_first(tmp_path: Path) -> None:
    """Two set-ups in one checkout never work at the same time."""
    code = (
        'import sys\nfrom pathlib import Path\nfrom workspace.process import exclusive\n'
        'with exclusive(Path(sys.argv[1])): print("mine", flush=True)'
    )
    tools = Path(__file__).parents[1]
    with exclusive(tmp_path / 'lock'):
        second = subprocess.Popen(
            [sys.executable, '-c', code, tmp_path / 'lock'],
            cwd=tools,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert second.stdout is not None
        assert 'Waiting' in second.stdout.readline()
        assert second.poll() is None
    out, _ = second.communicate(timeout=20)
    assert out.strip() == 'mine'


def test_orphans_of_a_killed_holder_hold_it_still(tmp_path: Path) -> None:
    """A program that was given the descriptor keeps the lock when its parent is gone."""
    path = tmp_path / 'lock'
    with exclusive(path) as descriptor:
        orphan = subprocess.Popen(
            [sys.executable, '-c', HOLD],
            pass_fds=(descriptor,),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )
        assert orphan.stdout is not None
        orphan.stdout.readline()
    try:
        attempt = subprocess.run(['flock', '--nonblock', path, 'true'], check=False)
        assert attempt.returncode != 0
    finally:
        orphan.communicate(timeout=20)
    assert subprocess.run(['flock', '--nonblock', path, 'true'], check=False).returncode == 0
