# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Signals that end a program while drives are under power: an exception, once, and then silence.

The first of them unwinds the stack, so that the master stops its drives on the way out. Those that
follow must not interrupt that.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
import os
import signal
from types import FrameType, TracebackType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from typing import TypeAlias

    from typing_extensions import Self

    _Handler: TypeAlias = Callable[[int, FrameType | None], object] | int | signal.Handlers | None

ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class Interrupted(BaseException):  # as KeyboardInterrupt: no handler of errors may swallow it
    """The program shall end."""

    def __init__(self, number: int) -> None:
        self.number = number  # the signal
        super().__init__(signal.Signals(number).name)


class Interruptions:
    """Raises :class:`Interrupted` in the main thread at the first signal, for the time of a block.

    It ignores those that follow.
    """

    def __init__(self) -> None:
        """Change nothing before the block begins."""
        self._before: dict[signal.Signals, _Handler] = {}

    @contextmanager
    def uninterrupted_end(self, resource: AbstractContextManager[object]) -> Iterator[None]:
        """Enter a resource, and let no signal end its way out."""
        with resource:
            try:
                yield
            finally:
                _handle(signal.SIG_IGN)
        _handle(self._end)

    def __enter__(self) -> Self:
        """Begin."""
        self._before = {each: signal.getsignal(each) for each in ENDING}
        _handle(self._end)
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Give the signals back."""
        for each, handler in self._before.items():
            signal.signal(each, handler)

    @staticmethod
    def _end(number: int, _frame: FrameType | None) -> None:
        _handle(signal.SIG_IGN)
        if number == signal.SIGHUP:
            _drop_output()
        raise Interrupted(number)


def _handle(handler: _Handler) -> None:
    for each in ENDING:
        signal.signal(each, handler)


def _drop_output() -> None:
    """Send what is printed nowhere: the terminal is gone, and writing to it would fail."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for descriptor in (1, 2):
        os.dup2(nowhere, descriptor)
    os.close(nowhere)
