# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Where things are in a checkout."""

from __future__ import annotations

from pathlib import Path


class Layout:
    """The paths that the set-up reads and writes, all below one checkout."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.venv = root / '.venv'
        self.venv_python = self.venv / 'bin' / 'python'
        self.venv_owner = self.venv / '.made-by-workspace'
        """Marks the virtual environment as made by us, hence ours to replace."""
        self.state = self.venv / '.workspace.json'
        """What the virtual environment holds; absent while it is being changed."""
        self.requirements = root / 'tools' / 'requirements'
        self.build = root / 'build'
        self.install = root / 'install'
        self.log = root / 'log'
        self.lock = root / '.workspace.lock'
        """One set-up at a time holds it locked."""


def this_checkout() -> Layout:
    """Return the layout of the checkout that this file belongs to."""
    return Layout(Path(__file__).resolve().parents[2])
