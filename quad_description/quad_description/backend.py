# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A robot that can be commanded and observed, wherever it is: physics, serial line, recording."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from .state import RobotState

if TYPE_CHECKING:
    from typing_extensions import Self


class Backend(ABC):
    """What gets joint targets and gives states, one period after the other."""

    names: tuple[str, ...]  # joints in the order of states and targets
    period: float  # time that a step takes in [s]

    @abstractmethod
    def reset(self) -> RobotState:
        """Begin anew and return the first state."""

    @abstractmethod
    def step(self, targets: Sequence[float] | None) -> RobotState:
        """Send targets in [rad], or nothing; return the state a period later."""

    @abstractmethod
    def observe(self) -> RobotState:
        """Return the state of now; no time passes."""

    @abstractmethod
    def close(self) -> None:
        """Release what the back end holds; nothing else may be called afterwards."""

    def __enter__(self) -> Self:
        """Use it in a with statement."""
        return self

    def __exit__(self, *_error: object) -> None:
        """Close it."""
        self.close()


class RecordedBackend(Backend):
    """Plays states that another back end gave; the last one stays."""

    def __init__(
        self, names: Sequence[str], states: Iterable[RobotState], period: float = 0.02
    ) -> None:
        """Begin at the first state.

        Args:
            names: Joints in the order of the states.
            states: In the order in which they were observed, at least one.

        Raises:
            ValueError: There is no state.
        """
        self.names, self.period = tuple(names), period
        self._states = tuple(states)
        if not self._states:
            raise ValueError('a recording needs at least one state')
        # all targets that were to be sent, in their order
        self.sent: list[Sequence[float] | None] = []

    @property
    def finished(self) -> bool:
        """Whether the last state was observed."""
        return len(self.sent) + 1 >= len(self._states)

    def reset(self) -> RobotState:
        """Begin at the first state."""
        self.sent = []
        return self._states[0]

    def step(self, targets: Sequence[float] | None) -> RobotState:
        """Keep the targets; return the next state."""
        self.sent.append(targets)
        return self.observe()

    def observe(self) -> RobotState:
        """Return the state of now."""
        return self._states[min(len(self.sent), len(self._states) - 1)]

    def close(self) -> None:
        """Do nothing: a recording holds nothing."""
