# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Which of several sources of velocities is active. Pure; time is handed in.

As in twist_mux: of the sources that are not stale and not below a lock, the one of the highest
priority is forwarded; of equal ones the first by name. A lock is closed while its last message
was true, and when it is stale. Other than there: when the source that is active falls silent or is
locked, the robot is commanded to stop, and does not wait for its own time-out; and a source
that never published does not block others, even with a time-out of 0.
"""

from __future__ import annotations

from dataclasses import dataclass
import math

from ..exceptions import CommandError
from .sources import Input, Inputs

NEVER = -math.inf


@dataclass(slots=True)
class _InputState:
    time: float = NEVER
    locked: bool = False


class Multiplexer:
    """Decides for each message whether it is forwarded, and when to send a zero."""

    def __init__(self, inputs: Inputs) -> None:
        """Start without a message; locks that have a time-out are closed.

        Args:
            inputs: What is listened to.
        """
        self.inputs = inputs
        self._sources = {each.name: _InputState() for each in inputs.sources}
        self._locks = {each.name: _InputState() for each in inputs.locks}
        self._forwarded: str | None = None  # the source whose motion was forwarded last

    def lock_priority(self, now: float) -> int:
        """Return the priority below which sources are locked; 0 when nothing is locked.

        Args:
            now: Time [s].
        """
        return max(
            (lock.priority for lock in self.inputs.locks if self.is_locked(lock, now)), default=0
        )

    def is_locked(self, lock: Input, now: float) -> bool:
        """Return whether a lock is closed.

        Args:
            lock: One of the inputs.
            now: Time [s].
        """
        received = self._locks[lock.name]
        return received.locked or lock.is_stale(received.time, now)

    def is_masked(self, source: Input, now: float) -> bool:
        """Return whether a source is not active: stale, or locked.

        Args:
            source: One of the inputs.
            now: Time [s].
        """
        received = self._sources[source.name].time
        silent = received == NEVER or source.is_stale(received, now)
        return silent or source.priority < self.lock_priority(now)

    def active(self, now: float) -> Input | None:
        """Return the source that is active; None when there is none.

        Args:
            now: Time [s].
        """
        active = [each for each in self.inputs.sources if not self.is_masked(each, now)]
        return max(active, key=lambda each: each.priority, default=None)

    def velocity(self, name: str, parts: tuple[float, ...], now: float) -> bool:
        """Take a velocity.

        Args:
            name: Its source.
            parts: Its numbers, linear and angular [m/s, rad/s].
            now: Time [s].

        Returns:
            Whether to forward it.

        Raises:
            CommandError: One of the numbers is none; the message does not count as received.
        """
        if not all(math.isfinite(part) for part in parts):
            raise CommandError(f'{name} sends {parts}, which is not finite; it is not forwarded')
        self._sources[name].time = now
        active = self.active(now)
        if active is None or active.name != name:
            return False
        self._forwarded = name if any(parts) else None
        return True

    def lock(self, name: str, locked: bool, now: float) -> None:
        """Take a message of a lock.

        Args:
            name: Which lock.
            locked: Close it.
            now: Time [s].
        """
        self._locks[name].time = now
        self._locks[name].locked = locked

    def zero_due(self, now: float) -> bool:
        """Return whether to send a zero now: the robot moves, and no source is active any more.

        Args:
            now: Time [s].
        """
        if self._forwarded is None or self.active(now) is not None:
            return False
        self._forwarded = None
        return True
