# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Controls when Ctrl-C and SIGTERM interrupt, and when they are deferred."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
import math
import os
import select
import signal
import sys
import threading
import time
from types import FrameType


@contextlib.contextmanager
def keys(enabled: bool = True) -> Iterator[Callable[[], str]]:
    """Read keys without waiting for Enter.

    Yields:
        A function that returns the text typed since its last call; always empty if not enabled, or
        if standard input is no terminal or belongs to another process group.
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


_SIGNALS = (signal.SIGINT, signal.SIGTERM)
ECHO_TIME = 0.5
"""Time in [s] in which further signals count as the same one: `timeout` sends its signal twice."""
_taken = [-math.inf]  # steady time of the last signal that was not such an echo in [s]


@contextlib.contextmanager
def signals_interrupt() -> Iterator[None]:
    """Unwind the stack at SIGINT and SIGTERM, so that no stale node stays in the graph.

    SIGINT needs it because a script's shell starts background jobs with SIGINT ignored.
    """
    with _handling(signal.default_int_handler):
        yield


@contextlib.contextmanager
def deferred_interrupts() -> Iterator[None]:
    """Defer an interrupt to the end of the block; a second one acts at once.

    An executor that is interrupted during a callback never runs another one of the same group, so
    `action send_goal` could no longer cancel its goal.

    Raises:
        KeyboardInterrupt: At the end of the block.
    """
    kept: list[int] = []

    def keep(number: int, frame: FrameType | None) -> None:
        if kept:
            signal.default_int_handler(number, frame)
        kept.append(number)

    with _handling(keep):
        yield
    if kept:
        raise KeyboardInterrupt


@contextlib.contextmanager
def _handling(handler: Callable[[int, FrameType | None], object]) -> Iterator[None]:
    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread may set handlers, and runs them
        return

    def take(number: int, frame: FrameType | None) -> None:
        now = time.monotonic()
        if now - _taken[0] >= ECHO_TIME:
            _taken[0] = now
            handler(number, frame)

    previous = {number: signal.signal(number, take) for number in _SIGNALS}
    try:
        yield
    finally:
        for number, before in previous.items():
            signal.signal(number, before)
