# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Renews the pinned requirements from the files that a person writes."""

from __future__ import annotations

from .layout import Layout
from .process import Argument, Runner
from .system import PYTHON_OLDEST

# in this order: dev.in is constrained by what ros-wheels.txt says
NAMES = ('uv', 'ros-wheels', 'apt', 'dev')


def renew(layout: Layout, runner: Runner) -> None:
    """Pin the newest versions that fit, with their hashes, for every supported Python.

    Raises:
        WorkspaceError: They cannot be fetched, or do not fit together.
    """
    for name in NAMES:
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
        options += ['--custom-compile-command', 'make pins', '--output-file', f'{name}.txt']
        where = Runner(runner.environ, layout.requirements, runner.lock)
        where.run(f'Pinning {name}.in', [*command, *options, f'{name}.in'])
