# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Keys of a terminal, with their releases where the terminal reports them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
import time
from types import TracebackType
from typing import TYPE_CHECKING

from ..exceptions import TerminalError
from ..keys import all_released, KeyEvent
from .decoder import KeyDecoder
from .line import CONTROLLING_TERMINAL, TerminalLine
from .liveness import Liveness, PERIOD, PROBE
from .negotiation import KittyNegotiation, Stage
from .reports import Report

if TYPE_CHECKING:
    from typing_extensions import Self

ESCAPE_TIMEOUT = 0.05  # [s] after which an escape is the key, not the begin of a sequence
DRAIN_TIMEOUT = 0.3  # [s] at the end for answers that would otherwise appear in the shell
_MODES = '?1004', '?2004'  # focus reports and bracketed paste (xterm)
_MODES_ON = ''.join(f'\x1b[{mode}h' for mode in _MODES)
_MODES_OFF = ''.join(f'\x1b[{mode}l' for mode in _MODES)


class TerminalKeyboard:
    """Reads keys from a terminal; a context manager that always gives the terminal back.

    Works in any terminal, over SSH and inside tmux or screen. Nothing waits for the terminal's
    answers: a key that is pressed in the first moment is simply TYPED.
    """

    def __init__(
        self,
        path: str = CONTROLLING_TERMINAL,
        *,
        kitty: bool = True,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Prepare; the terminal is touched on entering the context.

        Args:
            path: Device of the terminal.
            kitty: Request the Kitty keyboard protocol.
            clock: Returns the time [s].
        """
        self._path = path
        self._kitty = kitty
        self._clock = clock
        self._line: TerminalLine | None = None
        self._decoder = KeyDecoder()
        self._negotiation = KittyNegotiation()
        self._liveness = Liveness()
        self._last_data = 0.0  # [s] when anything was read

    @property
    def stage(self) -> Stage:
        """How far the terminal's promise to report releases has got."""
        return self._negotiation.stage

    @property
    def line(self) -> TerminalLine:
        """The terminal, to write to.

        Raises:
            TerminalError: Outside of the context.
        """
        if self._line is None:
            raise TerminalError('the terminal is not open: use the keyboard in a with statement')
        return self._line

    def fileno(self) -> int:
        """Return the file descriptor, to wait for it with others."""
        return self.line.fileno()

    def read(self, timeout: float = 0.0) -> list[KeyEvent]:
        """Read what has happened to the keys.

        Args:
            timeout: Longest wait [s]; it ends with the first byte.

        Raises:
            TerminalError: The terminal was closed. All keys count as released.
        """
        data = self.line.read(min(timeout, self.escape_timeout()))
        now = self._clock()
        if data:
            self._liveness.received()
            self._last_data = now
            found = self._decoder.feed(data, now)
        elif self._decoder.is_pending and now - self._last_data >= ESCAPE_TIMEOUT:
            found = self._decoder.flush(now)
        else:
            found = []
        events = [event for event in found if isinstance(event, KeyEvent)]
        for report in found:
            if isinstance(report, Report):
                self._answer(report)
        return [*events, *self._check_line(now)]

    def escape_timeout(self) -> float:
        """Return after which time read() wants to be called again [s], whatever happens."""
        if self._decoder.is_pending:
            return ESCAPE_TIMEOUT
        return PERIOD if self._decoder.is_holding else 60.0

    def __enter__(self) -> Self:
        """Open the terminal and negotiate with it."""
        self._line = TerminalLine(self._path)
        self._begin()
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Give the terminal back."""
        if self._line is not None:
            self._end()
            self._line.close()
            self._line = None

    @contextlib.contextmanager
    def paused(self) -> Iterator[None]:
        """Give the terminal back for the time of the block, as for Ctrl-Z."""
        line = self.line
        self._end()
        line.cooked()
        try:
            yield
        finally:
            line.raw()
            self._begin()

    def _begin(self) -> None:
        self._decoder = KeyDecoder()
        self._negotiation = KittyNegotiation()
        self._liveness = Liveness()
        self.line.write(_MODES_ON + (self._negotiation.start() if self._kitty else ''))

    def _end(self) -> None:
        self.line.write(_MODES_OFF + self._negotiation.stop())
        deadline = self._clock() + DRAIN_TIMEOUT
        with contextlib.suppress(TerminalError):
            while self._negotiation.is_waiting or self._liveness.is_waiting:
                data = self.line.read(deadline - self._clock())
                if not data:
                    return
                self._liveness.received()
                for report in self._decoder.feed(data, 0.0):
                    if isinstance(report, Report):
                        self._negotiation.take(report)

    def _answer(self, report: Report) -> None:
        answer = self._negotiation.take(report)
        self._decoder.reports_releases = self._negotiation.stage is Stage.ACTIVE
        if answer:
            self.line.write(answer)

    def _check_line(self, now: float) -> list[KeyEvent]:
        """Probe the terminal while a key is held, and let go when it is silent."""
        if not self._decoder.is_holding:
            return []
        if self._liveness.is_lost(now):
            self._decoder.forget()
            return [all_released(now)]
        if self._liveness.probe_due(now):
            self.line.write(PROBE)
        return []
