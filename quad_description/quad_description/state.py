# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Measured state of a quadruped, and the back end that provides it.

SI units, frames of REP 103 and 145.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
import math
from typing import TYPE_CHECKING

from .rotations import (
    about_z,
    conjugate,
    down_in_body,
    multiply,
    normalized,
    Quaternion,
    roll_pitch_yaw,
    rotate,
    tilt_of,
    Vector,
    yaw_of,
)

if TYPE_CHECKING:
    from typing_extensions import Self

MAX_TILT = 0.9  # [rad] beyond which the legs find no ground
LOW_BATTERY, EMPTY_BATTERY = 0.2, 0.1  # charge below which it is to be charged, and useless
NORM_TOLERANCE = 0.1  # of a quaternion's length; beyond it the message is no orientation
MAX_DEVIATION = 0.35  # [rad] of an orientation that may be acted upon


@dataclass(frozen=True, slots=True)
class JointSample:
    """Measured joints, in the order of :attr:`.Quadruped.names`."""

    positions: tuple[float, ...]  # in [rad] or [m]
    velocities: tuple[float, ...] | None  # in [rad/s] or [m/s]; None when they are not measured
    time: float = 0.0  # when they were measured, on the clock of the back end in [s]
    # places of the joints that no sensor measures; their positions are those that were commanded
    # last
    unmeasured: tuple[int, ...] = ()
    # of velocities that were differentiated, rms in [rad/s]; 0 for those that the robot reports
    velocity_error: float = 0.0

    def measured(self, names: Sequence[str]) -> dict[str, float]:
        """Return the measured positions by joint."""
        positions = zip(names, self.positions, strict=True)
        return {name: p for i, (name, p) in enumerate(positions) if i not in self.unmeasured}

    def problem(self, count: int) -> str:
        """Return why the sample is unusable; empty if it is usable."""
        for what, values in (('positions', self.positions), ('velocities', self.velocities)):
            if values is None:
                continue
            if len(values) != count:
                return f'{len(values)} joint {what} instead of {count}'
            if not all(map(math.isfinite, values)):
                return f'joint {what} that are not finite'
        return ''


@dataclass(frozen=True, slots=True)
class ImuSample:
    """Attitude and motion of the body, in the body's frame."""

    orientation: Quaternion  # unit quaternion of the body in the world, x, y, z, w
    angular_velocity: Vector | None  # in [rad/s]; None when it is not measured
    # specific force in [m/s^2]: +9.81 along z at rest (REP 145); None when it is not measured
    acceleration: Vector | None
    # Standard deviation of roll or pitch, the larger one, in [rad]; 0 when it is not known. A
    # heading is only held against itself, so that of yaw does not matter.
    deviation: float = 0.0
    # the angular velocity is the orientation's derivative, not a gyro's
    rate_differentiated: bool = False

    @property
    def is_uncertain(self) -> bool:
        """Whether even the signs of the orientation are unsure; a wrong sign destabilizes."""
        return self.deviation > MAX_DEVIATION

    def problem(self) -> str:
        """Return why the sample is unusable; empty if it is usable."""
        parts = (*self.orientation, *(self.angular_velocity or ()), *(self.acceleration or ()))
        if not all(map(math.isfinite, parts)):
            return 'imu values that are not finite'
        if abs(math.hypot(*self.orientation) - 1.0) > NORM_TOLERANCE:
            return 'an imu orientation that is not a unit quaternion'
        return ''

    @property
    def down(self) -> Vector:
        """Unit vector of gravity in the body's frame; (0, 0, -1) when upright."""
        return down_in_body(normalized(self.orientation))

    @property
    def roll_pitch_yaw(self) -> Vector:
        """Rotations about fixed axes x, y, z in [rad]."""
        return roll_pitch_yaw(normalized(self.orientation))

    @property
    def tilt(self) -> float:
        """Angle between the body's z axis and the vertical in [rad]."""
        return tilt_of(normalized(self.orientation))


@dataclass(frozen=True, slots=True)
class OdometryState:
    """Pose and velocity of the body relative to its start."""

    x: float  # position of base_link [m]
    y: float  # position of base_link [m]
    height: float  # of base_link above the ground [m]
    rotation: Quaternion  # from base_link to odom, (x, y, z, w); it began with yaw zero
    velocity_x: float  # forward, in base_link turned level [m/s]
    velocity_y: float  # to the left, in base_link turned level [m/s]
    distance: float  # way so far [m]
    # feet that are taken to stand, in the order of :data:`.FEET`
    standing: tuple[bool, ...]
    position_variance: float = 0.0  # of x and y [m²]; grows with the way and with each gap
    yaw_variance: float = 0.0  # [rad²]; grows with time

    @property
    def velocity_in_base(self) -> Vector:
        """Velocity over the ground in base_link [m/s]."""
        level = multiply(about_z(-yaw_of(self.rotation)), self.rotation)
        return rotate(conjugate(level), (self.velocity_x, self.velocity_y, 0.0))


@dataclass(frozen=True, slots=True)
class RobotState:
    """State of a robot, as observed by any back end; unknown or outdated parts are None."""

    joints: JointSample | None = None  # the newest joint states, None when there were none
    # the newest attitude, None when there was none or the IMU is of no use
    imu: ImuSample | None = None
    battery: float | None = None  # charge 0 to 1, None while it is unknown
    # of base_link in the world in [m]; None where the back end does not know it
    position: Vector | None = None
    # of base_link in its own frame in [m/s]; None where it is not estimated
    linear_velocity: Vector | None = None
    # which feet are on the ground, in the order of :data:`.FEET`; None where it is not estimated
    foot_contacts: tuple[bool, ...] | None = None
    # when it was measured, on the clock of the back end in [s]; the joints may have been measured
    # before
    time: float = 0.0
    # way over the ground by the legs; None without an attitude, and where it is not estimated
    odometry: OdometryState | None = None
    imu_problem: str = ''  # why the IMU is of no use; empty while it works
    voltage: float | None = None  # of the battery in [V]; None where it is not reported
    faults: int = 0  # bits that the board reports
    # why the servos may carry it no longer; empty while they may, None where it is unknown
    servo_problem: str | None = None
    # of the servos in [°C], by motor id; empty where they are not reported
    temperatures: Mapping[int, float] = field(default_factory=dict)
    joints_age: float = 0.0  # how old the joint states were when they came in [s]
    imu_age: float = 0.0  # how old the attitude was when it came in [s]


class Backend(ABC):
    """Interface of a robot: takes joint targets, returns states, period by period."""

    names: tuple[str, ...]  # joints in the order of states and targets
    period: float  # time that a step takes in [s]

    @abstractmethod
    def reset(self) -> RobotState:
        """Restart and return the first state."""

    @abstractmethod
    def step(self, targets: Sequence[float] | None) -> RobotState:
        """Send targets in [rad], or None; return the state one period later."""

    @abstractmethod
    def observe(self) -> RobotState:
        """Return the present state without advancing time."""

    @abstractmethod
    def close(self) -> None:
        """Release all resources; call nothing else afterwards."""

    def __enter__(self) -> Self:
        """Return the back end."""
        return self

    def __exit__(self, *_error: object) -> None:
        """Close the back end."""
        self.close()
