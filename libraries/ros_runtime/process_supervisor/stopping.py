# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Stopping processes in order, each by its ladder of signals.

This module needs the standard library only: the guardian runs it without the environment.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from signal import Signals


@dataclass(slots=True)
class _Member:
    order: int
    steps: Sequence[tuple[Signals, float]]
    step: int = -1
    deadline: float = 0.0


class StopSequence:
    """Stops the processes of one order after those of the order before.

    It gets what happened (:meth:`exited`) and what time it is (:meth:`advance`), and sends
    signals, each to the process of a name, through the callable it was given. ``now`` is steady
    time in [s].

    Attributes:
        forced: Names of processes that did not end by their first signal.
        abandoned: Names of those that did not even end by their last one.
    """

    def __init__(self, send: Callable[[str, Signals], None]) -> None:
        """Begin with no process to stop."""
        self._send = send
        self._members: dict[str, _Member] = {}
        self.forced: set[str] = set()
        self.abandoned: list[str] = []

    def add(self, name: str, order: int, steps: Iterable[tuple[Signals, float]]) -> None:
        """Add a running process, and the signals with the time in [s] that each is given."""
        self._members[name] = _Member(order, tuple(steps))

    @property
    def finished(self) -> bool:
        """No process is left."""
        return not self._members

    @property
    def current(self) -> list[str]:
        """Names of the processes whose turn it is."""
        lowest = min((member.order for member in self._members.values()), default=0)
        return [name for name, member in self._members.items() if member.order == lowest]

    def exited(self, name: str) -> None:
        """Remove a process that has ended."""
        self._members.pop(name, None)

    def advance(self, now: float) -> None:
        """Send what is due: the first signal to those whose turn it is, the next to the slow."""
        while turn := self.current:
            for name in turn:
                self._advance_member(name, now)
            if any(name in self._members for name in turn):
                return

    def _advance_member(self, name: str, now: float) -> None:
        member = self._members[name]
        if member.step >= 0 and now < member.deadline:
            return
        member.step += 1
        if member.step >= len(member.steps):
            self.abandoned.append(name)
            del self._members[name]
            return
        if member.step:
            self.forced.add(name)
        signal, timeout = member.steps[member.step]
        member.deadline = now + timeout
        self._send(name, signal)

    def next_deadline(self) -> float | None:
        """Steady time in [s] at which :meth:`advance` has something to do, None for never."""
        deadlines = [self._members[name].deadline for name in self.current]
        return min(deadlines, default=None)

    def force(self, now: float) -> None:
        """Kill all processes at once, in no order."""
        for name, member in self._members.items():
            member.order = 0
            member.steps = ((Signals.SIGKILL, 2.0),)
            member.step = 0
            member.deadline = now + 2.0
            self.forced.add(name)
            self._send(name, Signals.SIGKILL)
