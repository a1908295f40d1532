# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What should be said once when it begins, and once when it is over."""

from __future__ import annotations

from collections.abc import Iterator

from .status import Event, EventKind


class Notices:
    """Compares what is the matter now with what was the matter in the step before."""

    def __init__(self) -> None:
        self._present: set[str] = set()

    def step(self, present: dict[str, str], over: dict[str, str]) -> Iterator[Event]:
        """Yield what has changed.

        Args:
            present: What is the matter, by a name for it.
            over: What to say when it is no longer, by the same names; nothing where there is none.
        """
        for name, text in present.items():
            if name not in self._present:
                yield Event(EventKind.WARNING, text)
        for name in sorted((self._present - set(present)) & set(over)):
            yield Event(EventKind.NEWS, over[name])
        self._present = set(present)
