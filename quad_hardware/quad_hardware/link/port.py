# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A non-blocking serial port, so that one thread can wait for several events."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
import errno
import os
from pathlib import Path
import select
import termios
import time
from typing import TYPE_CHECKING

import serial

from ..exceptions import LinkError

if TYPE_CHECKING:
    from typing_extensions import Self

SYSFS = Path('/sys/class/tty')
MAX_LATENCY = 0.004  # [s] a report every 20 ms does not suffer from


def latency_timer(path: str, sysfs: Path = SYSFS) -> float | None:
    """Return the latency timer of a USB adapter [s]; None if the port has none.

    FTDI adapters send a partial packet only when it expires, by default after 16 ms, which delays
    each report of the robot and each answer in protocol v1.

    Args:
        path: Device file, or a link to one.
    """
    name = Path(os.path.realpath(path)).name
    try:
        return int((sysfs / name / 'device' / 'latency_timer').read_text(encoding='ascii')) / 1e3
    except (OSError, ValueError):
        return None


def latency_problem(path: str, latency: float | None) -> str:
    """Return a warning and its remedy if an adapter delays bytes too much; else empty.

    Args:
        path: Device file, or a link to one.
        latency: Its latency timer [s].
    """
    if latency is None or latency <= MAX_LATENCY:
        return ''
    name = Path(os.path.realpath(path)).name
    return (
        f'the adapter keeps bytes back for {latency * 1e3:.0f} ms (latency_timer): '
        f'echo 1 | sudo tee {SYSFS}/{name}/device/latency_timer'
    )


DEFAULT_PORT = '/dev/ttyAMA0'
"""Serial port of the computer on the robot."""

CHUNK = 4096  # [B] more than two frames
WRITE_TIMEOUT = 0.1  # [s] how long a port may take no bytes before it counts as lost


Recorder = Callable[[float, bytes, bool], None]
"""Takes when [s], what, and whether it was sent; in the thread of the driver, without waiting."""


class SerialPort:
    """An open serial port, 8N1, locked against other programs of ours."""

    recorders: Sequence[Recorder] = ()  # take the bytes that pass; those that are refused do not

    def __init__(self, path: str, baud: int) -> None:
        """Open the port.

        Args:
            path: Device file, or a link to one.
            baud: Speed [bit/s].

        Raises:
            LinkError: The port cannot be opened; the message names the remedy.
        """
        self.path = path
        self.baud = baud
        try:
            self._serial = serial.Serial(path, baud, timeout=0, exclusive=True)
        except (OSError, ValueError, termios.error) as error:  # a termios.error is no OSError
            raise LinkError(_explain(path, baud, error)) from error
        with suppress(ValueError):  # most ports know no such mode
            self._serial.set_low_latency_mode(True)  # an FTDI adapter keeps no bytes back then
        try:
            self._serial.reset_input_buffer()
        except (OSError, termios.error) as error:
            self.close()
            raise LinkError(f'{path} was hung up while it was opened: {error}') from error

    def fileno(self) -> int:
        """Return the file descriptor, for :mod:`select`."""
        return int(self._serial.fileno())

    def read(self) -> bytes:
        """Return the received bytes; call it when :mod:`select` reports data.

        Raises:
            LinkError: The port is gone.
        """
        try:
            data = os.read(self.fileno(), CHUNK)
        except BlockingIOError:
            return b''
        except OSError as error:
            raise LinkError(f'{self.path} was lost: {error.strerror}') from error
        if not data:  # ready, and nothing there: the line was hung up
            raise LinkError(f'{self.path} was hung up; was the cable pulled?')
        self._record(time.monotonic(), data, sent=False)
        return data

    def write(self, data: bytes) -> None:
        """Send bytes; wait for at most :data:`WRITE_TIMEOUT`.

        Raises:
            LinkError: The port is gone, or takes no more bytes.
        """
        now = time.monotonic()  # the answer may come before this returns
        left = data
        while left := left[self._write_some(left) :]:
            _, ready, _ = select.select([], [self], [], WRITE_TIMEOUT)
            if not ready or time.monotonic() > now + WRITE_TIMEOUT:
                raise LinkError(f'{self.path} takes no more bytes; is the robot on?')
        self._record(now, data, sent=True)

    def _record(self, now: float, data: bytes, *, sent: bool) -> None:
        for record in self.recorders:
            record(now, data, sent)

    def _write_some(self, data: bytes) -> int:
        try:
            return os.write(self.fileno(), data)
        except BlockingIOError:
            return 0
        except OSError as error:
            raise LinkError(f'{self.path} was lost: {error.strerror}') from error

    def close(self) -> None:
        """Close the port; closing it twice does nothing."""
        self._serial.close()

    def __enter__(self) -> Self:
        """Return the port."""
        return self

    def __exit__(self, *_error: object) -> None:
        """Close the port."""
        self.close()


def _explain(path: str, baud: int, error: Exception) -> str:
    number = getattr(error, 'errno', None)
    if number == errno.ENOENT or not Path(path).exists():
        remedy = 'no such device; is the robot plugged in, and is this its port?'
    elif number == errno.EACCES:
        remedy = 'no permission; run: sudo usermod -aG dialout $USER, then log in again'
    elif number in {errno.EBUSY, errno.EAGAIN}:
        remedy = 'another program has it open; see: fuser ' + path
    elif isinstance(error, ValueError):
        remedy = f'it does not do {baud} baud'
    else:
        remedy = str(error)
    return f'cannot open {path}: {remedy}'
