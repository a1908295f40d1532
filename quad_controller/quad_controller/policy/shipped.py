# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The policies that are installed with this package."""

from __future__ import annotations

from pathlib import Path

from ..exceptions import PolicyError

FOLDER = Path(__file__).parents[1] / 'policies'


def shipped_policies() -> dict[str, Path]:
    """Return the files of all shipped policies by their names."""
    return {path.stem: path for path in sorted(FOLDER.glob('*.onnx'))}


def find_policy(text: str) -> Path:
    """Return the file of a path, or of a shipped policy's name.

    Raises:
        PolicyError: It is neither.
    """
    path = Path(text).expanduser()
    if path.is_file():
        return path
    shipped = shipped_policies()
    if text in shipped:
        return shipped[text]
    raise PolicyError(
        f'policy {text!r} is neither a file nor shipped ({", ".join(shipped) or "none"})'
    )
