# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Whether a device lives: its heartbeat, or its answers to node guarding (CiA 301, 7.2.8.3)."""

from __future__ import annotations

import math

from ..can.frame import Frame
from ..config.model import NodeConfig
from ..standard.nmt import NmtState
from .bus_sender import Send
from .guarding import Guarding


class LifeSigns:
    """The error control of one device.

    Attributes:
        last: Steady time of the last heartbeat, or of the last answer, in [s].
        silent: It was started and has never shown one, though it is supervised; it has to show one
            before it is started again.
    """

    def __init__(self, config: NodeConfig, send: Send) -> None:
        """Prepare; nobody is supervised before :meth:`start`.

        Args:
            config: The device.
            send: Hands a frame to the bus.
        """
        self.last = 0.0
        self.silent = False
        self._config = config
        self._since = 0.0
        self._timeout = math.inf
        self._guarding: Guarding | None = None
        if config.uses_node_guarding:
            timing = (config.guard_time, config.retry_factor)
            self._guarding = Guarding(config.node_id, *timing, send)

    def start(self, now: float) -> None:
        """Supervise from a time in [s] on, from which the first sign is awaited."""
        self.last = self._since = now
        self.silent = False
        self._timeout = self._config.heartbeat_timeout or math.inf
        if self._guarding is not None:
            self._guarding.start(now)

    def stop(self) -> None:
        """Supervise no more."""
        self._timeout = math.inf
        if self._guarding is not None:
            self._guarding.stop()

    def take(self, state: NmtState, frame: Frame, *, supervised: bool) -> bool:
        """Take a sign; return whether it is a new one, by the toggle bit of node guarding.

        Args:
            state: The NMT state in it.
            frame: The frame that carries it.
            supervised: The device is online, so that its toggle bit means something.
        """
        guarding = self._guarding if supervised and state is not NmtState.BOOT_UP else None
        if guarding is not None and not guarding.receive(frame.data):
            return False
        self.last = frame.timestamp
        return True

    def overdue(self, now: float) -> str:
        """Return in words what is missing at a time in [s], empty while nothing is."""
        if now - self.last > self._timeout:
            self.silent = self.last <= self._since
            return f'heartbeat lost: none within its consumer time of {self._timeout * 1000:g} ms'
        if self._guarding is not None and self._guarding.advance(now):
            self.silent = self.last <= self._since
            config = self._config
            return (
                f'lost: no answer to node guarding {config.retry_factor} times in a row, each '
                f'{config.guard_time * 1000:g} ms apart'
            )
        return ''
