# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How the IMU is mounted, from how a person tilts the robot: compared with gravity."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from enum import Enum
import itertools
import math

from ..estimation.gravity import STANDARD_GRAVITY
from ..estimation.imu_mounting import ImuMounting
from ..estimation.rotation import conjugate, from_roll_pitch_yaw, rotate, Vector, yaw_of
from ..exceptions import CommandError
from .console import Console
from .robot import HandheldRobot, ImuReading

MIN_TILT = math.radians(8.0)  # [rad] that tells a direction from a hand that shakes
MIN_TURN = math.radians(20.0)  # [rad]
MAX_OFF = math.radians(35.0)  # [rad] of a direction in which a person tilts
MAX_LEVEL_TILT = math.radians(20.0)  # [rad]
MAX_DISAGREEMENT = math.radians(15.0)  # [rad] between attitude and accelerometer
GRAVITY_TOLERANCE = 2.0  # [m/s²] of an accelerometer at rest


class Stance(Enum):
    """How the robot is held; the value is what the person is asked to do."""

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

_SIGNS: tuple[Vector, ...] = tuple(
    (x, y, z) for x, y, z in itertools.product((1.0, -1.0), repeat=3)
)
_ROTATIONS = tuple(
    from_roll_pitch_yaw(roll, 0.0, quarter * math.pi / 2)
    for roll in (0.0, math.pi)
    for quarter in (0, 1, 2, 3)
)
"""An IMU lies on its board, the right way up or upside down, along an edge of the body."""


def calibrate_imu(console: Console, robot: HandheldRobot) -> ImuMounting:
    """Have a person tilt the robot, and return how the IMU is mounted.

    Raises:
        CommandError: What was reported fits no mounting; says in which stance.
    """
    readings = {}
    for stance in Stance:
        console.ask(f'{stance.value}. Enter')
        readings[stance] = robot.imu()
    return find_mounting(readings)


def find_mounting(readings: Readings) -> ImuMounting:
    """Return the mounting that fits how the robot was held, with as few signs as can be.

    Raises:
        CommandError: None fits; the message says what does not.
    """
    _check_gravity(readings)
    fitting = [mounting for mounting in _candidates() if not _misfit(mounting, readings)]
    if not fitting:
        raise CommandError(
            'no mounting of the IMU fits what it reported: '
            f'{_misfit(ImuMounting(), readings)}; hold the robot as it is asked, and try again'
        )
    return min(fitting, key=_flips)


def _candidates() -> Iterator[ImuMounting]:
    for rotation in _ROTATIONS:
        for signs, felt in itertools.product(_SIGNS, repeat=2):
            yield ImuMounting(rotation, signs, felt, checked=True)


def _flips(mounting: ImuMounting) -> tuple[int, float]:
    """Order mountings: a rotation is likelier than signs, and none likelier than one."""
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
    """Say what of the readings does not fit a mounting; nothing when all do."""
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
        if (off := _angle(by_attitude[stance], force)) > MAX_DISAGREEMENT:
            return (
                f'{stance.name.lower()}: attitude and accelerometer disagree by '
                f'{math.degrees(off):.0f} degrees'
            )
    return ''


def _wrong_tilt(up: Mapping[Stance, Vector]) -> str:
    """Say which stance is not as it was asked for, by the direction of up in the body."""
    level = up[Stance.LEVEL]
    if (tilt := _angle(level, (0.0, 0.0, 1.0))) > MAX_LEVEL_TILT:
        return f'level: tilted by {math.degrees(tilt):.0f} degrees'
    for stance, (x, y) in TILTS.items():
        dx, dy = up[stance][0] - level[0], up[stance][1] - level[1]
        if math.hypot(dx, dy) < math.sin(MIN_TILT):
            return f'{stance.name.lower()}: hardly tilted'
        off = abs(math.atan2(dy * x - dx * y, dx * x + dy * y))
        if off > MAX_OFF:
            return f'{stance.name.lower()}: tilted {math.degrees(off):.0f} degrees another way'
    return ''


def _angle(one: Vector, other: Vector) -> float:
    cosine = sum(a * b for a, b in zip(one, other, strict=True))
    return math.acos(min(max(cosine / (math.hypot(*one) * math.hypot(*other)), -1.0), 1.0))
