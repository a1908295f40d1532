# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The command that checks a policy: its table, its exit code, and a walk."""

from __future__ import annotations

from pathlib import Path

from policy_export import joined
import pytest

from quad_controller import find_policy
from quad_controller.policy_check.main import run
from quad_gait_policies import metadata, write_policy
from quad_gait_rig import ROBOT

SHIPPED = str(find_policy('trot_imitation'))


def test_the_shipped_policy_passes_and_walks(capsys: pytest.CaptureFixture[str]) -> None:
    """The table is printed, and what the walk came to."""
    assert run([SHIPPED, '--walk', '0.2', '0', '0', '--duration', '3']) == 0
    output = capsys.readouterr().out
    assert 'REFUSE' not in output
    assert 'sha256' in output
    went = output.rpartition('went ')[2]
    assert float(went.split()[0]) == pytest.approx(0.2, abs=0.03)


def test_a_policy_that_only_stands_walks_nowhere(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The walk reports what happened, and not what was commanded; that is no success."""
    path = write_policy(tmp_path / 'still.onnx', metadata())
    assert run([str(path), '--walk', '0.2', '0', '0', '--duration', '2']) == 1
    output = capsys.readouterr().out
    went = output.partition(' went ')[2]
    assert float(went.split()[0]) == pytest.approx(0.0, abs=0.02)
    assert '% of its way; is it made for other servos' in output


@pytest.mark.parametrize(
    ('arguments', 'words'),
    [
        (['--walk', 'nan', '0', '0'], 'nan is not a finite number'),
        (['--duration', '0'], 'must be 0.5 to 600'),
        (['--duration', '-1'], 'must be 0.5 to 600'),
        (['--phase-period', '-0.1'], 'must be 0 or more'),
    ],
)
def test_senseless_numbers_are_refused(
    arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Before anything is loaded."""
    with pytest.raises(SystemExit) as ended:
        run([SHIPPED, *arguments])
    assert ended.value.code == 2
    assert words in capsys.readouterr().err


def test_what_does_not_fit_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A renamed joint and a missing file end with 1 and their reason."""
    names = joined(['hip', *ROBOT.names[1:]])
    path = write_policy(tmp_path / 'renamed.onnx', metadata(joint_names=names))
    assert run([str(path)]) == 1
    assert 'not in the robot: hip' in capsys.readouterr().out
    assert run([str(tmp_path / 'none.onnx')]) == 1
    assert 'is neither a file' in capsys.readouterr().out
