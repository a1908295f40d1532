# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A robot whose servos are read while someone moves them by hand."""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
import math
from statistics import median
import threading
from typing import TYPE_CHECKING

from ..exceptions import NoAnswerError
from ..link import Driver, LinkOptions, LinkState, RobotState

if TYPE_CHECKING:
    from types import TracebackType

    from typing_extensions import Self

SAMPLES = 15  # reports that one reading is the median of
PATIENCE = 4.0  # [s] for a robot to report


class HandheldRobot:
    """Reads angles, takes torque away and gives it back."""

    def __init__(self, options: LinkOptions, motors: Collection[int]) -> None:
        """Look for the robot; use it in a with statement.

        Args:
            options: Where it is.
            motors: Ids of those that it has; a board may refuse a command for any other.
        """
        self._motors = frozenset(motors)
        self._recent: deque[Mapping[int, float]] = deque(maxlen=SAMPLES)
        self._changed = threading.Condition()
        self._driver = Driver(options, self._take, self._forget)

    def angles(self) -> dict[int, float]:
        """Return the servo angles [deg] by motor, as they are from now on.

        Raises:
            NoAnswerError: The robot does not report; says why.
        """
        with self._changed:
            self._recent.clear()
            if not self._changed.wait_for(lambda: len(self._recent) == SAMPLES, PATIENCE):
                raise NoAnswerError(self._driver.status().detail)
            motors = set[int].intersection(*(set(angles) for angles in self._recent))
            return {m: median(angles[m] for angles in self._recent) for m in sorted(motors)}

    @contextmanager
    def limp(self) -> Iterator[None]:
        """Take torque away, and give it back at the end, where the servos are then.

        Raises:
            NoAnswerError: The robot does not report; says why.
        """
        if not self._driver.torque(on=False):
            raise NoAnswerError(self._driver.status().detail)
        self.angles()  # by then it has gone out
        try:
            yield
        finally:
            self._driver.command(self.angles())  # a servo that wakes goes to its last target
            self._driver.torque(on=True)
            self.angles()

    def _take(self, state: RobotState) -> str:
        with self._changed:
            self._recent.append(
                {
                    motor: angle
                    for motor, angle in state.positions.items()
                    if motor in self._motors and math.isfinite(angle)
                }
            )
            self._changed.notify_all()
        return ''

    def _forget(self, _state: LinkState, _detail: str) -> None:
        with self._changed:
            self._recent.clear()

    def __enter__(self) -> Self:
        """Look for the robot.

        Raises:
            NoAnswerError: It is not found.
        """
        self._driver.start()
        try:
            self.angles()
        except NoAnswerError:
            self._driver.stop()
            raise
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Leave the robot."""
        self._driver.stop()
