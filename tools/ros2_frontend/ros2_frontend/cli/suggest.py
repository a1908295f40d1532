# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Nearest names for a name that does not exist."""

from __future__ import annotations

from collections.abc import Iterable

_ALIKE = 0.75  # types of two packages are 0.6 alike in their middle parts


def hint(name: str, known: Iterable[str]) -> str:
    """Return a line that asks whether one of up to three near names was meant, if any."""
    from difflib import get_close_matches  # only a command that fails needs it

    near = [f"'{each}'" for each in get_close_matches(name, list(known), cutoff=_ALIKE)]
    return f'\nDid you mean {" or ".join(near)}?' if near else ''
