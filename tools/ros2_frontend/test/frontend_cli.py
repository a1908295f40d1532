# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Running a `ros2` command line inside the test's own process, and as a process."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
import os
from pathlib import Path
import sys

import pytest

from ros2_frontend.main import main

FRONTEND = Path(__file__).parents[1]
PROGRAM = (sys.executable, '-m', 'ros2_frontend')


@dataclass(frozen=True)
class Outcome:
    """What a command left behind."""

    code: int  # its exit code
    out: str  # what it wrote to stdout
    err: str  # what it wrote to stderr

    @property
    def lines(self) -> list[str]:
        """The lines of stdout."""
        return self.out.splitlines()


def with_frontend(env: Mapping[str, str]) -> dict[str, str]:
    """Return an environment in which Python finds the front-end."""
    path = os.pathsep.join([str(FRONTEND), env.get('PYTHONPATH', '')])
    return {**env, 'PYTHONPATH': path}


Ros2 = Callable[..., Outcome]


def runner(capsys: pytest.CaptureFixture[str]) -> Ros2:
    """Make a function that runs one command line."""

    def run(*words: str) -> Outcome:
        capsys.readouterr()
        try:
            code = main(words)
        except SystemExit as end:  # argparse
            code = end.code if isinstance(end.code, int) else 1
        captured = capsys.readouterr()
        return Outcome(code, captured.out, captured.err)

    return run
