# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""All checks run, side by side, and one that fails is in the exit code."""

from __future__ import annotations

from pathlib import Path

import pytest

from workspace.layout import Layout
from workspace.lint import lint

# each run of it waits until the other one has begun, and gives up after a while
WAITS_FOR_THE_OTHER = """#!/bin/sh
touch "$0.$1"
tries=0
until [ -e "$0.check" ] && [ -e "$0.format" ]; do
  tries=$((tries + 1))
  [ $tries -lt 600 ] || exit 1
  sleep 0.1
done
echo "seen by $1"
"""


def install(root: Path, script: str) -> Layout:
    """Make a checkout without packages, with a ruff that is a script."""
    layout = Layout(root)
    ruff = layout.venv / 'bin' / 'ruff'
    ruff.parent.mkdir(parents=True)
    ruff.write_text(script, encoding='ascii')
    ruff.chmod(0o755)
    return layout


def test_checks_run_side_by_side(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Two checks of which each waits for the other end; their output comes one after another."""
    assert lint(install(tmp_path, WAITS_FOR_THE_OTHER), {'PATH': '/usr/bin:/bin'}) == 0
    shown = capsys.readouterr().out
    assert shown.index('seen by check') < shown.index('seen by format')


def test_a_check_that_fails_is_told_and_the_others_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The exit code is 1, and what both said is shown."""
    script = '#!/bin/sh\necho "ran $1"\n[ "$1" = format ]\n'
    assert lint(install(tmp_path, script), {'PATH': '/usr/bin:/bin'}) == 1
    shown = capsys.readouterr().out
    assert 'ran check' in shown
    assert 'ran format' in shown
