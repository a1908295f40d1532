# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A port whose bytes are recorded as they pass."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
import time
from typing import Protocol as Interface

from ..link import Port, Session
from .serial_log import Opened, StateEntered


class Recorder(Interface):
    """Takes what happens on a line, in the thread of the driver, without waiting for anything.

    Times are on the monotonic clock [s].
    """

    def transfer(self, now: float, data: bytes, sent: bool) -> None:
        """Take bytes that were read, or written."""

    def event(self, event: Opened | StateEntered) -> None:
        """Take a robot that was found, or a change of the link's state."""


class TappedPort:
    """A port whose bytes go to recorders, too. Bytes that are refused are not recorded.

    Attributes:
        path: Device file.
        baud: Speed [bit/s].
    """

    def __init__(self, port: Port, recorders: Sequence[Recorder]) -> None:
        """Stand before a port."""
        self.path, self.baud = port.path, port.baud
        self.fileno: Callable[[], int] = port.fileno
        self._port = port
        self._record = [recorder.transfer for recorder in recorders]

    def read(self) -> bytes:
        """Return what has arrived; to be called when something has."""
        data = self._port.read()
        if data:
            now = time.monotonic()
            for record in self._record:
                record(now, data, False)
        return data

    def write(self, data: bytes) -> None:
        """Send bytes."""
        now = time.monotonic()  # before, as the answer may come before this returns
        self._port.write(data)
        for record in self._record:
            record(now, data, True)

    def close(self) -> None:
        """Close the port."""
        self._port.close()


def tapped(session: Session, recorders: Sequence[Recorder]) -> Session:
    """Return a session whose bytes go to recorders, which learn of it."""
    port, protocol = session.port, session.dialect.protocol
    opened = Opened(
        time.monotonic(), port.path, port.baud, protocol.name, session.firmware, session.model
    )
    for recorder in recorders:
        recorder.event(opened)
    return replace(session, port=TappedPort(port, recorders))
