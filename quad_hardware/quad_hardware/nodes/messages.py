# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The state of the robot as ROS messages (REP 103, 105, 145).

What is published with every report comes as a template, which makes the message, and as the
numbers that change from one message to the next.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math
from typing import ClassVar

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, Quaternion, Transform, TransformStamped, Vector3
from nav_msgs.msg import Odometry
from sensor_msgs.msg import BatteryState, Imu, JointState
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from quad_description import FEET, ImuSample, JointSample
from quad_description.rotations import about_z, conjugate, multiply, rotate, yaw_of
from quad_description.rotations import Quaternion as Rotation
from quad_msgs.msg import FootContacts

from ..estimation import Battery, OdometryState
from .parameters import Deviations, Frames

NOT_THERE = [-1.0, *([0.0] * 8)]  # covariance of what is not measured (REP 145)
UNUSED = 1e6  # variance of what nobody measures
VELOCITY_VARIANCE = 0.03**2  # [m²/s²]
HEIGHT_VARIANCE = 0.01**2  # [m²]

Numbers = Sequence[float]


@dataclass(frozen=True, slots=True)
class JointStates:
    """All joints that are reported, in the order of the URDF; efforts are not known."""

    names: tuple[str, ...]  # of the joints

    @property
    def count(self) -> int:
        """How many numbers a message takes."""
        return 2 * len(self.names)

    def message(self, stamp: Time, numbers: Numbers) -> JointState:
        """Make a message of positions, and velocities behind them."""
        joints = len(self.names)
        return JointState(
            header=Header(stamp=stamp),
            name=list(self.names),
            position=numbers[:joints],
            velocity=numbers[joints:],
        )


def joint_states_template(names: tuple[str, ...], joints: JointSample) -> JointStates:
    """Return the template for the joints that are measured, of all joints by name."""
    return JointStates(tuple(joints.measured(names)) if joints.unmeasured else names)


def joint_numbers(joints: JointSample) -> Numbers:
    """Return what :class:`JointStates` takes."""
    velocities = joints.velocities or ()
    if not joints.unmeasured:
        return (*joints.positions, *velocities)
    return [
        number
        for numbers in (joints.positions, velocities)
        for place, number in enumerate(numbers)
        if place not in joints.unmeasured
    ]


@dataclass(frozen=True, slots=True)
class ImuTemplate:
    """Attitude, angular velocity and specific force."""

    frame: str  # in which they are
    orientation: float  # its standard deviation [rad]
    acceleration: float | None  # its standard deviation [m/s²]; None where it is not measured
    rate: float | None  # its standard deviation [rad/s]; None where it is not published
    count: ClassVar[int] = 10

    def message(self, stamp: Time, numbers: Numbers) -> Imu:
        """Make a message of a rotation (x, y, z, w), a rate and an acceleration."""
        message = Imu(header=Header(stamp=stamp, frame_id=self.frame))
        message.orientation = _quaternion(numbers[:4])
        message.orientation_covariance = _diagonal3(self.orientation)
        message.angular_velocity = _vector(numbers[4:7])
        message.angular_velocity_covariance = _diagonal3(self.rate)
        message.linear_acceleration = _vector(numbers[7:])
        message.linear_acceleration_covariance = _diagonal3(self.acceleration)
        return message


def imu_template(imu: ImuSample, deviations: Deviations, frame: str) -> ImuTemplate:
    """Return the template for what a sample holds."""
    return ImuTemplate(
        frame,
        max(deviations.orientation, imu.deviation),
        None if imu.acceleration is None else deviations.acceleration,
        _rate_deviation(imu, deviations),
    )


def imu_numbers(imu: ImuSample) -> Numbers:
    """Return what :class:`ImuTemplate` takes; zeros for what is not measured."""
    return (*imu.orientation, *(imu.angular_velocity or _ZERO), *(imu.acceleration or _ZERO))


@dataclass(frozen=True, slots=True)
class OdometryTemplate:
    """The pose in odom and the velocity in base_link (or in the footprint)."""

    frame: str  # in which the pose is
    child: str  # in which the velocity is
    tilt: float  # standard deviation of the rotation [rad]
    rate: float | None  # that of the angular velocity [rad/s]; None where it is not published
    count: ClassVar[int] = 14

    def message(self, stamp: Time, numbers: Numbers) -> Odometry:
        """Make a message: place, rotation, velocity, rate, and the variance of x and y [m²]."""
        message = Odometry(header=Header(stamp=stamp, frame_id=self.frame))
        message.child_frame_id = self.child
        x, y, z = numbers[:3]
        message.pose.pose.position = Point(x=x, y=y, z=z)
        message.pose.pose.orientation = _quaternion(numbers[3:7])
        place, tilt = numbers[13], self.tilt**2
        message.pose.covariance = _diagonal6((place, place, HEIGHT_VARIANCE, tilt, tilt, tilt))
        message.twist.twist.linear = _vector(numbers[7:10])
        message.twist.twist.angular = _vector(numbers[10:13])
        rate = UNUSED if self.rate is None else self.rate**2
        message.twist.covariance = _diagonal6(
            (VELOCITY_VARIANCE, VELOCITY_VARIANCE, UNUSED, rate, rate, rate)
        )
        return message


def odometry_template(imu: ImuSample, deviations: Deviations, frames: Frames) -> OdometryTemplate:
    """Return the template for what a sample holds."""
    child = frames.footprint if frames.footprint_is_parent else frames.base
    tilt = max(deviations.orientation, imu.deviation)
    return OdometryTemplate(frames.odom, child, tilt, _rate_deviation(imu, deviations))


def odometry_numbers(imu: ImuSample, state: OdometryState, frames: Frames) -> Numbers:
    """Return what :class:`OdometryTemplate` takes."""
    rotation, height = state.rotation, state.height
    rate = imu.angular_velocity or _ZERO  # in the body
    if frames.footprint_is_parent:
        velocity = (state.velocity_x, state.velocity_y, 0.0)  # over the ground, level
        rate = rotate(_level(rotation), rate)
        rotation, height = about_z(yaw_of(rotation)), 0.0
    else:
        velocity = state.velocity_in_base
    return (state.x, state.y, height, *rotation, *velocity, *rate, state.position_variance)


@dataclass(frozen=True, slots=True)
class FootContactsTemplate:
    """Which feet are taken to stand; one template for each combination."""

    contacts: tuple[bool, ...]  # whether each does, in the order of the legs
    source: str  # how that is known
    count: ClassVar[int] = 0

    def message(self, stamp: Time, _numbers: Numbers) -> FootContacts:
        """Make a message."""
        return FootContacts(
            header=Header(stamp=stamp),
            name=list(FEET),
            contact=list(self.contacts),
            source=self.source,
        )


def foot_contacts_template(state: OdometryState) -> FootContactsTemplate:
    """Return the template for the feet that stand."""
    return FootContactsTemplate(state.standing, state.contact_source.value)


@dataclass(frozen=True, slots=True)
class TransformsTemplate:
    """odom to base_link and base_link to base_footprint, or the other way round."""

    frames: tuple[str, str, str]  # from one to the next
    count: ClassVar[int] = 14

    def message(self, stamp: Time, numbers: Numbers) -> TFMessage:
        """Make a message: place and rotation (x, y, z, w) of the first, and of the second."""
        odom, first, second = self.frames
        return TFMessage(
            transforms=[
                _transform(odom, first, numbers[:7], stamp),
                _transform(first, second, numbers[7:], stamp),
            ]
        )


def transforms_template(frames: Frames) -> TransformsTemplate:
    """Return the template for names and order of frames."""
    if frames.footprint_is_parent:
        return TransformsTemplate((frames.odom, frames.footprint, frames.base))
    return TransformsTemplate((frames.odom, frames.base, frames.footprint))


def transforms_numbers(state: OdometryState, frames: Frames) -> Numbers:
    """Return what :class:`TransformsTemplate` takes."""
    tilt = _level(state.rotation)
    if frames.footprint_is_parent:
        heading = about_z(yaw_of(state.rotation))
        return (state.x, state.y, 0.0, *heading, 0.0, 0.0, state.height, *tilt)
    upright = conjugate(tilt)
    below = rotate(upright, (0.0, 0.0, -state.height))
    return (state.x, state.y, state.height, *state.rotation, *below, *upright)


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


_ZERO = (0.0, 0.0, 0.0)


def _rate_deviation(imu: ImuSample, deviations: Deviations) -> float | None:
    if imu.angular_velocity is None:
        return None
    return deviations.rate if imu.rate_differentiated else deviations.gyro


def _level(rotation: Rotation) -> Rotation:
    """Return roll and pitch of a rotation, without its yaw."""
    return multiply(about_z(-yaw_of(rotation)), rotation)


def _transform(parent: str, child: str, pose: Numbers, stamp: Time) -> TransformStamped:
    return TransformStamped(
        header=Header(stamp=stamp, frame_id=parent),
        child_frame_id=child,
        transform=Transform(translation=_vector(pose[:3]), rotation=_quaternion(pose[3:])),
    )


def _quaternion(numbers: Numbers) -> Quaternion:
    x, y, z, w = numbers
    return Quaternion(x=x, y=y, z=z, w=w)


def _vector(numbers: Numbers) -> Vector3:
    x, y, z = numbers
    return Vector3(x=x, y=y, z=z)


def _diagonal3(deviation: float | None) -> list[float]:
    if deviation is None:
        return NOT_THERE
    variance = deviation**2
    return [variance, 0.0, 0.0, 0.0, variance, 0.0, 0.0, 0.0, variance]


def _diagonal6(variances: Numbers) -> list[float]:
    covariance = [0.0] * 36
    covariance[::7] = variances
    return covariance
