# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Which joints without states are worth a warning: not those of a robot that starts or ends."""

from __future__ import annotations

from collections.abc import Iterable

START_TIMEOUT = 30.0  # [s] in which the first state of a joint comes, or comes again after an end


class SilenceWatch:
    """Distinguishes a lost drive from a master that has not started yet, or has ended.

    A master that ends takes its publishers out of the graph; a drive that is lost does not.
    """

    def __init__(self, joints: Iterable[str], now: float) -> None:
        self._absent_since: dict[str, float] = dict.fromkeys(joints, now)
        self._silent: frozenset[str] = frozenset()

    def note(self, joint: str) -> None:
        """The state of a joint has come."""
        self._absent_since.pop(joint, None)

    def look(self, silent: Iterable[str], published: Iterable[str], now: float) -> list[str]:
        """Return the joints that are missing; call it every few seconds.

        The ``silent`` have no states now; those of the ``published`` have a publisher in the
        graph.
        """
        before, self._silent = self._silent, frozenset(silent)
        there = set(published)
        missing = []
        for joint in silent:
            if joint not in there and joint not in self._absent_since:
                self._absent_since[joint] = now
            absent_since = self._absent_since.get(joint)
            # a master that ends is silent for a moment before its publishers go
            was_silent = joint in before and absent_since is None
            if was_silent or (absent_since is not None and now - absent_since > START_TIMEOUT):
                missing.append(joint)
        return missing
