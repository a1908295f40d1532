# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Both ends of the socket of sd_notify(3), where a process reports that it is ready."""

from __future__ import annotations

import contextlib
import os
import socket

VARIABLE = 'NOTIFY_SOCKET'  # names the socket in the environment of the process
_READY = b'READY=1'
_STATUS = b'STATUS='
_MAX_MESSAGE = 4096


class ReadinessSocket:
    """Receives what one process reports; others of systemd's messages are passed over.

    Attributes:
        status: What it said last of itself, for the user.
    """

    def __init__(self) -> None:
        """Open it."""
        self.status = ''
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK)
        self._socket.bind('')  # the kernel chooses a free name in the abstract namespace

    @property
    def address(self) -> str:
        """What the variable names."""
        name: bytes = self._socket.getsockname()
        return f'@{name[1:].decode()}'

    def fileno(self) -> int:
        """Its file descriptor, for a selector."""
        return self._socket.fileno()

    def is_ready(self) -> bool:
        """Receive what has come; true when readiness was in it."""
        ready = False
        with contextlib.suppress(BlockingIOError):
            while True:
                lines = self._socket.recv(_MAX_MESSAGE).splitlines()
                ready |= _READY in lines
                for line in lines:
                    if line.startswith(_STATUS):
                        self.status = line.removeprefix(_STATUS).decode(errors='replace')
        return ready

    def close(self) -> None:
        """Close the socket; what the process reports from now on is lost."""
        self._socket.close()


class ServiceManager:
    """What started this process and waits for its readiness: systemd for ``Type=notify``."""

    def __init__(self) -> None:
        """Find it; the processes that this one starts will not."""
        address = os.environ.pop(VARIABLE, '')
        self._address = f'\0{address[1:]}' if address.startswith('@') else address
        self._reported = ''

    def report(self, state: str) -> None:
        """Report a state of sd_notify(3) once, if there is a service manager."""
        if not self._address or state == self._reported:
            return
        self._reported = state
        with (
            socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sender,
            contextlib.suppress(OSError),
        ):
            sender.sendto(state.encode(), self._address)
