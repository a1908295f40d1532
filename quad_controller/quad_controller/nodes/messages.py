# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""ROS messages to and from the controller's values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Pose, Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import BatteryState, Imu
from std_msgs.msg import Header

from quad_description import FEET, ImuSample
from quad_description.rotations import normalized, roll_pitch_yaw, Vector
from quad_msgs.msg import FootContacts, JointCommand

from ..gait.body import BodyPose
from ..gait.velocity import Velocity

UNMEASURED = -1.0  # first covariance of what an IMU does not measure (sensor_msgs/Imu, REP 145)


_VARIANCES = 0, 4, 8  # of roll, pitch and yaw in a covariance

IMU_NUMBERS = tuple(
    f'{part}.{axis}'
    for part, axes in (
        ('orientation', 'xyzw'),
        ('angular_velocity', 'xyz'),
        ('linear_acceleration', 'xyz'),
    )
    for axis in axes
)
"""What :func:`imu_sample` reads of a message."""


def imu_sample(message: Imu, numbers: Sequence[float]) -> ImuSample:
    """Return the attitude of a message; imu_link has the axes of base_link.

    Args:
        message: What was measured, but for its numbers.
        numbers: As :data:`IMU_NUMBERS` names them.

    Raises:
        ValueError: The orientation is not measured, or a variance of it is none.
    """
    covariance = message.orientation_covariance
    if covariance[0] == UNMEASURED:
        raise ValueError(
            'the imu has no orientation (orientation_covariance[0] is -1), which walking needs; '
            'filter it, or set require_imu to false'
        )
    for index in _VARIANCES:
        if not covariance[index] >= 0.0:  # neither is NaN
            raise ValueError(
                f'imu: orientation_covariance[{index}] is not a variance: {covariance[index]:g}; '
                'publish 0 or more, all zeros where it is unknown (REP 145)'
            )
    x, y, z, w, *rest = numbers
    (rx, ry, rz), (fx, fy, fz) = rest[:3], rest[3:]
    return ImuSample(
        (x, y, z, w),
        None if message.angular_velocity_covariance[0] == UNMEASURED else (rx, ry, rz),
        None if message.linear_acceleration_covariance[0] == UNMEASURED else (fx, fy, fz),
        math.sqrt(max(covariance[0], covariance[4])),
    )


def charge(message: BatteryState) -> float | None:
    """Return the charge 0 to 1, None when it is not known."""
    return float(message.percentage) if math.isfinite(message.percentage) else None


def linear_velocity(message: Odometry) -> Vector:
    """Return the velocity of the body in its own frame [m/s]."""
    linear = message.twist.twist.linear
    return linear.x, linear.y, linear.z


def foot_contacts(message: FootContacts) -> tuple[bool, ...]:
    """Return which feet are on the ground, in the order of :data:`quad_description.FEET`.

    Raises:
        ValueError: A foot is missing.
    """
    seen = dict(zip(message.name, message.contact, strict=False))
    if missing := [foot for foot in FEET if foot not in seen]:
        raise ValueError(f'foot_contacts: no contact of {", ".join(missing)}; publish all feet')
    return tuple(bool(seen[foot]) for foot in FEET)


def velocity(message: Twist) -> Velocity:
    """Return the parts of a velocity that a quadruped follows."""
    return Velocity(message.linear.x, message.linear.y, message.angular.z)


def body_pose(message: Pose) -> BodyPose:
    """Return the pose of the body relative to its normal one; all zeros are no rotation."""
    place, turn = message.position, message.orientation
    rotation = turn.x, turn.y, turn.z, turn.w
    if not any(rotation):
        return BodyPose(place.x, place.y, place.z)
    return BodyPose(place.x, place.y, place.z, *roll_pitch_yaw(normalized(rotation)))


@dataclass(frozen=True, slots=True)
class JointCommands:
    """Targets of joints."""

    count: int  # how many joints

    def message(self, stamp: Time, numbers: Sequence[float]) -> JointCommand:
        """Make a message of targets [rad]."""
        return JointCommand(header=Header(stamp=stamp), position=numbers)
