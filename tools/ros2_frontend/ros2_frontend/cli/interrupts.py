# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""When Ctrl-C and SIGTERM may interrupt, and when they have to wait a moment."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import signal
import threading
from types import FrameType

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


def _in_main_thread() -> bool:
    return threading.current_thread() is threading.main_thread()


@contextlib.contextmanager
def sigterm_interrupts() -> Iterator[None]:
    """Let SIGTERM unwind the stack as Ctrl-C does, so that no ghost node stays in the graph."""
    if not _in_main_thread():
        yield
        return
    previous = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, previous)


@contextlib.contextmanager
def deferred_interrupts() -> Iterator[None]:
    """Keep an interrupt for the end of the block; a second one in the block is not kept.

    An executor that is interrupted in the midst of a callback never runs another one of the same
    group, and `action send_goal` could not cancel its goal any more.

    Raises:
        KeyboardInterrupt: At the end of the block.
    """
    if not _in_main_thread():
        yield
        return
    kept: list[int] = []

    def keep(number: int, frame: FrameType | None) -> None:
        if kept:
            signal.default_int_handler(number, frame)
        kept.append(number)

    # what is ignored (a background job of a script) stays ignored
    previous = {number: signal.getsignal(number) for number in _SIGNALS}
    for number, handler in previous.items():
        if handler is not signal.SIG_IGN:
            signal.signal(number, keep)
    try:
        yield
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)
    if kept:
        raise KeyboardInterrupt
