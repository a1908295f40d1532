# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""ROS messages to and from the controller's values."""

from __future__ import annotations

from collections.abc import Sequence
import math

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Pose, Twist
from sensor_msgs.msg import BatteryState, Imu
from std_msgs.msg import Header

from quad_msgs.msg import JointCommand

from ..gait.body import BodyPose
from ..gait.velocity import Velocity
from ..states.measurement import ImuSample

UNMEASURED = -1.0  # first covariance of what an IMU does not measure (sensor_msgs/Imu, REP 145)


def imu_sample(message: Imu) -> ImuSample:
    """Return the attitude of a message; imu_link has the axes of base_link.

    Raises:
        ValueError: The orientation is not measured.
    """
    if message.orientation_covariance[0] == UNMEASURED:
        raise ValueError(
            'the imu has no orientation (orientation_covariance[0] is -1), which walking needs; '
            'filter it, or set require_imu to false'
        )
    attitude, rate, force = (
        message.orientation,
        message.angular_velocity,
        message.linear_acceleration,
    )
    return ImuSample(
        (attitude.x, attitude.y, attitude.z, attitude.w),
        None if message.angular_velocity_covariance[0] == UNMEASURED else (rate.x, rate.y, rate.z),
        # no force at all is no gravity, so nobody believes it
        (0.0, 0.0, 0.0)
        if message.linear_acceleration_covariance[0] == UNMEASURED
        else (force.x, force.y, force.z),
    )


def charge(message: BatteryState) -> float | None:
    """Return the charge 0 to 1, None when it is not known."""
    return float(message.percentage) if math.isfinite(message.percentage) else None


def velocity(message: Twist) -> Velocity:
    """Return the parts of a velocity that a quadruped follows."""
    return Velocity(message.linear.x, message.linear.y, message.angular.z)


def body_pose(message: Pose) -> BodyPose:
    """Return the pose of the body relative to its normal one; all zeros are no rotation."""
    place, turn = message.position, message.orientation
    x, y, z, w = turn.x, turn.y, turn.z, turn.w
    norm = math.sqrt(x * x + y * y + z * z + w * w)
    if norm == 0.0:
        return BodyPose(place.x, place.y, place.z)
    x, y, z, w = x / norm, y / norm, z / norm, w / norm
    return BodyPose(
        place.x,
        place.y,
        place.z,
        math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
        math.asin(min(max(2 * (w * y - z * x), -1.0), 1.0)),
        math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
    )


def joint_command(targets: Sequence[float], stamp: Time) -> JointCommand:
    """Return the targets of all joints."""
    return JointCommand(header=Header(stamp=stamp), position=targets)
