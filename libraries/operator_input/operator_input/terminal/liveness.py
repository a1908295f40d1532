# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Notices that a terminal is gone while a key is held.

A key whose release the terminal reports is held until then. Should the line to the terminal stall,
the report never comes; so the terminal is probed as long as a key is held.
"""

from __future__ import annotations

PROBE = '\x1b[5n'  # device status report (ECMA-48, 8.3.35): every terminal answers CSI 0 n
PERIOD = 0.25  # [s] between two probes
TIMEOUT = 1.0  # [s] without any sign


class Liveness:
    """When to probe, and when to give up; pure, time is handed in."""

    def __init__(self) -> None:
        self._probed = 0.0  # [s] when the last probe was sent
        self._unanswered_since: float | None = None

    def received(self) -> None:
        """Take notice of anything that the terminal sent."""
        self._unanswered_since = None

    @property
    def is_waiting(self) -> bool:
        """Whether a probe is not answered yet."""
        return self._unanswered_since is not None

    def probe_due(self, now: float) -> bool:
        """Return whether to send a probe now, and take it as sent.

        Args:
            now: Time [s].
        """
        if now - self._probed < PERIOD:
            return False
        self._probed = now
        if self._unanswered_since is None:
            self._unanswered_since = now
        return True

    def is_lost(self, now: float) -> bool:
        """Return whether the terminal has been silent for too long.

        Args:
            now: Time [s].
        """
        return self._unanswered_since is not None and now - self._unanswered_since > TIMEOUT
