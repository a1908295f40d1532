# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
from pathlib import Path
import subprocess
import sys

from workspace.process import exclusive

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
