# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How many messages of a topic were lost on their way, by their publisher's numbers."""

from __future__ import annotations

from collections.abc import Set as AbstractSet
from dataclasses import dataclass


@dataclass(slots=True)
class LossCounter:
    """Counts the numbers that are missing in what one publisher sent.

    A message does not say who published it. So numbers are compared only as long as the same
    single publisher is in the graph before and after; of several publishers nothing is counted.

    Attributes:
        lost: How many messages are known to be lost.
    """

    lost: int = 0
    _last: int | None = None
    _gap: int = 0
    _publishers: AbstractSet[bytes] = frozenset()

    def receive(self, sequence: int | None) -> None:
        """Take the number of a message; None where the middleware has none."""
        if sequence is not None and self._last is not None:
            self._gap += max(sequence - self._last - 1, 0)
        self._last = sequence

    def confirm(self, publishers: AbstractSet[bytes]) -> int:
        """Take who publishes now; count what was missing since the last time.

        Args:
            publishers: Identifiers of the publishers in the graph.

        Returns:
            How many messages were lost since the last time.
        """
        one = len(publishers) == 1 and publishers == self._publishers
        found = self._gap if one else 0
        self.lost += found
        self._gap = 0
        if not one:
            self._last = None
        self._publishers = publishers
        return found
