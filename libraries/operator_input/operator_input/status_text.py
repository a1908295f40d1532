# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a status line is put together from."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from enum import Enum

from .keyboard import ReleaseSource

RELEASE_WORDS: Mapping[ReleaseSource, str] = {
    ReleaseSource.TERMINAL: 'true releases',
    ReleaseSource.KEYBOARD: 'true releases (evdev)',
    ReleaseSource.TIME_OUT: 'timed releases',
}
"""What is shown of where key releases come from."""

RESET = '\x1b[0m'


class Style(Enum):
    """How a part looks, as a control sequence of ECMA-48 (SGR)."""

    PLAIN = ''
    BOLD = '\x1b[1m'
    DIM = '\x1b[2m'
    GREEN = '\x1b[32m'
    YELLOW = '\x1b[33m'
    RED = '\x1b[1;31m'


def status_text(parts: Iterable[tuple[str, Style]], *, colour: bool) -> str:
    """Join the parts of a status line.

    Args:
        parts: Texts and how they look; what matters most first, a narrow window cuts the rest.
        colour: Use colours.
    """
    return ' | '.join(
        f'{style.value}{text}{RESET}' if colour and style.value else text for text, style in parts
    )
