# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What is known to be finished: fingerprints, and one file that is written last."""

from __future__ import annotations

from collections.abc import Iterable
import contextlib
from dataclasses import asdict, dataclass
import hashlib
import json
import os
from pathlib import Path


def fingerprint(*parts: str | bytes) -> str:
    """Hash parts into one word; the borders between the parts count."""
    digest = hashlib.sha256()
    for part in parts:
        data = part.encode() if isinstance(part, str) else part
        digest.update(f'{len(data)}:'.encode() + data)
    return digest.hexdigest()[:32]


def fingerprint_files(paths: Iterable[Path]) -> str:
    """Hash names and contents of files; a missing one counts as such."""
    parts: list[str | bytes] = []
    for path in paths:
        parts += [path.name, path.read_bytes() if path.is_file() else b'missing']
    return fingerprint(*parts)


def write_atomically(path: Path, content: str | bytes, *, mode: int = 0o644) -> None:
    """Write a file so that a reader sees the old one or the new one and nothing between.

    The old file is replaced and not changed in place: installed files may be hard links into a
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
    """What a finished virtual environment holds.

    Attributes:
        base: Fingerprint of all that every target needs.
        additions: Fingerprint of each further requirements file that was installed, by its name.
        python: Interpreter that the environment was made from.
    """

    base: str
    additions: dict[str, str]
    python: str


def read_state(path: Path) -> EnvironmentState | None:
    """Read the state, or None when the environment is absent, unfinished or of another kind."""
    with contextlib.suppress(OSError, ValueError, TypeError):
        return EnvironmentState(**json.loads(path.read_text(encoding='utf-8')))
    return None


def write_state(path: Path, state: EnvironmentState) -> None:
    """Record that the environment is finished."""
    write_atomically(path, json.dumps(asdict(state), indent=2) + '\n')
