# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Single keys from the terminal, while a command runs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
import os
import select
import sys


@contextlib.contextmanager
def keys(enabled: bool = True) -> Iterator[Callable[[], str]]:
    """Read keys without waiting for Enter.

    Args:
        enabled: Whether to read at all.

    Yields:
        A function that returns what was typed since it was called last; always nothing where
        standard input is no terminal, or belongs to another process group.
    """
    if not enabled or not has_keyboard():
        yield lambda: ''
        return
    import termios
    import tty

    number = sys.stdin.fileno()
    before = termios.tcgetattr(number)
    tty.setcbreak(number)
    try:
        yield lambda: _typed(number)
    finally:
        termios.tcsetattr(number, termios.TCSADRAIN, before)


def has_keyboard() -> bool:
    """Whether standard input is a terminal that this process may read."""
    try:
        number = sys.stdin.fileno()
        return os.isatty(number) and os.tcgetpgrp(number) == os.getpgrp()
    except (OSError, ValueError, AttributeError):  # closed, or replaced
        return False


def _typed(number: int) -> str:
    if not select.select([number], [], [], 0.0)[0]:
        return ''
    return os.read(number, 64).decode(errors='ignore')
