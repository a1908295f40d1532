# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A serial log that is written while it happens, by a thread of its own."""

from __future__ import annotations

import logging
from pathlib import Path
from queue import Empty, SimpleQueue
import threading
import time
from typing import TextIO

from ..exceptions import RecordingError
from .serial_log import format_event, format_transfer, HEADER, Opened, StateEntered

FLUSH_PERIOD = 0.5  # [s] of which a program that is killed loses at most
CLOSE_TIMEOUT = 10.0  # [s] for what is still to be written when the program ends
_log = logging.getLogger(__name__)


class SerialLogFile:
    """Writes all that happens on a line. A disk that is full ends the log, and nothing else."""

    def __init__(self, path: Path) -> None:
        """Open a new file.

        Raises:
            RecordingError: There is one already, or it cannot be made.
        """
        self._path = path
        self._lines: SimpleQueue[str | None] = SimpleQueue()
        self._ended = False  # nobody takes lines out of the queue any more
        # one offset for all: the log runs evenly also when somebody sets the clock
        self._offset = time.time() - time.monotonic()
        try:
            self._file = path.open('x', encoding='utf-8')
        except FileExistsError as error:
            raise RecordingError(f'{path} exists; choose another name for the log') from error
        except OSError as error:
            raise RecordingError(f'{path} cannot be written: {error.strerror}') from error
        self._file.write(HEADER)
        self._thread = threading.Thread(target=self._run, name='serial log', daemon=True)
        self._thread.start()

    def transfer(self, now: float, data: bytes, sent: bool) -> None:
        """Take bytes that were read, or written."""
        if not self._ended:
            self._lines.put(format_transfer(now + self._offset, data, sent=sent))

    def event(self, event: Opened | StateEntered) -> None:
        """Take a robot that was found, or a change of the link's state."""
        if not self._ended:
            self._lines.put(format_event(event, event.time + self._offset))

    def close(self) -> None:
        """Write what is left, and close the file; never raises."""
        if not self._ended:
            self._lines.put(None)
        self._thread.join(CLOSE_TIMEOUT)
        if self._thread.is_alive():
            _log.warning(
                '%s: the disk did not take the end of the serial log within %g s',
                self._path,
                CLOSE_TIMEOUT,
            )

    def _run(self) -> None:
        try:
            with self._file as file:
                self._write(file)
        except OSError as error:
            _log.warning(
                '%s: %s; the serial log ends here. Make room, or choose another disk by the '
                'parameter serial_log',
                self._path,
                error.strerror,
            )
        finally:
            self._ended = True
            while not self._lines.empty():
                self._lines.get()

    def _write(self, file: TextIO) -> None:
        while (line := self._lines.get()) is not None:
            file.write(line)
            flush_at = time.monotonic() + FLUSH_PERIOD
            while (left := flush_at - time.monotonic()) > 0.0:
                try:
                    more = self._lines.get(timeout=left)
                except Empty:
                    break
                if more is None:
                    return
                file.write(more)
            file.flush()
