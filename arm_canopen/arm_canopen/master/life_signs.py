# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Whether a device lives: its heartbeat, or its answers to node guarding (CiA 301, 7.2.8.3)."""

from __future__ import annotations

import math

from canopen_core.can import Frame
from canopen_core.standard import CobId, NmtState

from ..config.model import NodeConfig
from .frame_sender import Send

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
        """Process an answer; return whether its toggle bit makes it a new one."""
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


class LifeSigns:
    """The error control of one device."""

    def __init__(self, config: NodeConfig, send: Send) -> None:
        """Nothing is supervised before :meth:`start`."""
        self.last = 0.0  # steady time of the last heartbeat, or of the last answer, in [s]
        # it was started and has never shown one, though it is supervised; it has to show one
        # before it is started again
        self.silent = False
        self.missed = 0  # how often in a row one was missing when it was due
        self._config = config
        self._since = self._awaited_from = 0.0
        self._timeout = math.inf
        self._guarding: Guarding | None = None
        if config.uses_node_guarding:
            timing = (config.guard_time, config.retry_factor)
            self._guarding = Guarding(config.node_id, *timing, send)

    @property
    def consumer_time(self) -> float:
        """Time in [s] after which a life sign counts as missing."""
        config = self._config
        return config.heartbeat_timeout or config.guard_time * config.retry_factor

    def start(self, now: float) -> None:
        """Supervise from a time in [s] on, from which the first sign is awaited."""
        self.last = self._since = now
        self.silent = False
        self.missed = 0
        self._timeout = self._config.heartbeat_timeout or math.inf
        self._await_next(now)

    def stop(self) -> None:
        """Supervise no more."""
        self.missed = 0
        self._timeout = math.inf
        if self._guarding is not None:
            self._guarding.stop()

    def take(self, state: NmtState, frame: Frame, *, supervised: bool) -> bool:
        """Process a life sign; return whether it is new, by the toggle bit of node guarding.

        The toggle bit counts for a supervised device only, which is online.
        """
        guarding = self._guarding if supervised and state is not NmtState.BOOT_UP else None
        if guarding is not None and not guarding.receive(frame.data):
            return False
        self.last = frame.timestamp
        self.missed = 0
        return True

    def overdue(self, now: float) -> str:
        """Return in words what is missing at a time in [s], empty while nothing is.

        What is missing is awaited again from then on.
        """
        if now - max(self.last, self._awaited_from) > self._timeout:
            self._miss(now)
            return f'heartbeat lost: none within its consumer time of {self._timeout * 1000:g} ms'
        if self._guarding is not None and self._guarding.advance(now):
            self._miss(now)
            config = self._config
            return (
                f'lost: no answer to node guarding {config.retry_factor} times in a row, each '
                f'{config.guard_time * 1000:g} ms apart'
            )
        return ''

    def _miss(self, now: float) -> None:
        self.silent = self.last <= self._since
        self.missed += 1
        self._await_next(now)

    def _await_next(self, now: float) -> None:
        self._awaited_from = now
        if self._guarding is not None:
            self._guarding.start(now)
