# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""State of a quadruped as its sensors measure it: SI units, frames of REP 103 and 145."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math

from .rotations import (
    down_in_body,
    normalized,
    Quaternion,
    roll_pitch_yaw,
    tilt_of,
    Vector,
)

NORM_TOLERANCE = 0.1  # of a quaternion's length; beyond it the message is no orientation
MAX_DEVIATION = 0.35  # [rad] of an orientation that may be acted upon


@dataclass(frozen=True, slots=True)
class JointSample:
    """Joints as they were measured, in the order of :attr:`.Quadruped.names`.

    Attributes:
        positions: In [rad] or [m].
        velocities: In [rad/s] or [m/s]; None when they are not measured.
        time: When they were measured, on the clock of the back end in [s].
        unmeasured: Places of the joints that no sensor measures; their positions are those that
            were commanded last.
    """

    positions: tuple[float, ...]
    velocities: tuple[float, ...] | None
    time: float = 0.0
    unmeasured: tuple[int, ...] = ()

    def measured(self, names: Sequence[str]) -> dict[str, float]:
        """Return the positions that are measured, by joint.

        Args:
            names: Joints of the robot.
        """
        positions = zip(names, self.positions, strict=True)
        return {name: p for i, (name, p) in enumerate(positions) if i not in self.unmeasured}

    def problem(self, count: int) -> str:
        """Return what is wrong with it, nothing when it can be used.

        Args:
            count: How many joints there are.
        """
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
    """The body's attitude and motion, in the body's frame.

    Attributes:
        orientation: Unit quaternion of the body in the world, x, y, z, w.
        angular_velocity: In [rad/s]; None when it is not measured.
        acceleration: Specific force in [m/s^2]: +9.81 along z at rest (REP 145); None when it is
            not measured.
        deviation: Standard deviation of roll or pitch, the larger one, in [rad]; 0 when it is not
            known. A heading is only held against itself, so that of yaw does not matter.
        rate_differentiated: The angular velocity is the orientation's derivative, not a gyro's.
    """

    orientation: Quaternion
    angular_velocity: Vector | None
    acceleration: Vector | None
    deviation: float = 0.0
    rate_differentiated: bool = False

    @property
    def is_uncertain(self) -> bool:
        """Whether not even the signs of the orientation are sure; a wrong one is fed back."""
        return self.deviation > MAX_DEVIATION

    def problem(self) -> str:
        """Return what is wrong with it, nothing when it can be used."""
        parts = (*self.orientation, *(self.angular_velocity or ()), *(self.acceleration or ()))
        if not all(map(math.isfinite, parts)):
            return 'imu values that are not finite'
        if abs(math.hypot(*self.orientation) - 1.0) > NORM_TOLERANCE:
            return 'an imu orientation that is not a unit quaternion'
        return ''

    @property
    def down(self) -> Vector:
        """Direction of gravity in the body's frame; (0, 0, -1) upright."""
        return down_in_body(normalized(self.orientation))

    @property
    def roll_pitch_yaw(self) -> Vector:
        """Rotations about fixed axes x, y, z in [rad]."""
        return roll_pitch_yaw(normalized(self.orientation))

    @property
    def tilt(self) -> float:
        """Angle between the body's z axis and up in [rad]."""
        return tilt_of(normalized(self.orientation))


@dataclass(frozen=True, slots=True)
class RobotState:
    """State of a robot, as far as it is new; what every back end observes.

    Attributes:
        joints: The newest joint states, None when there were none.
        imu: The newest attitude, None when there was none or the IMU is of no use.
        battery: Charge 0 to 1, None while it is unknown.
        position: Of base_link in the world in [m]; None where the back end does not know it.
        linear_velocity: Of base_link in its own frame in [m/s]; None where nobody estimates it.
        foot_contacts: Which feet are on the ground, in the order of :data:`.FEET`; None where
            nobody estimates it.
        time: When it was measured, on the clock of the back end in [s]; the joints may have been
            measured before.
    """

    joints: JointSample | None = None
    imu: ImuSample | None = None
    battery: float | None = None
    position: Vector | None = None
    linear_velocity: Vector | None = None
    foot_contacts: tuple[bool, ...] | None = None
    time: float = 0.0
