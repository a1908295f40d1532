# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the controller reports of itself on /diagnostics (REP 107), for a person at a keyboard."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum

NAME = 'controller_node: state'
"""Name of the status, after a namespace if there is one."""

REPORT_TIMEOUT = 3.0  # [s] after which a report is history
FOLLOWS_VELOCITIES = frozenset({'walk', 'turn', 'policy'})
"""Modes in which velocities do anything."""


class Level(IntEnum):
    """How it is; as in diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


@dataclass(frozen=True, slots=True)
class ControllerReport:
    """One report.

    Attributes:
        state: What the robot does: ``walk``, ``to stand``, ``fault``.
        goal: The mode that it is on its way to.
        level: Whether all is well.
        message: What is not, in words.
        time: When it came [s].
    """

    state: str
    goal: str
    level: Level
    message: str
    time: float

    def is_fresh(self, now: float) -> bool:
        """Return whether it still counts.

        Args:
            now: Time [s].
        """
        return now - self.time < REPORT_TIMEOUT

    @property
    def has_fault(self) -> bool:
        """Whether a fault is latched."""
        return self.level is Level.ERROR

    @property
    def follows_velocities(self) -> bool:
        """Whether velocities do anything now, or soon."""
        return self.goal in FOLLOWS_VELOCITIES


def read_report(
    name: str, level: int, message: str, values: Mapping[str, str], now: float
) -> ControllerReport | None:
    """Read a status of /diagnostics.

    Args:
        name: Its name.
        level: Its level.
        message: Its message.
        values: Its values.
        now: Time [s].

    Returns:
        None if it is not the controller's.
    """
    if not name.endswith(NAME) or 'state' not in values:
        return None
    known = level if level in set(Level) else Level.STALE
    state = values['state']
    return ControllerReport(state, values.get('goal', state), Level(known), message, now)
