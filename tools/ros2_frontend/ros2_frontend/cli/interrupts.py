# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""When Ctrl-C and SIGTERM may interrupt, and when they have to wait a moment."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
import signal
import threading
from types import FrameType

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


@contextlib.contextmanager
def signals_interrupt() -> Iterator[None]:
    """Unwind the stack at SIGINT and SIGTERM, so that no ghost node stays in the graph.

    SIGINT, too: a script's shell starts background jobs with SIGINT ignored.
    """
    with _handling(signal.default_int_handler):
        yield


@contextlib.contextmanager
def deferred_interrupts() -> Iterator[None]:
    """Keep an interrupt for the end of the block; a second one in the block is not kept.

    An executor that is interrupted in the midst of a callback never runs another one of the same
    group, and `action send_goal` could not cancel its goal any more.

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
    previous = {number: signal.signal(number, handler) for number in _SIGNALS}
    try:
        yield
    finally:
        for number, before in previous.items():
            signal.signal(number, before)
