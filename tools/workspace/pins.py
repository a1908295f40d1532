# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Renews the pinned requirements from the files that a person writes."""

from __future__ import annotations

from pathlib import Path

from .layout import Layout
from .process import Argument, Runner
from .system import PYTHON_OLDEST

COMMON = 'common'  # only included by others
BASE = ('uv', 'ros-wheels', 'apt')


def pinned_names(requirements: Path) -> list[str]:
    """List the files to pin: the base, then what is constrained by its versions."""
    found = sorted(path.stem for path in requirements.glob('*.in'))
    return [*BASE, *(name for name in found if name not in {*BASE, COMMON})]


def renew(layout: Layout, runner: Runner) -> None:
    """Pin the newest versions that fit, with their hashes, for every supported Python.

    Raises:
        WorkspaceError: They cannot be fetched, or do not fit together.
    """
    for name in pinned_names(layout.requirements):
        print(f'Pinning {name}.in', flush=True)
        command: list[Argument] = [
            layout.venv / 'bin' / 'uv',
            'pip',
            'compile',
            '--universal',
            '--upgrade',
        ]
        options = ['--python-version', '.'.join(map(str, PYTHON_OLDEST)), '--generate-hashes']
        options += ['--no-annotate', '--no-emit-index-url', '--quiet']
        if name not in BASE:
            # the message extensions of each ROS need the numpy that they were built for
            options += ['--no-emit-package', 'numpy']
        options += ['--custom-compile-command', 'make pins', '--output-file', f'{name}.txt']
        where = Runner(runner.environ, layout.requirements, runner.lock)
        where.run(f'Pinning {name}.in', [*command, *options, f'{name}.in'])
