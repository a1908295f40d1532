# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Selects the active one of several velocity sources. No ROS or clock; times are in [s].

As in twist_mux, it forwards the source with the highest priority that is neither stale nor below a
lock; among equal ones, the first by name. A lock is closed while its last message was true, and
when it is stale. Unlike twist_mux, it commands a stop when the active source falls silent or is
locked, without waiting for the robot's own time-out; and a source that never published does not
block others, even with a time-out of 0.

Parameters are named as in twist_mux 4: ``topics.<name>.{topic, timeout, priority}`` and
``locks.<name>.{topic, timeout, priority}``.
"""

from __future__ import annotations

from dataclasses import dataclass
import math

from .exceptions import CommandError

NEVER = -math.inf


@dataclass(frozen=True, slots=True)
class Input:
    """A velocity topic or a lock topic."""

    name: str  # name among the parameters
    topic: str  # name of the topic
    timeout: float  # silence after which it is stale; 0 for never
    priority: int  # 0 to 255; of those that publish, the highest is active

    def is_stale(self, received: float, now: float) -> bool:
        """Return whether the time-out since the last message has expired."""
        return self.timeout > 0.0 and now - received > self.timeout


@dataclass(frozen=True, slots=True)
class Inputs:
    """All subscriptions of the multiplexer: velocities and locks, ordered by name."""

    sources: tuple[Input, ...]
    locks: tuple[Input, ...]


DEFAULTS = Inputs(
    sources=(
        Input('joystick', 'joy_vel', 0.5, 100),
        Input('keyboard', 'key_vel', 0.5, 90),
        Input('navigation', 'nav_vel', 0.5, 10),
    ),
    locks=(
        Input('e_stop', 'e_stop', 0.0, 255),
        Input('pause_navigation', 'pause_navigation', 0.0, 50),
    ),
)
"""What is used without any parameters."""


class Multiplexer:
    """Decides which messages to forward, and when to send a zero velocity."""

    def __init__(self, inputs: Inputs) -> None:
        """Start without messages; locks with a time-out are closed."""
        self.inputs = inputs
        self._received: dict[str, float] = {}  # when a source published last
        self._locks = {each.name: (NEVER, False) for each in inputs.locks}  # when, and what
        self._forwarded: str | None = None  # the source whose motion was forwarded last

    def lock_priority(self, now: float) -> int:
        """Return the priority below which sources are locked; 0 if none is."""
        return max(
            (lock.priority for lock in self.inputs.locks if self.is_locked(lock, now)), default=0
        )

    def is_locked(self, lock: Input, now: float) -> bool:
        """Return whether a lock is closed."""
        received, locked = self._locks[lock.name]
        return locked or lock.is_stale(received, now)

    def is_masked(self, source: Input, now: float) -> bool:
        """Return whether a source is stale or locked."""
        received = self._received.get(source.name)
        silent = received is None or source.is_stale(received, now)
        return silent or source.priority < self.lock_priority(now)

    def active(self, now: float) -> Input | None:
        """Return the active source; None if there is none."""
        active = [each for each in self.inputs.sources if not self.is_masked(each, now)]
        return max(active, key=lambda each: each.priority, default=None)

    def velocity(self, name: str, parts: tuple[float, ...], now: float) -> bool:
        """Store a source's velocity, linear and angular; return whether to forward it.

        Raises:
            CommandError: A number is not finite; the message is ignored.
        """
        if not all(math.isfinite(part) for part in parts):
            raise CommandError(f'{name} sends {parts}, which is not finite; it is not forwarded')
        self._received[name] = now
        active = self.active(now)
        if active is None or active.name != name:
            return False
        self._forwarded = name if any(parts) else None
        return True

    def lock(self, name: str, locked: bool, now: float) -> None:
        """Store the state of a lock."""
        self._locks[name] = now, locked

    def zero_due(self, now: float) -> bool:
        """Return whether to send a zero now: the robot moves without an active source."""
        if self._forwarded is None or self.active(now) is not None:
            return False
        self._forwarded = None
        return True
