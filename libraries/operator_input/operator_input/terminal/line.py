# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The file descriptor of a terminal: raw mode, writing that never waits, and giving it back."""

from __future__ import annotations

import contextlib
import os
import select
import termios

from ..exceptions import TerminalError

CONTROLLING_TERMINAL = '/dev/tty'
_IFLAG, _LFLAG, _CC = 0, 3, 6  # of the list that termios.tcgetattr returns
_CHUNK = 4096


class TerminalLine:
    """Opens a terminal by its path; characters come at once, unechoed, and Ctrl-C is one of them.

    The terminal is opened anew, so that reading without waiting does not change the standard
    input, which the shell shares. What is printed is formatted by the terminal as usual.
    """

    def __init__(self, path: str = CONTROLLING_TERMINAL) -> None:
        """Open it and switch to raw mode.

        Args:
            path: Device of the terminal.

        Raises:
            TerminalError: It cannot be opened.
        """
        try:
            self._descriptor = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        except OSError as error:
            raise TerminalError(
                f'no terminal to read keys from ({path}: {error.strerror}); start this in a '
                'terminal, with ros2 run or python, and not as a service or in the background'
            ) from None
        try:
            self._before = termios.tcgetattr(self._descriptor)
        except termios.error as error:
            os.close(self._descriptor)
            raise TerminalError(f'{path} is no terminal ({error.args[-1]})') from None
        self._is_open = True
        self.raw()

    def fileno(self) -> int:
        """Return the file descriptor, to wait for it with others."""
        return self._descriptor

    def raw(self) -> None:
        """Switch to raw mode, as after a pause."""
        attributes = termios.tcgetattr(self._descriptor)
        attributes[_IFLAG] &= ~(termios.IXON | termios.ICRNL | termios.INLCR | termios.ISTRIP)
        attributes[_LFLAG] &= ~(termios.ICANON | termios.ECHO | termios.ISIG | termios.IEXTEN)
        attributes[_CC][termios.VMIN], attributes[_CC][termios.VTIME] = 1, 0
        termios.tcsetattr(self._descriptor, termios.TCSANOW, attributes)

    def cooked(self) -> None:
        """Give it back as it was found; unread input is dropped, the shell must not run it."""
        with contextlib.suppress(termios.error):  # a closed window has nothing to restore
            termios.tcsetattr(self._descriptor, termios.TCSAFLUSH, self._before)

    def read(self, timeout: float) -> bytes:
        """Read what has come.

        Args:
            timeout: Longest wait for the first byte [s].

        Raises:
            TerminalError: It was closed.
        """
        readable, _, _ = select.select([self._descriptor], [], [], max(timeout, 0.0))
        return self.read_now() if readable else b''

    def read_now(self) -> bytes:
        """Read what has come, without waiting.

        Raises:
            TerminalError: It was closed.
        """
        try:
            data = os.read(self._descriptor, _CHUNK)
        except BlockingIOError:
            return b''
        except OSError as error:
            raise TerminalError(f'the terminal is gone: {error.strerror}') from None
        if not data:
            raise TerminalError('the terminal is gone: end of file')
        return data

    def write(self, text: str) -> None:
        """Write as much as the terminal takes at once.

        A terminal that is stuck loses text; the robot must not wait for it.

        Args:
            text: Characters and control sequences.
        """
        with contextlib.suppress(OSError):
            os.write(self._descriptor, text.encode())

    def width(self) -> int:
        """Return its width [characters]."""
        try:
            return os.get_terminal_size(self._descriptor).columns or 80
        except OSError:
            return 80

    def close(self) -> None:
        """Restore and close it; further calls do nothing."""
        if self._is_open:
            self._is_open = False
            self.cooked()
            os.close(self._descriptor)
