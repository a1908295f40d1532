# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a part of the device looks like to the clock."""

from __future__ import annotations

from typing import Protocol

NEVER = float('inf')  # [s] the deadline of a part that waits for nothing


class Timed(Protocol):
    """A part that has something to do at a time that it knows."""

    @property
    def deadline(self) -> float:
        """Steady time in [s] at which it wants to be advanced."""

    def advance(self, now: float) -> None:
        """Process what is due at steady time ``now`` in [s]."""
