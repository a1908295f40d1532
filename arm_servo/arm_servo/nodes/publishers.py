# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The publishers of one topic, told apart by the numbers of their messages."""

from __future__ import annotations

from collections.abc import Mapping

MAX_LOST = 100
"""Messages of a publisher that may be lost in a row."""

MAX_PUBLISHERS = 16
"""Publishers that are remembered."""

UNSUPPORTED = 2**64 - 1
"""Number where the middleware counts none."""


class Publishers:
    """Tells from which publisher a message is: rclpy hands out its number, and no name.

    Each publisher counts its messages, so a message goes on from the last one of its own. Where
    the middleware does not count, all are one.
    """

    def __init__(self) -> None:
        self._last: dict[int, int] = {}
        self._count = 0

    def of(self, info: Mapping[str, int | None]) -> int:
        """Return the publisher of a message.

        Args:
            info: What rclpy says of the message.
        """
        number = info.get('publication_sequence_number')
        if number is None or number == UNSUPPORTED:
            return 0
        gaps = {each: number - last for each, last in self._last.items()}
        near = [each for each, gap in gaps.items() if 0 < gap <= MAX_LOST]
        if near:
            publisher = min(near, key=lambda each: gaps[each])
        else:
            self._count += 1
            publisher = self._count
        self._last.pop(publisher, None)  # the one that is silent for longest is forgotten first
        self._last[publisher] = number
        if len(self._last) > MAX_PUBLISHERS:
            del self._last[next(iter(self._last))]
        return publisher
