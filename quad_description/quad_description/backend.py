# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A robot that can be commanded and observed, wherever it is: in physics or on a serial line."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
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
