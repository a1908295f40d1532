# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A serial port without hardware: a pseudo-terminal behind a stable path."""

from __future__ import annotations

from contextlib import suppress
import os
from pathlib import Path
import pty
import socket
import termios
import tty
from typing import TYPE_CHECKING

from ..exceptions import SetupError

if TYPE_CHECKING:
    from typing_extensions import Self

CHUNK = 4096  # [B]
DEVICES = Path('/dev/pts')
_OUTPUT_SPEED = 5  # index in what tcgetattr returns
_BAUD_OF = {
    getattr(termios, name): int(name[1:])
    for name in dir(termios)
    if name.startswith('B') and name[1:].isdigit() and name != 'B0'
}


class PseudoTerminal:
    """The robot's end of a serial line; the other end is a device that any program can open."""

    def __init__(self, link: Path) -> None:
        """Make the device and the link.

        Raises:
            SetupError: Something else is there, or the link cannot be made.
        """
        self.link = link  # path that leads to the device, whatever its name is
        self._master = self._slave = -1
        self._claim = _claim(link)
        if os.path.lexists(link) and not _is_left_over(link):
            self._claim.close()
            raise SetupError(f'{link} is there already and is not ours; choose another --link')
        self.plug()

    @property
    def plugged(self) -> bool:
        """Whether the device exists."""
        return self._master >= 0

    @property
    def device(self) -> str:
        """Name of the device itself, empty without one."""
        return os.ttyname(self._slave) if self.plugged else ''

    def plug(self) -> None:
        """Make the device, if there is none.

        Raises:
            SetupError: The link cannot be made.
        """
        if self.plugged:
            return
        self._master, self._slave = pty.openpty()
        # this end of the device stays open: settings survive between two programs
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        try:
            self.link.unlink(missing_ok=True)
            self.link.symlink_to(self.device)
        except OSError as error:
            self.unplug()
            raise SetupError(f'{self.link} cannot be made: {error.strerror}') from error

    def unplug(self) -> None:
        """Remove the device: programs that have it open see a hang-up."""
        if not self.plugged:
            return
        device = self.device
        if self.link.is_symlink() and str(self.link.readlink()) == device:
            self.link.unlink()
        os.close(self._slave)
        os.close(self._master)
        self._master = self._slave = -1

    def fileno(self) -> int:
        """Return what :mod:`select` waits for."""
        return self._master

    @property
    def baud(self) -> int:
        """Speed that the program at the other end has chosen [bit/s]; 0 for one without a name."""
        return _BAUD_OF.get(termios.tcgetattr(self._master)[_OUTPUT_SPEED], 0)

    def read(self) -> bytes:
        """Return the bytes that have arrived, without waiting."""
        try:
            return os.read(self._master, CHUNK)
        except BlockingIOError:
            return b''

    def write(self, data: bytes) -> None:
        """Send bytes; those that are not read are lost, as on a wire."""
        with suppress(BlockingIOError):
            os.write(self._master, data)

    def close(self) -> None:
        """Remove the device and the link."""
        self.unplug()
        self._claim.close()

    def __enter__(self) -> Self:
        """Use it in a with statement."""
        return self

    def __exit__(self, *_error: object) -> None:
        """Remove the device and the link."""
        self.close()


def _claim(link: Path) -> socket.socket:
    """Claim a path for this process, in a way that ends with it even when it is killed."""
    claim = socket.socket(socket.AF_UNIX)
    try:
        # a name that is no file: Linux gives it back by itself
        claim.bind(f'\0fake_xgo:{link.absolute()}')
    except OSError as error:
        claim.close()
        raise SetupError(
            f'{link} belongs to another simulated robot; end it, or choose another --link'
        ) from error
    return claim


def _is_left_over(link: Path) -> bool:
    """Return whether a link is what a simulated robot that was killed has left behind."""
    return link.is_symlink() and link.readlink().parent == DEVICES
