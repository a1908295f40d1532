# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Node guarding: requests for the state of a device without heartbeat (CiA 301, 7.2.8.3.2.1)."""

from __future__ import annotations

from ..can.frame import Frame
from ..standard.cob_id import CobId
from .bus_sender import Send

TOGGLE = 0x80  # bit of an answer that changes with each


def guarding_request(node_id: int) -> Frame:
    """Return the remote frame that requests the NMT state of a device."""
    return Frame(CobId.HEARTBEAT + node_id, is_remote=True)


class Guarding:
    """Requests the state of one device, again and again, and counts the missing answers."""

    def __init__(self, node_id: int, guard_time: float, retry_factor: int, send: Send) -> None:
        """Nothing is sent before :meth:`start`; ``guard_time`` is in [s]."""
        self._request = guarding_request(node_id)
        self._guard_time = guard_time
        self._retry_factor = retry_factor
        self._send = send
        self._due: float | None = None
        self._unanswered = 0
        self._toggle: int | None = None

    def start(self, now: float) -> None:
        """Begin to send requests at a time in [s]; the first answer may have either toggle bit."""
        self._due, self._unanswered, self._toggle = now, 0, None

    def stop(self) -> None:
        """Send no more requests."""
        self._due = None

    def receive(self, data: bytes) -> bool:
        """Take an answer; return whether its toggle bit makes it a new one."""
        toggle = data[0] & TOGGLE
        if toggle == self._toggle:
            return False
        self._toggle = toggle
        self._unanswered = 0
        return True

    def advance(self, now: float) -> bool:
        """Send a request when it is due; return whether the device counts as lost."""
        if self._due is None or now < self._due:
            return False
        if self._unanswered >= self._retry_factor:
            self._due = None
            return True
        self._unanswered += 1
        due = self._due + self._guard_time
        self._due = due if due > now else now + self._guard_time
        self._send(self._request)
        return False
