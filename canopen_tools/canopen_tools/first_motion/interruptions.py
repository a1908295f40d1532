# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Signals that end a program while drives are under power: an exception, once, and then silence.

The first of them unwinds the stack, so that the master stops its drives on the way out. Those that
follow must not interrupt that.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
import os
import signal
from types import FrameType

ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class Interrupted(BaseException):  # as KeyboardInterrupt: no handler of errors may swallow it
    """The program shall end."""

    def __init__(self, number: int) -> None:
        self.number = number  # the signal
        super().__init__(signal.Signals(number).name)


@contextmanager
def interruptions() -> Iterator[None]:
    """Raise :class:`Interrupted` in the main thread at the first signal, within a block.

    Those that follow are ignored.
    """
    before = {each: signal.getsignal(each) for each in ENDING}
    _listen()
    try:
        yield
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)


@contextmanager
def uninterrupted_end(resource: AbstractContextManager[object]) -> Iterator[None]:
    """Enter a resource, and let no signal end its way out."""
    with resource:
        try:
            yield
        finally:
            _ignore()
    _listen()


def _end(number: int, _frame: FrameType | None) -> None:
    _ignore()
    if number == signal.SIGHUP:  # the terminal is gone, and writing to it would fail
        nowhere = os.open(os.devnull, os.O_WRONLY)
        for descriptor in (1, 2):
            os.dup2(nowhere, descriptor)
        os.close(nowhere)
    raise Interrupted(number)


def _listen() -> None:
    for each in ENDING:
        signal.signal(each, _end)


def _ignore() -> None:
    for each in ENDING:
        signal.signal(each, signal.SIG_IGN)
