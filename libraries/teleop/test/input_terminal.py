# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A terminal emulator without a window: the master side of a real pseudo-terminal."""

from __future__ import annotations

import os
import pty
import re
import select
import termios
import threading
import time
import tty
from types import TracebackType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from typing_extensions import Self

_SEQUENCES = re.compile(rb'\x1b\[\?u|\x1b\[c|\x1b\[>(\d+)u|\x1b\[<u|\x1b\[5n|\x1b\[\?(\d+)([hl])')


class ScriptedTerminal:
    """Answers requests of a program, as a terminal with or without the Kitty keyboard protocol."""

    def __init__(
        self, *, kitty: bool, supported: int = 31, answers: bool = True, delay: float = 0.0
    ) -> None:
        """Open a pseudo-terminal.

        Args:
            kitty: Speak the protocol.
            supported: Enhancements that it has.
            answers: Answer questions at all.
            delay: How long an answer is on its way [s].
        """
        self._master, self._slave = pty.openpty()
        self.path = os.ttyname(self._slave)  # device that the program opens
        self.flags: list[int] = []  # stack of the protocol's flags
        self.modes: set[int] = set()  # DEC private modes that are on
        self.written = b''  # all that the program wrote
        self.answered = 0  # how many answers have been sent
        self._kitty = kitty
        self._supported = supported
        self._answers = answers
        self._delay = delay
        self._stalled = threading.Event()
        self._changed = threading.Condition()
        self._wake, self._waker = os.pipe()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def send(self, text: str) -> None:
        """Send characters, as a key press without releases does."""
        os.write(self._master, text.encode())

    def key(self, character: str, event: int) -> None:
        """Send an event of the protocol: 1 press, 2 repeat, 3 release."""
        text = f';{ord(character)}' if event < 3 else ''
        self.send(f'\x1b[{ord(character)};1:{event}{text}u')

    def stall(self) -> None:
        """Answer nothing any more, as when the network is cut."""
        self._stalled.set()

    def settings(self) -> list[object]:
        """Return the terminal's settings, as the shell sees them."""
        return list(termios.tcgetattr(self._slave))

    def unread(self) -> bytes:
        """Return what the program left for the shell to read."""
        os.set_blocking(self._slave, False)
        before = termios.tcgetattr(self._slave)
        tty.setraw(self._slave, termios.TCSANOW)
        try:
            return os.read(self._slave, 4096)
        except BlockingIOError:
            return b''
        finally:
            termios.tcsetattr(self._slave, termios.TCSANOW, before)

    def wait_written(self, pattern: bytes, timeout: float = 5.0) -> None:
        """Wait until the program wrote something."""
        with self._changed:
            found = self._changed.wait_for(lambda: re.search(pattern, self.written), timeout)
        assert found, f'no {pattern!r} in {self.written!r}'

    def wait_answered(self, count: int, timeout: float = 5.0) -> None:
        """Wait until some answers have been sent."""
        with self._changed:
            assert self._changed.wait_for(lambda: self.answered >= count, timeout)

    def hang_up(self) -> None:
        """Close the window."""
        if self._thread.is_alive():
            os.close(self._waker)
            self._thread.join()  # a descriptor that is read is not closed for the other side
            for descriptor in (self._wake, self._slave, self._master):
                os.close(descriptor)

    def __enter__(self) -> Self:
        """Use it in a with statement."""
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Close it."""
        self.hang_up()

    def _run(self) -> None:
        pending = b''
        while self._wake not in select.select([self._master, self._wake], [], [])[0]:
            data = os.read(self._master, 4096)
            if self._stalled.is_set():
                continue
            pending = self._take(pending + data)
            with self._changed:
                self.written += data
                self._changed.notify_all()

    def _take(self, data: bytes) -> bytes:
        end = 0
        for match in _SEQUENCES.finditer(data):
            end = match.end()
            self._handle(match)
        return data[end:][-16:]

    def _handle(self, match: re.Match[bytes]) -> None:
        sequence = match[0]
        if match[2]:
            change = self.modes.add if match[3] == b'h' else self.modes.discard
            change(int(match[2]))
        elif sequence == b'\x1b[c':
            self._answer('\x1b[?62;22c')
        elif sequence == b'\x1b[5n':
            self._answer('\x1b[0n')
        elif self._kitty and sequence == b'\x1b[?u':
            self._answer(f'\x1b[?{self.flags[-1] if self.flags else 0}u')
        elif self._kitty and match[1]:
            self.flags.append(int(match[1]) & self._supported)
        elif self._kitty and sequence == b'\x1b[<u':
            self.flags.pop()

    def _answer(self, text: str) -> None:
        if self._answers:
            time.sleep(self._delay)
            os.write(self._master, text.encode())
            with self._changed:
                self.answered += 1
                self._changed.notify_all()
