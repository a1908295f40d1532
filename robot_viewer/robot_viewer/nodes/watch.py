# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What was last seen of a robot on its topics, from which its state is computed."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
import math
import time

from diagnostic_msgs.msg import DiagnosticArray
from sensor_msgs.msg import JointState

from ..robot_state import legs_of, Seen, STALE, Status, walks

STATUS_AGE = 5.0
"""Time in [s] after which a status that does not come again is unknown."""
STATUS_SILENCE = 3.5
"""Time in [s] without any status after which a robot is out of reach, where no one listens to its
joint states."""
MOVES = 0.01
"""Velocity of a joint in [rad/s] or [m/s] above which it moves."""
STILL_AFTER = 0.3
"""Time in [s] after which a joint that was not seen to move again stands."""
OWN = ': robot'
"""End of the name of the status that a page publishes of its robot."""


class Watch:
    """Takes joint states and diagnostics.

    Attributes:
        statuses: The last of each name.
        answer: The status that a page publishes of this robot; None before one.
    """

    def __init__(self) -> None:
        self.statuses: dict[str, Status] = {}
        self.answer: Status | None = None
        self._times: dict[str, float] = {}
        self._joints_at: float | None = None
        self._since: float | None = None  # when it began to listen to joint states
        self._moved_at = -math.inf

    def forget(self) -> None:
        """Forget the statuses: they are old, or those of another robot."""
        self.statuses.clear()
        self._times.clear()

    @property
    def joints_age(self) -> float | None:
        """Time in [s] since the last joint states; None before them."""
        return None if self._joints_at is None else time.monotonic() - self._joints_at

    def listen(self, *, begins: bool) -> None:
        """Record that joint states are listened to from now on, or no more."""
        self._since, self._joints_at = time.monotonic() if begins else None, None

    def take_joints(self, message: JointState) -> None:
        """Record a message of the robot."""
        self._joints_at = time.monotonic()
        if any(abs(velocity) > MOVES for velocity in message.velocity):
            self._moved_at = self._joints_at

    def take_statuses(self, message: DiagnosticArray) -> None:
        """Record a message of any node of the robot."""
        for status in message.status:
            level = min(status.level[0], STALE)  # others than those of diagnostic_msgs: unknown
            values = {each.key: each.value for each in status.values}
            kept = Status(status.name, level, status.message, values)
            if status.name.endswith(OWN):
                self.answer = kept
                continue
            self.statuses[status.name] = kept
            self._times[status.name] = time.monotonic()

    @property
    def legs(self) -> list[Status]:
        """What the controller of a walking robot says."""
        return legs_of(self.statuses.values())

    def aged(self, now: float) -> list[Status]:
        """Return the statuses as they are known now; one that does not come again is unknown."""
        found = []
        for name, status in self.statuses.items():
            age = now - self._times[name]
            if age >= STATUS_AGE:
                text = f'unknown for {age:.0f} s; before: {status.message}'
                status = replace(status, level=STALE, message=text)  # noqa: PLW2901
            found.append(status)
        return found

    def silence(self, now: float, *, publishes: bool) -> float:
        """Return the time in [s] since the last message of the robot; 0 where it sends none.

        Args:
            now: Steady time.
            publishes: It was seen to publish joint states.
        """
        if publishes and self._since is not None:
            return now - (self._joints_at or self._since)
        last = max(self._times.values(), default=now)
        return now - last if now - last > STATUS_SILENCE else 0.0

    def moves(self, since: float = -math.inf) -> bool:
        """Whether the robot moves: a walking one follows a velocity, of others a joint moves.

        Args:
            since: Steady time in [s]; what was seen before does not count.
        """
        legs = self.legs
        if legs:  # they move while it stands, too
            return any(walks(each) and self._times[each.name] > since for each in legs)
        return self._moved_at > max(since, time.monotonic() - STILL_AFTER)

    def seen(self, robot: str, services: Iterable[str], *, publishes: bool) -> Seen:
        """Return what is known now.

        Args:
            robot: Its name; empty for none.
            services: Full names of Trigger services.
            publishes: It was seen to publish joint states.
        """
        now = time.monotonic()
        return Seen(
            robot=robot,
            silence=self.silence(now, publishes=publishes),
            statuses=self.aged(now),
            services=frozenset(services),
            moving=self.moves(),
        )
