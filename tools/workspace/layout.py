# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Where things are in a checkout."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class Layout:
    """The paths that the set-up reads and writes, all below one checkout.

    Attributes:
        root: The checkout.
    """

    root: Path

    @property
    def venv(self) -> Path:
        """The virtual environment."""
        return self.root / '.venv'

    @property
    def venv_python(self) -> Path:
        """Its interpreter."""
        return self.venv / 'bin' / 'python'

    @property
    def venv_owner(self) -> Path:
        """File that marks the virtual environment as made by us, hence ours to replace."""
        return self.venv / '.made-by-workspace'

    @property
    def state(self) -> Path:
        """File with what the virtual environment holds; absent while it is being changed."""
        return self.venv / '.workspace.json'

    @property
    def requirements(self) -> Path:
        """Folder of the pinned requirements."""
        return self.root / 'tools' / 'requirements'

    @property
    def build(self) -> Path:
        """Build folder of colcon."""
        return self.root / 'build'

    @property
    def install(self) -> Path:
        """Install folder of colcon."""
        return self.root / 'install'

    @property
    def log(self) -> Path:
        """Log folder of colcon."""
        return self.root / 'log'

    @property
    def lock(self) -> Path:
        """File that one set-up at a time holds locked."""
        return self.root / '.workspace.lock'


def this_checkout() -> Layout:
    """Return the layout of the checkout that this file belongs to."""
    return Layout(Path(__file__).resolve().parents[2])
