# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A robot whose servos are read while someone moves them by hand, or while they are commanded."""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
import math
from statistics import fmean, median
import threading
import time

from quad_description.rotations import from_rpy, normalized, roll_pitch_yaw, Vector

from ..exceptions import NoAnswerError
from ..link import Driver, LinkOptions, LinkState, Session
from ..protocol import Span
from ..report import Report

SAMPLES = 15  # reports that one reading is the median of
MAX_REPORTS = 6000  # reports between two readings, the newest; two minutes
SEND_TIMEOUT = 2.0  # [s] for a command to leave
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
        self._motors = frozenset(motors)
        self._reports: deque[Report] = deque(maxlen=MAX_REPORTS)  # since the reading before
        self._changed = threading.Condition()
        self._spans: Mapping[int, Span] = {}
        self.driver = Driver(options, self._take, self._forget, self._opened)

    def angles(self) -> dict[int, float]:
        """Return the servo angles [deg] by motor, as they are from now on.

        Raises:
            NoAnswerError: The robot does not report; the message has the reason.
        """
        _, reports = self._read()
        found = {
            motor: [report.positions.get(motor, math.nan) for report in reports]
            for motor in sorted(self._motors)
        }
        return {m: median(each) for m, each in found.items() if all(map(math.isfinite, each))}

    def imu(self) -> ImuReading:
        """Return what the IMU reports from now on, as a mean.

        Raises:
            NoAnswerError: The robot does not report, or no number; the message has the reason.
        """
        way, reports = self._read()
        if not all(map(math.isfinite, (angle for r in reports for angle in r.attitude))):
            raise NoAnswerError('the IMU reports no number; switch the robot off and on')
        attitude = mean_attitude(r.attitude for r in reports)
        forces = [each.acceleration for each in reports if each.acceleration is not None]
        if not forces:
            return ImuReading(attitude, None, way)
        x, y, z = map(fmean, zip(*forces, strict=True))
        return ImuReading(attitude, (x, y, z), way)

    def reports(self) -> tuple[Report, ...]:
        """Return the reports since the reading before, MAX_REPORTS at most."""
        with self._changed:
            reports = tuple(self._reports)
            self._reports.clear()
            return reports

    def command(self, angles: Mapping[int, float]) -> float:
        """Command angles [deg] by motor; return when they had left the line [s].

        Raises:
            NoAnswerError: They were not sent; the message has the reason.
        """
        begun = time.monotonic()
        if self.driver.command(angles):
            while time.monotonic() < begun + SEND_TIMEOUT:
                if self.driver.commanded_at >= begun:
                    return self.driver.commanded_at
                time.sleep(0.001)
        raise NoAnswerError(self.driver.status().detail)

    def rounded(self, motor: int, angle: float) -> float:
        """Return an angle [deg] as the line brings it to a motor."""
        span = self._spans.get(motor)
        return angle if span is None else span.decode(span.encode(angle))

    def now(self) -> float:
        """Return the time on the clock of reports and commands [s]."""
        return time.monotonic()

    def wait_until(self, moment: float) -> None:
        """Wait for a moment on that clock [s]."""
        time.sleep(max(moment - time.monotonic(), 0.0))

    @contextmanager
    def limp(self) -> Iterator[None]:
        """Switch the torque off, and on again at the end, where the servos are then.

        Raises:
            NoAnswerError: The robot does not report; the message has the reason.
        """
        if not self.driver.torque(on=False):
            raise NoAnswerError(self.driver.status().detail)
        self.angles()  # by then it has gone out
        try:
            yield
        finally:
            self.driver.command(self.angles())  # a servo that wakes goes to its last target
            self.driver.torque(on=True)
            self.angles()

    def _read(self) -> tuple[Sequence[Report], Sequence[Report]]:
        """Return the reports since the reading before, and new ones."""
        with self._changed:
            way = tuple(self._reports)
            self._reports.clear()
            if not self._changed.wait_for(lambda: len(self._reports) >= SAMPLES, REPORT_TIMEOUT):
                raise NoAnswerError(self.driver.status().detail)
            return way, tuple(self._reports)

    def _opened(self, session: Session) -> None:
        self._spans = session.dialect.spans

    def _take(self, report: Report) -> str:
        with self._changed:
            self._reports.append(report)
            self._changed.notify_all()
        return ''

    def _forget(self, _state: LinkState, _detail: str) -> None:
        with self._changed:
            self._reports.clear()


@contextmanager
def limp_robot(options: LinkOptions, motors: Collection[int]) -> Iterator[LimpRobot]:
    """Find a robot, and leave it in the end.

    Args:
        motors: Ids of those that it has; a board may refuse a command for any other.

    Raises:
        NoAnswerError: It is not found; the message has the reason.
    """
    robot = LimpRobot(options, motors)
    robot.driver.start()
    try:
        robot.angles()
        yield robot
    finally:
        robot.driver.stop()


def mean_attitude(attitudes: Iterable[Vector]) -> Vector:
    """Return the mean of roll, pitch and yaw [deg]; not of each, they leap with the nose up."""
    rotations = [from_rpy(*map(math.radians, attitude)) for attitude in attitudes]
    first, sums = rotations[0], [0.0] * 4
    for rotation in rotations:  # a quaternion and its negative are one rotation
        sign = math.copysign(1.0, sum(a * b for a, b in zip(first, rotation, strict=True)))
        sums = [total + sign * part for total, part in zip(sums, rotation, strict=True)]
    x, y, z, w = sums
    roll, pitch, yaw = map(math.degrees, roll_pitch_yaw(normalized((x, y, z, w))))
    return roll, pitch, yaw
