# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Determines the IMU mounting from gravity while the user tilts the robot.

The gyro signs follow from the motion between the stances: it has to agree with the attitude.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from enum import Enum
import itertools
import math

from quad_description.rotations import (
    angle_between,
    conjugate,
    from_rpy,
    multiply,
    rotate,
    rotation_vector,
    Vector,
    yaw_of,
)

from ..estimation import ImuMounting
from ..exceptions import CommandError
from ..filters import STANDARD_GRAVITY
from ..report import Report
from .wizard import Console, ImuReading, LimpRobot

MIN_TILT = math.radians(8.0)  # [rad] that distinguishes a direction from a shaking hand
MIN_TURN = math.radians(20.0)  # [rad]
MAX_OFF = math.radians(35.0)  # [rad] of a direction in which a person tilts
MAX_LEVEL_TILT = math.radians(20.0)  # [rad]
MAX_DISAGREEMENT = math.radians(15.0)  # [rad] between attitude and accelerometer
TURN_WINDOW = 10  # reports over which turns are compared; their noise would count otherwise
MAX_GAP = 0.2  # [s] between two reports; over more it is unknown how the gyro turned
MIN_TURNED = math.radians(3.0)  # [rad] root of the squares of the turns about an axis
GYRO_RATIOS = (0.4, 2.5)  # of the turn of the attitude, that the gyro has to report
GRAVITY_TOLERANCE = 2.0  # [m/s²] of an accelerometer at rest


class Stance(Enum):
    """Pose in which to hold the robot; the value is the instruction to the user."""

    LEVEL = 'put the robot level, on its feet or its belly'
    NOSE_DOWN = 'lift its tail, so that the nose points down by about 20 degrees, and hold it'
    RIGHT_DOWN = 'level again, then lift its left side by about 20 degrees, and hold it'
    TURNED_LEFT = 'put it level, turned to its left by about 45 degrees from where it was'


Readings = Mapping[Stance, ImuReading]

TILTS: Mapping[Stance, tuple[float, float]] = {
    Stance.NOSE_DOWN: (-1.0, 0.0),
    Stance.RIGHT_DOWN: (0.0, 1.0),
}
"""Which way up goes in the body, along x and y."""

AXES = (0, 'x'), (1, 'y'), (2, 'z')
_SIGNS: tuple[Vector, ...] = tuple(
    (x, y, z) for x, y, z in itertools.product((1.0, -1.0), repeat=3)
)
_ROTATIONS = tuple(
    from_rpy(roll, 0.0, quarter * math.pi / 2)
    for roll in (0.0, math.pi)
    for quarter in (0, 1, 2, 3)
)
"""An IMU lies on its board, the right way up or upside down, along an edge of the body."""


def calibrate_imu(console: Console, robot: LimpRobot) -> ImuMounting:
    """Guide the user in tilting the robot; return the IMU mounting.

    Raises:
        CommandError: No mounting fits the reports; the message names the stance.
    """
    readings = {}
    for stance in Stance:
        console.prompt(f'{stance.value}. Enter')
        readings[stance] = robot.imu()
    return find_mounting(readings)


def find_mounting(readings: Readings) -> ImuMounting:
    """Return the mounting that fits all stances with the fewest sign changes.

    Raises:
        CommandError: No mounting fits; the message names the misfit.
    """
    _check_gravity(readings)
    fitting = [mounting for mounting in _candidates() if not _misfit(mounting, readings)]
    if not fitting:
        raise CommandError(
            'no mounting of the IMU fits what it reported: '
            f'{_misfit(ImuMounting(), readings)}; hold the robot as described, and try again'
        )
    return with_gyro(min(fitting, key=_flips), readings)


def with_gyro(mounting: ImuMounting, readings: Readings) -> ImuMounting:
    """Add gyro signs to a mounting, from the rotations between stances.

    Without gyro reports, the mounting is unchanged.

    Raises:
        CommandError: The gyro does not turn with the attitude; the message names the axis.
    """
    reports = [[s for s in reading.on_the_way if s.rates] for reading in readings.values()]
    if not any(reports):
        return mounting
    turns = [turn for states in reports for turn in _turns(mounting, states)]
    x, y, z = (_gyro_sign(axis, [(by[i], to[i]) for by, to in turns]) for i, axis in AXES)
    return replace(mounting, rate_signs=(x, y, z), rates_checked=True)


def _turns(mounting: ImuMounting, states: Sequence[Report]) -> Iterator[tuple[Vector, Vector]]:
    """Return the rotations of gyro and attitude in time windows, about the IMU's axes [rad]."""
    for begin in range(0, len(states) - TURN_WINDOW, TURN_WINDOW):
        window = states[begin : begin + TURN_WINDOW + 1]
        steps = [(b.arrival - a.arrival, b.rates) for a, b in itertools.pairwise(window)]
        if max(elapsed for elapsed, _ in steps) > MAX_GAP:
            continue
        first, last = (mounting.attitude(state.attitude) for state in (window[0], window[-1]))
        turned = rotation_vector(multiply(conjugate(first), last))
        x, y, z = (
            math.radians(sum(elapsed * rates[i] for elapsed, rates in steps if rates))
            for i, _ in AXES
        )
        yield (x, y, z), rotate(conjugate(mounting.rotation), turned)


def _gyro_sign(axis: str, turns: Iterable[tuple[float, float]]) -> float:
    """Return the gyro's sign about an axis, from rotations of gyro and attitude [rad]."""
    pairs = list(turns)
    turned = sum(attitude**2 for _, attitude in pairs)
    if turned < MIN_TURNED**2:
        raise CommandError(
            f'gyro: the robot was hardly turned about {axis} of the IMU while it reported; '
            'turn it quicker from one stance to the next'
        )
    share = sum(gyro * attitude for gyro, attitude in pairs) / turned
    if not GYRO_RATIOS[0] <= abs(share) <= GYRO_RATIOS[1]:
        raise CommandError(
            f'gyro: turned about {axis} of the IMU, it reports {share:.2f} times the turn of the '
            'attitude; hold the robot by its body, and try again'
        )
    return math.copysign(1.0, share)


def _candidates() -> Iterator[ImuMounting]:
    for rotation in _ROTATIONS:
        for signs, felt in itertools.product(_SIGNS, repeat=2):
            yield ImuMounting(rotation, signs, felt, checked=True)


def _flips(mounting: ImuMounting) -> tuple[int, float]:
    """Rank mountings: no change before a rotation, a rotation before signs."""
    signs = (*mounting.attitude_signs, *mounting.acceleration_signs)
    return signs.count(-1.0), -abs(mounting.rotation[3])


def _check_gravity(readings: Readings) -> None:
    for stance, reading in readings.items():
        if reading.acceleration is None:
            continue
        length = math.hypot(*reading.acceleration)
        if abs(length - STANDARD_GRAVITY) > GRAVITY_TOLERANCE:
            raise CommandError(
                f'{stance.name.lower()}: the accelerometer reads {length:.1f} m/s² instead of '
                f'{STANDARD_GRAVITY:.1f}; hold the robot still'
            )


def _misfit(mounting: ImuMounting, readings: Readings) -> str:
    """Return why the readings do not fit a mounting; empty if they do."""
    by_attitude = {
        stance: rotate(conjugate(mounting.attitude(reading.attitude)), (0.0, 0.0, 1.0))
        for stance, reading in readings.items()
    }
    if reason := _wrong_tilt(by_attitude):
        return f'by its attitude, {reason}'
    level, turned = (
        yaw_of(mounting.attitude(readings[stance].attitude))
        for stance in (Stance.LEVEL, Stance.TURNED_LEFT)
    )
    turn = math.remainder(turned - level, math.tau)
    if turn < MIN_TURN:
        return f'the yaw went by {math.degrees(turn):.0f} degrees to the left'
    by_force = {
        stance: mounting.acceleration(reading.acceleration)
        for stance, reading in readings.items()
        if reading.acceleration is not None
    }
    for stance, force in by_force.items():
        if (off := angle_between(by_attitude[stance], force)) > MAX_DISAGREEMENT:
            return (
                f'{stance.name.lower()}: attitude and accelerometer disagree by '
                f'{math.degrees(off):.0f} degrees'
            )
    return ''


def _wrong_tilt(up: Mapping[Stance, Vector]) -> str:
    """Return the stance that was held wrongly, by the direction of up in the body."""
    level = up[Stance.LEVEL]
    if (tilt := angle_between(level, (0.0, 0.0, 1.0))) > MAX_LEVEL_TILT:
        return f'level: tilted by {math.degrees(tilt):.0f} degrees'
    for stance, (x, y) in TILTS.items():
        dx, dy = up[stance][0] - level[0], up[stance][1] - level[1]
        if math.hypot(dx, dy) < math.sin(MIN_TILT):
            return f'{stance.name.lower()}: hardly tilted'
        off = abs(math.atan2(dy * x - dx * y, dx * x + dy * y))
        if off > MAX_OFF:
            return f'{stance.name.lower()}: tilted {math.degrees(off):.0f} degrees another way'
    return ''
