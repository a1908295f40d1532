# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Paths and state files of a checkout, and the errors of the set-up."""

from __future__ import annotations

from collections.abc import Iterable
import contextlib
from dataclasses import asdict, dataclass
import hashlib
import json
import os
from pathlib import Path


class WorkspaceError(Exception):
    """An error of the set-up; `remedy`, of one or more lines, is what the user can do."""

    def __init__(self, message: str, remedy: str) -> None:
        super().__init__(message)
        self.remedy = remedy

    def __str__(self) -> str:
        """Both texts, the remedy indented."""
        lines = self.remedy.splitlines()
        return '\n'.join([super().__str__(), *(f'  {line}' for line in lines)])


class NetworkError(WorkspaceError):
    """A download failed because there is no connection."""

    def __init__(self, what: str) -> None:
        super().__init__(
            f'No network: {what} could not be downloaded.',
            'Connect this machine to the network and run again; what is already there is kept.\n'
            'Behind a proxy, set HTTPS_PROXY first.',
        )


class StepFailedError(WorkspaceError):
    """A program that the set-up started ended with an error."""

    def __init__(self, what: str, code: int, tail: str) -> None:
        super().__init__(
            f'{what} failed (exit code {code}).',
            f'Its last lines:\n{tail}\nRun again after correcting it; finished steps are kept.',
        )


def fingerprint(*parts: str | bytes) -> str:
    """Hash parts into one word; the boundaries between the parts count."""
    digest = hashlib.sha256()
    for part in parts:
        data = part.encode() if isinstance(part, str) else part
        digest.update(f'{len(data)}:'.encode() + data)
    return digest.hexdigest()[:32]


def fingerprint_files(paths: Iterable[Path]) -> str:
    """Hash names and contents of files; a missing file has a hash of its own."""
    parts: list[str | bytes] = []
    for path in paths:
        parts += [path.name, path.read_bytes() if path.is_file() else b'missing']
    return fingerprint(*parts)


def write_atomically(path: Path, content: str | bytes, *, mode: int = 0o644) -> None:
    """Write a file atomically: readers see either the old or the new content.

    It replaces the old file instead of changing it: installed files may be hard links into a
    cache.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f'{path.name}.{os.getpid()}.part')
    data = content if isinstance(content, bytes) else content.encode('utf-8', 'surrogateescape')
    with part.open('wb') as stream:
        stream.write(data)
        stream.flush()
        os.fsync(stream.fileno())
    part.chmod(mode)
    part.replace(path)


@dataclass(frozen=True, slots=True)
class EnvironmentState:
    """Contents of a finished virtual environment."""

    base: str  # fingerprint of all that every target needs
    # fingerprint of each further requirements file that was installed, by its name
    additions: dict[str, str]
    python: str  # interpreter that the environment was made from


def read_state(path: Path) -> EnvironmentState | None:
    """Read the state, or None when the environment is absent, unfinished or of another kind."""
    with contextlib.suppress(OSError, ValueError, TypeError):
        return EnvironmentState(**json.loads(path.read_text(encoding='utf-8')))
    return None


def write_state(path: Path, state: EnvironmentState) -> None:
    """Record that the environment is finished."""
    write_atomically(path, json.dumps(asdict(state), indent=2) + '\n')


class Layout:
    """The paths that the set-up reads and writes, all below one checkout."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.venv = root / '.venv'
        self.venv_python = self.venv / 'bin' / 'python'
        self.venv_owner = self.venv / '.made-by-workspace'
        """Marks the virtual environment as created by us, so we may replace it."""
        self.state = self.venv / '.workspace.json'
        """Contents of the virtual environment; absent during a change."""
        self.requirements = root / 'tools' / 'requirements'
        self.build = root / 'build'
        self.install = root / 'install'
        self.log = root / 'log'
        self.lock = root / '.workspace.lock'
        """Lock that only one set-up at a time holds."""


def this_checkout() -> Layout:
    """Return the layout of the checkout that this file belongs to."""
    return Layout(Path(__file__).resolve().parents[2])
