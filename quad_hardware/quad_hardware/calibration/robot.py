# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A robot whose servos are read while someone moves them by hand."""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
import math
from statistics import fmean, median
import threading
from typing import TYPE_CHECKING

from quad_description.rotations import Vector

from ..exceptions import NoAnswerError
from ..link import Driver, LinkOptions, LinkState
from ..report import Report

if TYPE_CHECKING:
    from types import TracebackType

    from typing_extensions import Self

SAMPLES = 15  # reports that one reading is the median of
MAX_REPORTS = 6000  # reports between two readings, the newest; two minutes
REPORT_TIMEOUT = 4.0  # [s] for a robot to report


@dataclass(frozen=True, slots=True)
class ImuReading:
    """What the IMU reports."""

    attitude: Vector  # roll, pitch, yaw [deg]
    acceleration: Vector | None  # specific force [m/s²]; None where it is not reported
    # what was reported since the reading before, while the robot was moved
    on_the_way: Sequence[Report] = ()


class LimpRobot:
    """Reads angles, takes torque away and gives it back."""

    def __init__(self, options: LinkOptions, motors: Collection[int]) -> None:
        """Look for the robot; use it in a with statement.

        Args:
            motors: Ids of those that it has; a board may refuse a command for any other.
        """
        self._motors = frozenset(motors)
        self._recent: deque[Mapping[int, float]] = deque(maxlen=SAMPLES)
        self._imu: deque[Report] = deque(maxlen=MAX_REPORTS)
        self._changed = threading.Condition()
        self._driver = Driver(options, self._take, self._forget)

    def angles(self) -> dict[int, float]:
        """Return the servo angles [deg] by motor, as they are from now on.

        Raises:
            NoAnswerError: The robot does not report; the message has the reason.
        """
        with self._changed:
            self._recent.clear()
            if not self._changed.wait_for(lambda: len(self._recent) == SAMPLES, REPORT_TIMEOUT):
                raise NoAnswerError(self._driver.status().detail)
            motors = set[int].intersection(*(set(angles) for angles in self._recent))
            return {m: median(angles[m] for angles in self._recent) for m in sorted(motors)}

    def imu(self) -> ImuReading:
        """Return what the IMU reports from now on, as a mean.

        Raises:
            NoAnswerError: The robot does not report, or no number; the message has the reason.
        """
        with self._changed:
            way = tuple(self._imu)
            self._imu.clear()
            if not self._changed.wait_for(lambda: len(self._imu) >= SAMPLES, REPORT_TIMEOUT):
                raise NoAnswerError(self._driver.status().detail)
            states = list(self._imu)
        roll, pitch, yaw = map(_mean_angle, zip(*(s.attitude for s in states), strict=True))
        if not all(map(math.isfinite, (roll, pitch, yaw))):
            raise NoAnswerError('the IMU reports no number; switch the robot off and on')
        forces = [state.acceleration for state in states if state.acceleration is not None]
        if not forces:
            return ImuReading((roll, pitch, yaw), None, way)
        x, y, z = map(fmean, zip(*forces, strict=True))
        return ImuReading((roll, pitch, yaw), (x, y, z), way)

    @contextmanager
    def limp(self) -> Iterator[None]:
        """Take torque away, and give it back at the end, where the servos are then.

        Raises:
            NoAnswerError: The robot does not report; the message has the reason.
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

    def _take(self, state: Report) -> str:
        with self._changed:
            self._imu.append(state)
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
            self._imu.clear()

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


def _mean_angle(degrees: Iterable[float]) -> float:
    """Return the mean of angles [deg] that may be on both sides of 180."""
    angles = [math.radians(angle) for angle in degrees]
    sines, cosines = map(math.sin, angles), map(math.cos, angles)
    return math.degrees(math.atan2(fmean(sines), fmean(cosines)))
