# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""ROS messages to and from the controller's values."""

from __future__ import annotations

from collections.abc import Sequence
import math

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Pose, Twist
from sensor_msgs.msg import BatteryState, Imu, JointState
from std_msgs.msg import Header

from quad_msgs.msg import JointCommand

from ..gait.body import BodyPose
from ..gait.velocity import Velocity
from ..states.measurement import ImuSample, JointSample


class JointReader:
    """Puts the joints of a message into the robot's order.

    The order of a message seldom changes, so the permutation is kept until it does.
    """

    def __init__(self, names: Sequence[str]) -> None:
        """Read for the joints of a robot, in its order."""
        self._names = tuple(names)
        self._seen: list[str] | None = None
        self._places: list[int] = []

    def read(self, message: JointState) -> JointSample:
        """Return the joints of a message.

        Raises:
            ValueError: A joint is missing, or there are not as many positions as names.
        """
        if message.name != self._seen:
            self._find(list(message.name))
        if len(message.position) != len(message.name):
            raise ValueError(
                f'joint states: {len(message.position)} positions for {len(message.name)} names'
            )
        position, velocity = message.position, message.velocity
        known = len(velocity) == len(position)
        return JointSample(
            tuple(position[place] for place in self._places),
            tuple(velocity[place] for place in self._places) if known else None,
        )

    def _find(self, names: list[str]) -> None:
        missing = [name for name in self._names if name not in names]
        if missing:
            self._seen = None
            raise ValueError(
                f'joint states without {", ".join(missing)}; does the hardware node use the same '
                'robot description?'
            )
        self._places = [names.index(name) for name in self._names]
        self._seen = names


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
