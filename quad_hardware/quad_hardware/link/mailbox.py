# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Orders for the robot, from any thread to the one that has the line."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
import threading


@dataclass(frozen=True, slots=True)
class Orders:
    """What is to be sent."""

    # servo angles by motor id [deg]; None for no new ones
    angles: Mapping[int, float] | None = None
    torque: bool | None = None  # servos hold, or let go; None to leave it


_NONE = Orders()


class Mailbox:
    """Keeps the newest order of each kind until it is taken.

    It takes orders while it is open. An order that was accepted is taken, replaced by a newer one
    of its kind, or returned by :meth:`close`: it is never lost in silence.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._orders = _NONE
        self._open = False

    def open(self) -> None:
        """Accept orders from now on."""
        with self._lock:
            self._open = True

    def close(self) -> Orders:
        """Accept no more orders; return those that were not taken."""
        with self._lock:
            self._open = False
            orders, self._orders = self._orders, _NONE
            return orders

    def put_angles(self, angles: Mapping[int, float]) -> bool:
        """Leave servo angles by motor id [deg]; return whether they are accepted."""
        with self._lock:
            if self._open:
                self._orders = replace(self._orders, angles=angles)
            return self._open

    def put_torque(self, *, on: bool) -> bool:
        """Have the servos hold, or let go; return whether that is accepted."""
        with self._lock:
            if self._open:
                self._orders = replace(self._orders, torque=on)
            return self._open

    @property
    def is_empty(self) -> bool:
        """Whether there is nothing to be taken."""
        with self._lock:
            return self._orders == _NONE

    def take(self) -> Orders:
        """Return what is to be sent now."""
        with self._lock:
            orders, self._orders = self._orders, _NONE
            return orders
