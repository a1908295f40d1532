# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Reports of a robot, in any protocol and in wire units, and checks of their plausibility.

An eight-bit checksum passes one damaged frame in 256, so this module checks reports: joints and
IMU, jumps, the board's clock (mapped to ours; restarts of the board), and whether servos released
after torque off.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from enum import Enum
import math
from typing import Generic, TypeVar

from quad_description.rotations import conjugate, from_rpy, multiply, rotation_vector, Vector

from .joints import SERVO_REACH
from .protocol import Fault

DEVICE_TIME_WRAP = 2**32 / 1000.0  # [s]


@dataclass(frozen=True, slots=True)
class Report:
    """One report, with angles by motor id in wire units."""

    arrival: float  # when its last byte came, on the monotonic clock [s]
    wire_time: float  # how long its bytes were on the line [s]
    # roll, pitch, yaw of the body about fixed axes x, y, z [deg]; of a dead IMU, anything
    attitude: Vector
    # specific force x, y, z [m/s²]; +9.8 upwards at rest; None where it is not reported
    acceleration: Vector | None
    # servo angles by motor id [deg]; of a motor that is not fitted, anything
    positions: Mapping[int, float]
    # servo velocities by motor id [deg/s], likewise; empty where they are not reported
    velocities: Mapping[int, float]
    # angular velocity x, y, z of the body [deg/s]; None where there is no gyro
    rates: Vector | None = None
    battery: float | None = None  # charge [%]; None while unknown
    voltage: float | None = None  # voltage of the battery [V]; None where it is not reported
    # when it was made, on the clock of the robot [s], which wraps at :data:`DEVICE_TIME_WRAP`;
    # None where it is not reported
    device_time: float | None = None
    faults: int = 0  # fault bits of protocol v2
    # of the servos by motor id [°C]; empty where they are not reported
    temperatures: Mapping[int, float] | None = None
    # of the servos by motor id, share of their stall torque [%]; empty where not reported
    loads: Mapping[int, float] | None = None
    joints_age: float = 0.0  # by how much the angles were measured before the rest [s]


DRIFT = 1e-4  # share by which the robot's clock may be off
RESTART = 1.0  # [s] a difference beyond that is a robot that began anew
LATE = 0.1  # [s] a report that is later than others by that may be right, and they wrong
LATE_TIMEOUT = 0.5  # [s] for which all reports are late, until they are believed
MAX_RUN_LAG = 1.0  # [s] by which reports of one run of the board come late, or after each other
BOOT_TIME = 0.5  # [s] without a report is no shorter while the board boots


class SampleClock:
    """Maps the robot's clock to ours by the report with the least delay.

    No report arrives before it was made, so the smallest clock difference is the best estimate;
    it may grow slowly, because clocks drift. If all later reports are late for a while, the
    fastest one was damaged and is dropped. Reports without a clock get their arrival time minus
    half the time on the line.
    """

    def __init__(self) -> None:
        self._offset = math.inf
        self._device = 0.0
        self._wraps = 0
        self._late_since = math.inf

    def time(self, state: Report) -> float:
        """Return when a report was made [s], on the clock of the arrival times."""
        begun = state.arrival - state.wire_time
        if state.device_time is None:
            return state.arrival - state.wire_time / 2
        if self._device - state.device_time > DEVICE_TIME_WRAP / 2:
            self._wraps += 1
        elapsed, self._device = state.device_time - self._device, state.device_time
        device = state.device_time + self._wraps * DEVICE_TIME_WRAP
        offset = begun - device
        if abs(offset - self._offset) > RESTART or self._is_long_late(offset, begun):
            self._offset = offset
        self._offset = min(self._offset + max(elapsed, 0.0) * DRIFT, offset)
        return device + self._offset

    def _is_long_late(self, offset: float, begun: float) -> bool:
        if offset - self._offset <= LATE:
            self._late_since = math.inf
            return False
        self._late_since = min(self._late_since, begun)
        return begun - self._late_since > LATE_TIMEOUT


class BoardWatch:
    """Detects restarts of the board, after which its yaw has a new zero.

    It compares each report with the previous one. If the board reports its clock, the clock shows
    a restart. Otherwise each silence long enough for a restart counts as one: no command was sent
    meanwhile, so the robot did not walk.
    """

    def __init__(self) -> None:
        self._last: Report | None = None

    def restarted(self, state: Report) -> bool:
        """Add a report; return whether the board has, or may have, restarted before it."""
        last, self._last = self._last, state
        if last is None:
            return False
        gap = state.arrival - last.arrival
        if last.device_time is None or state.device_time is None:
            return gap > BOOT_TIME
        passed = math.remainder(state.device_time - last.device_time, DEVICE_TIME_WRAP)
        return abs(passed - gap) > MAX_RUN_LAG or passed < 0.0 < gap - BOOT_TIME


MAX_SPEED = 3000.0  # [deg/s] of a servo
MAX_ACCELERATION = 200.0  # [m/s²]
MAX_JUMP = 60.0  # [deg] between reports; a servo does 12 degrees in 20 ms
MAX_LAG = 0.1  # [s] between the robot's clock and ours from one report to the next
JUMP_TIME = 0.1  # [s] after which anything may have happened
NOT_FINITE = 'a number is not finite'
MAX_REFUSALS = 2  # doubtful reports in a row that are refused, before they are believed


class Plausibility:
    """Checks the plausibility of reports from a robot with the given motors.

    A jump or an implausible IMU value may be a damaged frame; if it persists, it is accepted.
    Implausible joints are never accepted.
    """

    def __init__(self, motors: Collection[int]) -> None:
        """Start without reports; motors that no joint uses are ignored."""
        self._motors = tuple(motors)
        self._last: Report | None = None
        self._refused = 0
        # why attitude and acceleration of the last report that could be are of no use; empty while
        # the IMU works
        self.imu_problem = ''

    def check(self, state: Report) -> str:
        """Return why a report is implausible; empty if it is plausible."""
        if reason := self._joint_problem(state):
            return reason
        imu, last = _imu_problem(state), self._last
        doubt = '' if self.imu_problem else imu
        if not doubt and last is not None and state.arrival - last.arrival < JUMP_TIME:
            doubt = self._jump(last, state, attitude=not (imu or self.imu_problem))
        if doubt and self._refused < MAX_REFUSALS:
            self._refused += 1
            return doubt
        self._refused = 0
        self._last, self.imu_problem = state, imu
        return ''

    def _joint_problem(self, state: Report) -> str:
        for name, values, most in (
            ('deg', state.positions, SERVO_REACH),
            ('deg/s', state.velocities, MAX_SPEED),
        ):
            for motor in self._motors:
                value = values.get(motor, 0.0)
                if not abs(value) <= most:
                    finite = math.isfinite(value)
                    return f'motor {motor} at {value:.4g} {name}' if finite else NOT_FINITE
        return ''

    def _jump(self, last: Report, state: Report, *, attitude: bool) -> str:
        for motor in self._motors:
            angle = state.positions.get(motor)
            if angle is None:
                continue
            if abs(angle - last.positions.get(motor, angle)) > MAX_JUMP:
                return f'motor {motor} jumped to {angle:.4g} deg'
        if attitude and (turned := _turned(last.attitude, state.attitude)) > MAX_JUMP:
            return f'attitude jumped by {turned:.4g} deg'
        if last.device_time is not None and state.device_time is not None:
            passed = math.remainder(state.device_time - last.device_time, DEVICE_TIME_WRAP)
            if abs(passed - (state.arrival - last.arrival)) > MAX_LAG:
                return f'the clock of the robot went on by {passed:.3f} s'
        return ''


def _turned(before: Vector, now: Vector) -> float:
    """Return the angle of the rotation between two attitudes [deg].

    Roll and yaw alone do not show it: near a vertical nose, each may jump while the sum stays.
    """
    one, other = (from_rpy(*map(math.radians, attitude)) for attitude in (before, now))
    return math.degrees(math.hypot(*rotation_vector(multiply(conjugate(one), other))))


def _imu_problem(state: Report) -> str:
    felt = state.acceleration or (0.0, 0.0, 0.0)
    if not all(map(math.isfinite, (*state.attitude, *felt, *(state.rates or ())))):
        return f'imu: {NOT_FINITE}'
    if math.hypot(*felt) > MAX_ACCELERATION:
        return f'imu: acceleration {felt} m/s²'
    if max(map(abs, state.attitude)) > 360.0:
        return f'imu: attitude {state.attitude} deg'
    return ''


FAULT_TEXTS: Mapping[Fault, str] = {
    Fault.LOW_BATTERY: 'low battery: charge it',
    Fault.OVERLOAD: 'overload: free its legs, or let it lie down',
    Fault.OVERHEATED: 'overheated: let it lie down and cool',
    Fault.SERVO_SILENT: 'servo silent: look at the cable of the leg that hangs limp',
    Fault.IMU: 'IMU: its attitude is not to be trusted, switch the robot off and on',
}
"""What a fault of protocol v2 is called, and what to do."""

CONFIRMATIONS = 3  # reports in a row; one damaged frame in 256 passes its checksum
MAX_TEMPERATURE = 70.0  # [°C] at which these servos switch themselves off, by their maker
COOL_TEMPERATURE = 60.0  # [°C] below which they may carry the robot again
_SERVO_FAULTS = Fault.OVERLOAD | Fault.OVERHEATED | Fault.SERVO_SILENT


Problem = TypeVar('Problem')
_Problem = tuple[Fault, int | None]  # what is wrong, and with which motor where that is known


class Confirmed(Generic[Problem]):
    """Confirms problems seen in :data:`CONFIRMATIONS` consecutive reports.

    As many reports without it end a problem. Problems are counted independently of each other.
    """

    def __init__(self) -> None:
        self.problems: set[Problem] = set()
        # reports in a row that say otherwise than what is confirmed
        self._doubts: dict[Problem, int] = {}

    def take(self, seen: set[Problem]) -> set[Problem]:
        """Add the problems of a report; return the confirmed ones."""
        doubted = seen ^ self.problems
        self._doubts = {problem: self._doubts.get(problem, 0) + 1 for problem in doubted}
        changed = {each for each in doubted if self._doubts[each] >= CONFIRMATIONS}
        self.problems = self.problems ^ changed
        self._doubts = {each: n for each, n in self._doubts.items() if each not in changed}
        return self.problems


class ServoWatch:
    """Detects servos that can no longer carry the robot: silent, overloaded or too hot."""

    def __init__(self, motors: Collection[int]) -> None:
        """Start without reports; the motors are those that a joint uses."""
        self._motors, self._confirmed = motors, Confirmed[_Problem]()

    def check(self, state: Report) -> str:
        """Add a report; return the problems confirmed by several consecutive reports."""
        found = self._confirmed.take(self._read(state))
        texts = [FAULT_TEXTS[each] for each in Fault if (each, None) in found]
        hot = [motor for motor in self._motors if (Fault.OVERHEATED, motor) in found]
        if hot:
            texts.append(
                f'servo of motor {", ".join(map(str, hot))} above {MAX_TEMPERATURE:g} degrees: '
                f'let it cool below {COOL_TEMPERATURE:g}'
            )
        return '; '.join(texts)

    def _read(self, state: Report) -> set[_Problem]:
        bits, felt = Fault(state.faults & _SERVO_FAULTS), state.temperatures or {}
        problems: set[_Problem] = {(each, None) for each in Fault if each in bits}
        for motor in self._motors:
            hot = (Fault.OVERHEATED, motor)
            most = COOL_TEMPERATURE if hot in self._confirmed.problems else MAX_TEMPERATURE
            if felt.get(motor, 0.0) > most:
                problems.add(hot)
        return problems


TIMEOUT = 0.5  # [s] for servos to let go, and for a report that shows it
NO_LOAD = 1.0  # [%] of the stall torque
# [s] from torque off to a report that was made later: an adapter holds bytes for 16 ms either way
DELAY = 0.04


class TorqueOffResult(Enum):
    """Result of a torque-off request."""

    LIMP = 'the servos are without torque'
    PULLS = 'torque off was sent, and the servos still report load: keep clear, switch it off'
    UNKNOWN = (
        'torque off was sent, and not all servos report since then whether they let go: '
        'keep clear, switch it off'
    )
    UNSENT = 'torque off may not have been sent: keep clear, switch it off'
    NOT_REPORTED = 'torque off was sent; this protocol reports no load that would confirm it'

    @property
    def succeeded(self) -> bool:
        """Whether no report contradicts success."""
        return self in {TorqueOffResult.LIMP, TorqueOffResult.NOT_REPORTED}


def check_torque_off(
    report: Report | None,
    motors: Collection[int],
    asked_at: float,
    sent_at: float | None,
    now: float,
) -> TorqueOffResult | None:
    """Return the result of torque off; None while a later report may decide it.

    Args:
        report: Newest plausible report; None without one.
        motors: Ids of the motors that have to release.
        asked_at: Time of the request [s], on the clock of the arrival times.
        sent_at: Time when it was sent [s]; None before.
        now: Present time [s].
    """
    found = TorqueOffResult.UNSENT if sent_at is None else TorqueOffResult.UNKNOWN
    if sent_at is not None and report is not None and _made_at(report) >= sent_at + DELAY:
        if not report.loads:
            return TorqueOffResult.NOT_REPORTED
        known = [abs(report.loads[motor]) for motor in motors if motor in report.loads]
        if max(known, default=0.0) > NO_LOAD:
            found = TorqueOffResult.PULLS
        elif len(known) == len(motors):
            return TorqueOffResult.LIMP
    return found if now - asked_at >= TIMEOUT else None


def _made_at(report: Report) -> float:
    """Return the latest time when a report was made [s], if no adapter delayed it."""
    return report.arrival - report.wire_time
