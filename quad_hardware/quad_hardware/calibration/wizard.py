# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A robot with released servos that a person moves by hand, and the joint dialogue."""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
import math
from statistics import fmean, median
import threading
import time

from quad_description.rotations import from_rpy, normalized, roll_pitch_yaw, Vector

from ..exceptions import CommandError, NoAnswerError
from ..joints import JointServo
from ..link import Driver, LinkOptions, LinkState, Session, STALE_TIME
from ..protocol import Span
from ..report import Report

SAMPLES = 15  # reports that one reading is the median of
MAX_REPORTS = 6000  # reports between two readings, the newest; two minutes
SEND_TIMEOUT = 2.0  # [s] for a command to leave
REPORT_TIMEOUT = 4.0  # [s] for a robot to report
REPORTS_BROKE_OFF = f'reports had not arrived for {STALE_TIME} s; they do again'


@dataclass(frozen=True, slots=True)
class ImuReading:
    """Measurements of the IMU."""

    attitude: Vector  # roll, pitch, yaw [deg]
    acceleration: Vector | None  # specific force [m/s²]; None where it is not reported
    # what was reported since the reading before, while the robot was moved
    on_the_way: Sequence[Report] = ()


class LimpRobot:
    """Reads servo angles, and switches torque off and on."""

    def __init__(self, options: LinkOptions, motors: Collection[int]) -> None:
        self._motors = frozenset(motors)
        self._reports: deque[Report] = deque(maxlen=MAX_REPORTS)  # since the reading before
        self._changed = threading.Condition()
        self._spans: Mapping[int, Span] = {}
        self.driver = Driver(options, self._take, self._forget, self._opened)

    def angles(self) -> dict[int, float]:
        """Wait for new reports; return the servo angles [deg] by motor.

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
        """Return the mean of new IMU reports.

        Raises:
            NoAnswerError: The robot does not report, or reports NaN; the message has the reason.
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

    def reports(self) -> Sequence[Report]:
        """Return the reports since the previous call, MAX_REPORTS at most."""
        with self._changed:
            reports = tuple(self._reports)
            self._reports.clear()
            return reports

    def command(self, angles: Mapping[int, float]) -> float:
        """Command angles [deg] by motor; return the time when they had left the line [s].

        Raises:
            NoAnswerError: The angles were not sent; the message has the reason.
        """
        begun = time.monotonic()
        if not self.driver.command(angles):
            raise self._no_answer(REPORTS_BROKE_OFF)
        while time.monotonic() < begun + SEND_TIMEOUT:
            if self.driver.commanded_at >= begun:
                return self.driver.commanded_at
            time.sleep(0.001)
        raise self._no_answer(f'a command did not leave within {SEND_TIMEOUT} s')

    def rounded(self, motor: int, angle: float) -> float:
        """Return an angle [deg] as rounded on the line to a motor."""
        span = self._spans.get(motor)
        return angle if span is None else span.decode(span.encode(angle))

    def now(self) -> float:
        """Return the time on the clock of reports and commands [s]."""
        return time.monotonic()

    def wait_until(self, moment: float) -> None:
        """Wait until a time on that clock [s]."""
        time.sleep(max(moment - time.monotonic(), 0.0))

    @contextmanager
    def limp(self) -> Iterator[None]:
        """Switch torque off; at the end, switch it on at the present angles.

        Raises:
            NoAnswerError: The robot does not report; the message has the reason.
        """
        if not self.driver.torque(on=False):
            raise self._no_answer(REPORTS_BROKE_OFF)
        self.angles()  # by then it has gone out
        try:
            yield
        finally:
            self.driver.command(self.angles())  # a servo that wakes goes to its last target
            self.driver.torque(on=True)
            self.angles()

    def _read(self) -> tuple[Sequence[Report], Sequence[Report]]:
        """Return the reports since the previous call, and wait for new ones."""
        with self._changed:
            way = tuple(self._reports)
            self._reports.clear()
            if not self._changed.wait_for(lambda: len(self._reports) >= SAMPLES, REPORT_TIMEOUT):
                raise self._no_answer(f'no {SAMPLES} reports within {REPORT_TIMEOUT} s')
            return way, tuple(self._reports)

    def _no_answer(self, otherwise: str) -> NoAnswerError:
        return NoAnswerError(self.driver.status().reason(otherwise))

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
    """Connect to a robot, and disconnect at the end.

    Args:
        motors: Ids of the robot's motors; a board may reject commands for others.

    Raises:
        NoAnswerError: No robot is found; the message has the reason.
    """
    robot = LimpRobot(options, motors)
    robot.driver.start()
    try:
        robot.angles()
        yield robot
    finally:
        robot.driver.stop()


def mean_attitude(attitudes: Iterable[Vector]) -> Vector:
    """Return the mean rotation as roll, pitch, yaw [deg]: means of each fail with the nose up."""
    rotations = [from_rpy(*map(math.radians, attitude)) for attitude in attitudes]
    first, sums = rotations[0], [0.0] * 4
    for rotation in rotations:  # a quaternion and its negative are one rotation
        sign = math.copysign(1.0, sum(a * b for a, b in zip(first, rotation, strict=True)))
        sums = [total + sign * part for total, part in zip(sums, rotation, strict=True)]
    x, y, z, w = sums
    roll, pitch, yaw = map(math.degrees, roll_pitch_yaw(normalized((x, y, z, w))))
    return roll, pitch, yaw


class CancelledError(Exception):
    """The user cancelled; nothing is written."""


class Console:
    """A user at a terminal."""

    def write(self, text: str) -> None:
        """Print a text."""
        print(text, flush=True)  # noqa: T201  # what the program is for

    def prompt(self, question: str) -> str:
        """Prompt the user; return the answer.

        Raises:
            CancelledError: Ctrl-C or Ctrl-D was pressed.
        """
        try:
            return input(f'{question} ').strip()
        except (EOFError, KeyboardInterrupt):
            raise CancelledError('cancelled; nothing was written') from None


def confirm(console: Console, question: str, *, default: bool = False) -> bool:
    """Ask a yes-or-no question; return the answer."""
    choices = '[Y/n]' if default else '[y/N]'
    answer = console.prompt(f'{question} {choices}').lower()
    return answer.startswith('y') if answer else default


def prompt_number(console: Console, question: str) -> float:
    """Prompt for a positive number until the user enters one."""
    while True:
        answer = console.prompt(question)
        try:
            number = float(answer.replace(',', '.'))
        except ValueError:
            number = 0.0
        if 0.0 < number < float('inf'):
            return number
        console.write(f'{answer!r} is not a positive number; for example 0.95')


MIN_TURN = 8.0  # [deg] that distinguishes a direction from a shaking hand
LIMIT_MARGIN = math.radians(2.0)  # [rad] that targets stay away from a stop


def with_zero(servo: JointServo, angle: float) -> JointServo:
    """Set the offset so that the joint is at zero at a servo angle [deg]."""
    return replace(servo, offset=-servo.sign * servo.gain * angle)


def with_direction(servo: JointServo, zero: float, turned: float) -> JointServo:
    """Set the sign so that motion from one angle to another [deg] is positive.

    Raises:
        CommandError: The servo turned by less than MIN_TURN.
    """
    if abs(turned - zero) < MIN_TURN:
        raise CommandError(
            f'{servo.joint}: motor {servo.motor} turned by {turned - zero:.1f} degrees; at least '
            f'{MIN_TURN:.0f} are needed. Is this the right joint?'
        )
    sign = 1 if turned > zero else -1
    return with_zero(replace(servo, sign=sign), zero)


def with_limits(servo: JointServo, one: float, other: float) -> JointServo:
    """Reduce the limits to two measured ends of travel [deg].

    Raises:
        CommandError: The ends are so close that no range is left.
    """
    low, high = sorted((servo.position(one), servo.position(other)))
    lower = max(low + LIMIT_MARGIN, servo.lower)
    upper = min(high - LIMIT_MARGIN, servo.upper)
    if lower >= upper:
        raise CommandError(
            f'{servo.joint}: nothing is left between {low:.2f} and {high:.2f} rad within its '
            f'limits {servo.lower:.2f} to {servo.upper:.2f}'
        )
    return replace(servo, lower=lower, upper=upper)


def moved_motor(before: dict[int, float], after: dict[int, float]) -> int | None:
    """Return the motor that turned farthest; None if none turned enough."""
    turns = {motor: abs(after[motor] - before[motor]) for motor in after if motor in before}
    motor = max(turns, key=turns.__getitem__, default=None)
    return motor if motor is not None and turns[motor] >= MIN_TURN else None


# what zero and the positive direction look like (quad_description)
_PLACES = {
    'hip': ('the leg hangs straight down, seen from the front', 'move the foot inward'),
    'thigh': ('the upper leg hangs straight down, seen from the side', 'move the knee backward'),
    'calf': (
        'the lower leg points forward, 72 degrees from straight down',
        'move the foot backward and up',
    ),
    'yaw': ('the arm points forward', 'turn it to the left'),
}
_ARM_PLACE = ('the joint is where the URDF draws it at zero', 'turn it the way of the URDF')


def calibrate_joints(
    console: Console, robot: LimpRobot, servos: Iterable[JointServo], *, limits: bool
) -> list[JointServo]:
    """Measure zero, direction and, if requested, both ends of each joint.

    Args:
        limits: Measure the ends of travel as well.

    Returns:
        The servos with the measured values.
    """
    return [_calibrate(console, robot, servo, limits=limits) for servo in servos]


def _calibrate(
    console: Console, robot: LimpRobot, servo: JointServo, *, limits: bool
) -> JointServo:
    zero_place, direction = place_of(servo.joint)
    while True:
        console.write(f'\n{servo.joint} (motor {servo.motor})')
        answer = console.prompt(f'  hold it at zero: {zero_place}. Enter; s skips it')
        if answer.lower() == 's':
            return servo
        try:
            before = robot.angles()
            console.prompt(f'  now {direction}, and hold it there. Enter')
            after = robot.angles()
            found = _found(console, servo, before, after)
            if limits:
                found = _ends(console, robot, found)
        except CommandError as error:
            console.write(f'  {error}')
            continue
        console.write(
            f'  motor {found.motor}, sign {found.sign:+d}, offset {found.offset:+.3f} rad, '
            f'{found.lower:+.2f} to {found.upper:+.2f} rad'
        )
        if confirm(console, '  keep it?', default=True):
            return found


def _found(
    console: Console, servo: JointServo, before: dict[int, float], after: dict[int, float]
) -> JointServo:
    moved = moved_motor(before, after)
    if moved is not None and moved != servo.motor:
        turned = math.fabs(after[moved] - before[moved])
        question = f'  motor {moved} turned by {turned:.0f} degrees, not {servo.motor}; take it?'
        if confirm(console, question):
            servo = replace(servo, motor=moved)
    if servo.motor not in before or servo.motor not in after:
        raise CommandError(f'motor {servo.motor} does not report its angle; skip this joint')
    return with_direction(servo, before[servo.motor], after[servo.motor])


def _ends(console: Console, robot: LimpRobot, servo: JointServo) -> JointServo:
    console.prompt('  move it to one end of its travel. Enter')
    one = robot.angles()[servo.motor]
    console.prompt('  move it to the other end. Enter')
    return with_limits(servo, one, robot.angles()[servo.motor])


def place_of(joint: str) -> tuple[str, str]:
    """Describe a joint's zero position, and its positive direction."""
    if joint.startswith('arm') and 'yaw' not in joint:
        return _ARM_PLACE
    return next((place for word, place in _PLACES.items() if word in joint), _ARM_PLACE)
