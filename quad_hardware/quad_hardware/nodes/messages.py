# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Estimates as ROS messages (REP 103, 105, 145)."""

from __future__ import annotations

from collections.abc import Sequence
import math

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, Quaternion, Transform, TransformStamped, Vector3
from nav_msgs.msg import Odometry
from sensor_msgs.msg import BatteryState, Imu, JointState
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from ..estimation import Battery, Estimate
from ..estimation.rotation import about_z, conjugate, multiply, rotate, yaw_of
from ..estimation.rotation import Quaternion as Rotation
from .parameters import Deviations, Frames

NOT_THERE = [-1.0, *([0.0] * 8)]  # covariance of what is not measured (REP 145)
UNUSED = 1e6  # variance of what nobody measures
VELOCITY_VARIANCE = 0.03**2  # [m²/s²]
HEIGHT_VARIANCE = 0.01**2  # [m²]


def joint_state(estimate: Estimate, stamp: Time) -> JointState:
    """Return all joints that are reported, in the order of the URDF; efforts are not known."""
    return JointState(
        header=Header(stamp=stamp),
        name=list(estimate.positions),
        position=list(estimate.positions.values()),
        velocity=[estimate.velocities[name] for name in estimate.positions],
    )


def imu(estimate: Estimate, deviations: Deviations, frame: str, stamp: Time) -> Imu:
    """Return attitude, angular velocity and specific force."""
    message = Imu(header=Header(stamp=stamp, frame_id=frame))
    message.orientation = _quaternion(estimate.attitude)
    message.orientation_covariance = _diagonal3(deviations.orientation)
    if estimate.acceleration is None:
        message.linear_acceleration_covariance = NOT_THERE
    else:
        x, y, z = estimate.acceleration
        message.linear_acceleration = Vector3(x=x, y=y, z=z)
        message.linear_acceleration_covariance = _diagonal3(deviations.acceleration)
    if estimate.angular_velocity is None:
        message.angular_velocity_covariance = NOT_THERE
    else:
        x, y, z = estimate.angular_velocity
        message.angular_velocity = Vector3(x=x, y=y, z=z)
        measured = deviations.gyro if estimate.rate_measured else deviations.rate
        message.angular_velocity_covariance = _diagonal3(measured)
    return message


def odometry(estimate: Estimate, deviations: Deviations, frames: Frames, stamp: Time) -> Odometry:
    """Return the pose in odom and the velocity in base_link (or in the footprint)."""
    state = estimate.odometry
    message = Odometry(header=Header(stamp=stamp, frame_id=frames.odom))
    rotation, height = state.rotation, state.height
    message.child_frame_id = frames.base
    if frames.footprint_is_parent:
        message.child_frame_id = frames.footprint
        rotation, height = about_z(yaw_of(rotation)), 0.0
    message.pose.pose.position = Point(x=state.x, y=state.y, z=height)
    message.pose.pose.orientation = _quaternion(rotation)
    place, tilt = state.position_variance, deviations.orientation**2
    message.pose.covariance = _diagonal6((place, place, HEIGHT_VARIANCE, tilt, tilt, tilt))
    velocity = (state.velocity_x, state.velocity_y, 0.0)
    if not frames.footprint_is_parent:  # the velocity is that over the ground, level
        velocity = rotate(conjugate(_level(rotation)), velocity)
    x, y, z = velocity
    message.twist.twist.linear = Vector3(x=x, y=y, z=z)
    variances = (VELOCITY_VARIANCE, VELOCITY_VARIANCE, UNUSED, UNUSED, UNUSED, UNUSED)
    if estimate.angular_velocity is not None:
        x, y, z = estimate.angular_velocity
        message.twist.twist.angular = Vector3(x=x, y=y, z=z)
        rate = (deviations.gyro if estimate.rate_measured else deviations.rate) ** 2
        variances = (*variances[:3], rate, rate, rate)
    message.twist.covariance = _diagonal6(variances)
    return message


def transforms(estimate: Estimate, frames: Frames, stamp: Time) -> TFMessage:
    """Return odom to base_link and base_link to base_footprint, or the other way round."""
    state = estimate.odometry
    heading = about_z(yaw_of(state.rotation))
    tilt = _level(state.rotation)
    if frames.footprint_is_parent:
        first = _transform(frames.odom, frames.footprint, (state.x, state.y, 0.0), heading, stamp)
        second = _transform(frames.footprint, frames.base, (0.0, 0.0, state.height), tilt, stamp)
    else:
        place = (state.x, state.y, state.height)
        first = _transform(frames.odom, frames.base, place, state.rotation, stamp)
        below = rotate(conjugate(tilt), (0.0, 0.0, -state.height))
        second = _transform(frames.base, frames.footprint, below, conjugate(tilt), stamp)
    return TFMessage(transforms=[first, second])


def battery(state: Battery, stamp: Time) -> BatteryState:
    """Return the charge; what is not reported is NaN, as the message wants it."""
    unknown = math.nan
    return BatteryState(
        header=Header(stamp=stamp),
        voltage=unknown if state.voltage is None else state.voltage,
        temperature=unknown,
        current=unknown,
        charge=unknown,
        capacity=unknown,
        design_capacity=unknown,
        percentage=unknown if state.charge is None else state.charge / 100.0,
        power_supply_status=BatteryState.POWER_SUPPLY_STATUS_UNKNOWN,
        power_supply_health=BatteryState.POWER_SUPPLY_HEALTH_UNKNOWN,
        power_supply_technology=BatteryState.POWER_SUPPLY_TECHNOLOGY_LION,
        present=True,
    )


def _level(rotation: Rotation) -> Rotation:
    """Return roll and pitch of a rotation, without its yaw."""
    return multiply(about_z(-yaw_of(rotation)), rotation)


def _transform(
    parent: str, child: str, place: tuple[float, float, float], rotation: Rotation, stamp: Time
) -> TransformStamped:
    x, y, z = place
    return TransformStamped(
        header=Header(stamp=stamp, frame_id=parent),
        child_frame_id=child,
        transform=Transform(translation=Vector3(x=x, y=y, z=z), rotation=_quaternion(rotation)),
    )


def _quaternion(rotation: Rotation) -> Quaternion:
    x, y, z, w = rotation
    return Quaternion(x=x, y=y, z=z, w=w)


def _diagonal3(deviation: float) -> list[float]:
    variance = deviation**2
    return [variance, 0.0, 0.0, 0.0, variance, 0.0, 0.0, 0.0, variance]


def _diagonal6(variances: Sequence[float]) -> list[float]:
    covariance = [0.0] * 36
    covariance[::7] = variances
    return covariance
