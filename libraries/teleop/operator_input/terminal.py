# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Reads keys from a terminal, with releases if the terminal reports them; shows a status line.

A terminal with the Kitty keyboard protocol answers ``CSI ? u``; every terminal answers ``CSI c``.
If only the second answer arrives, the protocol is not supported. The program waits for neither:
until the protocol is active, keys are read without releases.

A key whose release the terminal reports is held until then. If the connection to the terminal
stalls, that report never arrives; so the terminal is probed while a key is held.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
import contextlib
from enum import Enum
import os
import re
import select
import termios
import time
from typing import Any, TYPE_CHECKING
import unicodedata

from .exceptions import TerminalError
from .key_decoder import KeyDecoder, Kitty, Report, ReportKind
from .keys import all_released, KeyEvent

if TYPE_CHECKING:
    from typing_extensions import Self


CONTROLLING_TERMINAL = '/dev/tty'
QUERY = '\x1b[?u\x1b[c'
WANTED = (
    Kitty.DISAMBIGUATE | Kitty.EVENT_TYPES | Kitty.ALTERNATE_KEYS | Kitty.ALL_KEYS | Kitty.TEXT
)
# without ALL_KEYS the keys that type a character do not report their release
NEEDED = Kitty.EVENT_TYPES | Kitty.ALL_KEYS
PUSH, POP = f'\x1b[>{WANTED:d}u', '\x1b[<u'
PROBE = '\x1b[5n'  # device status report (ECMA-48, 8.3.35): every terminal answers CSI 0 n
PROBE_PERIOD = 0.25  # [s] between two probes
PROBE_TIMEOUT = 1.0  # [s] without any sign
ESCAPE_TIMEOUT = 0.05  # [s] after which an escape is the key, not the begin of a sequence
DRAIN_TIMEOUT = 0.3  # [s] at the end for answers that would otherwise appear in the shell
_MODES = '?1004', '?2004'  # focus reports and bracketed paste (xterm)
_MODES_ON = ''.join(f'\x1b[{mode}h' for mode in _MODES)
_MODES_OFF = ''.join(f'\x1b[{mode}l' for mode in _MODES)
_IFLAG, _LFLAG, _CC = 0, 3, 6  # of the list that termios.tcgetattr returns


class Stage(Enum):
    """Stage of the negotiation of the Kitty keyboard protocol."""

    IDLE = 'idle'
    REQUESTED = 'requested'
    PUSHED = 'switched on, not confirmed'
    ACTIVE = 'active'
    ABSENT = 'absent'


class TerminalDialogue:
    """Dialogue with the terminal; pure: processes reports, returns the text to write."""

    def __init__(self) -> None:
        self.stage = Stage.IDLE  # how far its promise to report releases has got
        self._attributes_due = 0  # answers to CSI c
        self._probed = 0.0
        self._unanswered_since: float | None = None  # first probe without any sign since

    @property
    def is_waiting(self) -> bool:
        """Whether answers are still pending."""
        return self._attributes_due > 0 or self._unanswered_since is not None

    def start(self) -> str:
        """Return the request for the protocol."""
        self.stage = Stage.REQUESTED
        self._attributes_due += 1
        return QUERY

    def stop(self) -> str:
        """Return the sequence that restores the terminal."""
        was, self.stage = self.stage, Stage.IDLE
        return POP if was in {Stage.PUSHED, Stage.ACTIVE} else ''

    def take(self, report: Report) -> str:
        """Process a report of the terminal; return the text to write."""
        if report.kind is ReportKind.DEVICE_ATTRIBUTES:
            return self._take_attributes()
        if report.kind is not ReportKind.KITTY_FLAGS:
            return ''
        if self.stage is Stage.REQUESTED:
            self.stage = Stage.PUSHED
            self._attributes_due += 1
            return PUSH + QUERY
        if self.stage is Stage.PUSHED:
            self.stage = Stage.ACTIVE if NEEDED in report.flags else Stage.ABSENT
            return '' if self.stage is Stage.ACTIVE else POP
        return ''

    def received(self) -> None:
        """Record that the terminal sent something, so it is alive."""
        self._unanswered_since = None

    def probe(self, now: float) -> str:
        """Return the probe if it is time for one."""
        if now - self._probed < PROBE_PERIOD:
            return ''
        self._probed = now
        if self._unanswered_since is None:
            self._unanswered_since = now
        return PROBE

    def is_lost(self, now: float) -> bool:
        """Return whether the terminal has left probes unanswered for too long."""
        return self._unanswered_since is not None and now - self._unanswered_since > PROBE_TIMEOUT

    def _take_attributes(self) -> str:
        self._attributes_due = max(self._attributes_due - 1, 0)
        if self._attributes_due or self.stage not in {Stage.REQUESTED, Stage.PUSHED}:
            return ''  # an answer to the first of two questions, or all is settled
        was, self.stage = self.stage, Stage.ABSENT
        return POP if was is Stage.PUSHED else ''


class TerminalKeyboard:
    """Reads keys from a terminal; a context manager that always restores the terminal.

    Works in any terminal, over SSH and inside tmux or screen. Characters arrive at once, without
    echo, Ctrl-C included. It does not wait for the terminal's answers: a key pressed before them
    is just TYPED.

    It opens the terminal by its path, so that non-blocking reads do not change the standard input,
    which the shell shares. Printed text is formatted as usual.
    """

    def __init__(self, path: str = CONTROLLING_TERMINAL, *, kitty: bool = True) -> None:
        """Prepare; entering the context opens the terminal."""
        self._path = path
        self._kitty = kitty
        self._descriptor: int | None = None
        self._before: list[Any] = []  # its settings
        self._decoder, self._dialogue = KeyDecoder(), TerminalDialogue()
        self._last_data = 0.0  # [s] when anything was read

    @property
    def stage(self) -> Stage:
        """Stage of the negotiation about key releases."""
        return self._dialogue.stage

    def fileno(self) -> int:
        """Return the file descriptor, to wait for it together with others.

        Raises:
            TerminalError: Called outside of the context.
        """
        if self._descriptor is None:
            raise TerminalError('the terminal is not open: use the keyboard in a with statement')
        return self._descriptor

    def write(self, text: str) -> None:
        """Write characters and control sequences, as many as the terminal takes at once.

        A blocked terminal loses text, as the robot must not wait for it.
        """
        descriptor = self.fileno()
        with contextlib.suppress(OSError):
            os.write(descriptor, text.encode())

    def width(self) -> int:
        """Return the width of the terminal in [characters]."""
        descriptor = self.fileno()
        try:
            return os.get_terminal_size(descriptor).columns or 80
        except OSError:
            return 80

    def read(self, timeout: float = 0.0) -> list[KeyEvent]:
        """Read key events; wait for the first byte at most ``timeout`` in [s].

        Raises:
            TerminalError: The terminal was closed. All keys count as released.
        """
        data = self._read_bytes(min(timeout, self.longest_wait()))
        now = time.monotonic()
        found: list[KeyEvent | Report] = []
        if data:
            self._dialogue.received()
            self._last_data = now
            found = self._decoder.feed(data, now)
        elif self._decoder.is_pending and now - self._last_data >= ESCAPE_TIMEOUT:
            found = self._decoder.flush(now)
        events = [event for event in found if isinstance(event, KeyEvent)]
        for report in found:
            if isinstance(report, Report):
                if answer := self._dialogue.take(report):
                    self.write(answer)
                self._decoder.reports_releases = self.stage is Stage.ACTIVE
        return [*events, *self._check_line(now)]

    def longest_wait(self) -> float:
        """Return the time in [s] after which read() must be called again at the latest."""
        if self._decoder.is_pending:
            return ESCAPE_TIMEOUT
        return PROBE_PERIOD if self._decoder.is_holding else 60.0

    def __enter__(self) -> Self:
        """Open the terminal and negotiate with it.

        Raises:
            TerminalError: The device cannot be opened, or is no terminal.
        """
        self._open()
        self._decoder, self._dialogue = KeyDecoder(), TerminalDialogue()
        self.write(_MODES_ON + (self._dialogue.start() if self._kitty else ''))
        return self

    def __exit__(self, *_: object) -> None:
        """Restore the terminal."""
        if self._descriptor is None:
            return
        self.write(_MODES_OFF + self._dialogue.stop())
        with contextlib.suppress(TerminalError):
            self._drain()
        # the shell must not run what is unread; a closed window has nothing to restore
        with contextlib.suppress(termios.error):
            termios.tcsetattr(self._descriptor, termios.TCSAFLUSH, self._before)
        os.close(self._descriptor)
        self._descriptor = None

    @contextlib.contextmanager
    def paused(self) -> Iterator[None]:
        """Restore the terminal for the duration of the block, as for Ctrl-Z."""
        self.__exit__()
        try:
            yield
        finally:
            self.__enter__()

    def _open(self) -> None:
        try:
            descriptor = os.open(self._path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        except OSError as error:
            raise TerminalError(
                f'no terminal to read keys from ({self._path}: {error.strerror}); start this in a '
                'terminal, with ros2 run or python, and not as a service or in the background'
            ) from None
        try:
            self._before = termios.tcgetattr(descriptor)
            raw = termios.tcgetattr(descriptor)
        except termios.error as error:
            os.close(descriptor)
            raise TerminalError(f'{self._path} is no terminal ({error.args[-1]})') from None
        raw[_IFLAG] &= ~(termios.IXON | termios.ICRNL | termios.INLCR | termios.ISTRIP)
        raw[_LFLAG] &= ~(termios.ICANON | termios.ECHO | termios.ISIG | termios.IEXTEN)
        raw[_CC][termios.VMIN], raw[_CC][termios.VTIME] = 1, 0
        termios.tcsetattr(descriptor, termios.TCSANOW, raw)
        self._descriptor = descriptor

    def _read_bytes(self, timeout: float) -> bytes:
        descriptor = self.fileno()
        if not select.select([descriptor], [], [], max(timeout, 0.0))[0]:
            return b''
        try:
            data = os.read(descriptor, 4096)
        except BlockingIOError:
            return b''
        except OSError as error:
            raise TerminalError(f'the terminal is gone: {error.strerror}') from None
        if not data:
            raise TerminalError('the terminal is gone: end of file')
        return data

    def _drain(self) -> None:
        """Read pending answers of the terminal."""
        deadline = time.monotonic() + DRAIN_TIMEOUT
        while self._dialogue.is_waiting and (
            data := self._read_bytes(deadline - time.monotonic())
        ):
            self._dialogue.received()
            for report in self._decoder.feed(data, 0.0):
                if isinstance(report, Report):
                    self._dialogue.take(report)

    def _check_line(self, now: float) -> list[KeyEvent]:
        """Probe the terminal while a key is held; release all keys if it does not answer."""
        if not self._decoder.is_holding:
            return []
        if self._dialogue.is_lost(now):
            self._decoder.forget()
            return [all_released(now)]
        if probe := self._dialogue.probe(now):
            self.write(probe)
        return []


_CONTROL = re.compile('\x1b\\[[0-9;]*m')

RESET, CLEAR_LINE = '\x1b[0m', '\r\x1b[K'


class Style(Enum):
    """Style of a part, as a control sequence of ECMA-48 (SGR)."""

    PLAIN = ''
    BOLD = '\x1b[1m'
    DIM = '\x1b[2m'
    GREEN = '\x1b[32m'
    YELLOW = '\x1b[33m'
    RED = '\x1b[1;31m'


StatusPart = tuple[str, Style]


def status_text(parts: Iterable[StatusPart], *, colour: bool) -> str:
    """Join the parts of a status line, the most important first: a narrow window cuts the rest."""
    return ' | '.join(
        f'{style.value}{text}{RESET}' if colour and style.value else text for text, style in parts
    )


class StatusLine:
    """Shows a status line in place; it is cut to the window width, so it never wraps.

    Texts may contain colours.
    """

    def __init__(self, output: TerminalKeyboard) -> None:
        self._output = output
        self._shown = ''

    def show(self, text: str) -> None:
        """Show a line, unless it is already shown."""
        line = fitted(text, self._output.width() - 1)
        if line != self._shown:
            self._output.write(CLEAR_LINE + line)
            self._shown = line

    def message(self, text: str) -> None:
        """Write permanent lines above the status line."""
        self._output.write(f'{CLEAR_LINE}{text}\n{self._shown}')

    def end(self) -> None:
        """Move below the line, which stays visible."""
        if self._shown:
            self._output.write('\n')
        self._shown = ''


def fitted(text: str, width: int) -> str:
    """Cut a line to ``width`` columns; colours are kept, and reset at the cut."""
    result: list[str] = []
    left, position = width, 0
    while position < len(text):
        control = _CONTROL.match(text, position)
        piece = control[0] if control else text[position]
        columns = 0 if control else _columns(piece)
        if columns > left:
            return ''.join(result) + (RESET if '\x1b' in text else '')
        result.append(piece)
        left -= columns
        position += len(piece)
    return ''.join(result)


def _columns(character: str) -> int:
    if unicodedata.combining(character):
        return 0
    return 2 if unicodedata.east_asian_width(character) in {'W', 'F'} else 1
