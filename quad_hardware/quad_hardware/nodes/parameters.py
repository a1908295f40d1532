# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters of ``hardware_node``: meaning, ranges, and the settings made from them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path
from typing import Any

from rclpy.node import Node

from node_runner import (
    declare_black_box,
    declare_thread_priority,
    ParameterReader,
    refuse_misspelt,
)
from quad_description import DescriptionError, Joint, movable_joints, PRESETS, robot_urdf
from quad_description.rotations import from_rpy, Vector
from robot_primitives import setting, switch

from ..estimation import EstimatorSettings, ImuMounting, OdometrySettings
from ..exceptions import CommandError
from ..joints import JointMap, JointServo, LimiterSettings, servo_of
from ..link import AUTO, DEFAULT_PORT, LinkOptions, MODEL_CHOICES, PROTOCOL_CHOICES
from ..link.vendor import is_installed, VENDOR
from ..protocol import Protocol, PROTOCOLS
from ..serial_robot import JOINTS_CHECKED, RobotSettings

THREAD_PRIORITY = 50  # SCHED_FIFO: replies of the robot are read and commands sent at once


class FootprintMode(Enum):
    """Place of base_footprint in the frame tree."""

    CHILD = 'child'  # odom, base_link, base_footprint
    PARENT = 'parent'  # odom, base_footprint, base_link


@dataclass(frozen=True, slots=True)
class Frames:
    """Frame names and their tree."""

    odom_frame: str = switch('odom', 'where the robot began')
    base_frame: str = switch('base_link', 'the body')
    footprint_frame: str = switch('base_footprint', 'on the ground below the body')
    imu_frame: str = switch('imu_link', 'the IMU')
    footprint_mode: FootprintMode = switch(  # noqa: RUF009  # a field
        FootprintMode.CHILD,
        'child: odom, base_link, base_footprint; parent: odom, base_footprint, base_link',
    )
    publish_tf: bool = switch(True, 'publish the transforms')


@dataclass(frozen=True, slots=True)
class Deviations:
    """Standard deviations published with the IMU."""

    orientation_stddev: float = setting(0.02, 0.0, 10.0, '[rad]')
    angular_velocity_stddev: float = setting(0.2, 0.0, 10.0, 'differentiated [rad/s]')
    gyro_stddev: float = setting(0.02, 0.0, 10.0, 'of a gyro [rad/s]')
    linear_acceleration_stddev: float = setting(0.3, 0.0, 10.0, '[m/s²]')


@dataclass(frozen=True, slots=True)
class NodeSettings:
    """All parameters."""

    robot: RobotSettings  # which robot it is, and how it is read and commanded
    frames: Frames  # names of the frames
    deviations: Deviations  # published with the IMU
    thread_priority: int  # SCHED_FIFO priority of the thread of its loop; 0 requests none
    diagnostics_period: float = setting(1.0, 0.1, 60.0, 'period [s]')


def declare_parameters(node: Node) -> NodeSettings:
    """Declare all parameters of the node and read them.

    Raises:
        ParameterError: A parameter is misspelt, of the wrong type or out of range.
        CommandError: Parameters do not match the robot; the message names the remedy.
    """
    read = ParameterReader(node)
    protocols = read.choice(
        'protocol',
        AUTO,
        {AUTO: PROTOCOLS, VENDOR.name: (), **PROTOCOL_CHOICES},
        'auto: detected; vendor: through the vendor’s xgo_lib2',
    )
    method = read.text('vendor_servo_method', '', 'of the vendor’s XgoDog, writes one servo angle')
    link = read.settings(
        LinkOptions,
        path=read.text('port', DEFAULT_PORT, 'serial port of the robot'),
        protocols=protocols,
        model=read.choice(
            'model', AUTO, MODEL_CHOICES, 'ranges of bytes (not in v2); auto: by firmware'
        ),
        vendor=_vendor(protocols, method),
        vendor_method=method,
    )
    log = read.text('serial_log', '', 'file that all bytes are written to; empty for none')
    robot = declare_robot(
        read,
        link,
        limiter=read.settings(LimiterSettings),
        black_box=declare_black_box(read),
        joints_checked=read.flag(
            JOINTS_CHECKED,
            default=False,
            meaning='each joint of the legs has moved as its servo says (calibrate first-motion)',
        ),
        serial_log=Path(log).expanduser() if log else None,
    )
    settings = read.settings(
        NodeSettings,
        robot=robot,
        frames=declare_frames(read),
        deviations=read.settings(Deviations),
        thread_priority=declare_thread_priority(read, THREAD_PRIORITY),
    )
    refuse_misspelt(node)
    return settings


def declare_robot(read: ParameterReader, link: LinkOptions, **given: Any) -> RobotSettings:  # noqa: ANN401
    """Declare the parameters of the robot and of reading its reports.

    Raises:
        ParameterError: A parameter has the wrong type or is out of range.
        CommandError: Parameters do not match the robot; the message names the remedy.
    """
    urdf = _urdf(read)
    estimator = read.settings(
        EstimatorSettings,
        odometry=read.settings(OdometrySettings, 'odometry.'),
        mounting=_mounting(read),
    )
    joints = _joint_map(read, urdf)
    return RobotSettings(link=link, urdf=urdf, joints=joints, estimator=estimator, **given)


def _vendor(protocols: tuple[Protocol, ...], method: str) -> bool:
    """Return whether to use the vendor's library; if it is installed, the user must choose."""
    installed, wanted = is_installed(), not protocols
    if wanted and not installed:
        raise CommandError(
            'protocol vendor: xgo_lib2 of the vendor is not installed for this Python; '
            'install it, or choose auto'
        )
    if wanted and not method:
        raise CommandError(
            'protocol vendor: set vendor_servo_method to the name of the method of xgo_lib2’s '
            'XgoDog that writes the angle [deg] of a motor by its id'
        )
    if installed and len(protocols) > 1:
        raise CommandError(
            'protocol auto: xgo_lib2 of the vendor is installed for this Python, and which way to '
            'the robot is meant is not guessed; set protocol to vendor, v2, v1 or developer'
        )
    return wanted


def _urdf(read: ParameterReader) -> str:
    text = read.text('robot_description', '', 'URDF as XML text; empty: of quad_description')
    presets = {name: name for name in PRESETS}
    preset = read.choice('preset', 'lite', presets, 'robot of quad_description')
    arm = read.flag('arm', default=False, meaning='the robot of quad_description has its arm')
    return text or robot_urdf(preset, arm=arm)


def _joint_map(read: ParameterReader, urdf: str) -> JointMap:
    try:
        joints = movable_joints(urdf)
    except DescriptionError as error:
        raise CommandError(f'robot_description: {error}') from error
    return JointMap(_servo(read, joint) for joint in joints)


def _servo(read: ParameterReader, joint: Joint) -> JointServo:
    prefix = f'joints.{joint.name}'
    motor = read.whole(f'{prefix}.motor', 0, (0, 99), 'id of its motor; 0: by its name')
    servo = servo_of(joint, motor or None)
    return replace(
        servo,
        sign=read.whole(f'{prefix}.sign', 1, (-1, 1), '1 or -1: the servo turns as the joint'),
        offset=read.number(
            f'{prefix}.offset', servo.offset, (-7.0, 7.0), 'position at servo zero [rad], [m]'
        ),
        lower=read.number(f'{prefix}.lower', servo.lower, None, 'least target [rad], [m]'),
        upper=read.number(f'{prefix}.upper', servo.upper, None, 'greatest target [rad], [m]'),
    )


def _mounting(read: ParameterReader) -> ImuMounting:
    roll, pitch, yaw = _three(
        read, 'imu.mounting', (0.0, 0.0, 0.0), 'roll, pitch, yaw of the IMU in base_link [rad]'
    )
    return ImuMounting(
        from_rpy(roll, pitch, yaw),
        _signs(read, 'imu.attitude_signs', 'of roll, pitch and yaw as they are reported'),
        _signs(read, 'imu.acceleration_signs', 'of the specific force; +9.8 upwards at rest'),
        _signs(read, 'imu.rate_signs', 'of the angular velocity'),
        checked=read.flag(
            'imu.mounting_checked',
            default=False,
            meaning='the mounting was compared with gravity (calibrate imu)',
        ),
        rates_checked=read.flag(
            'imu.rates_checked',
            default=False,
            meaning='the gyro was compared with turning by hand (calibrate imu)',
        ),
    )


def _signs(read: ParameterReader, name: str, meaning: str) -> Vector:
    signs = _three(read, name, (1.0, 1.0, 1.0), meaning)
    if not set(signs) <= {1.0, -1.0}:
        raise CommandError(f'{name} is {list(signs)}: each must be 1 or -1')
    return signs


def _three(read: ParameterReader, name: str, default: Vector, meaning: str) -> Vector:
    values = read.numbers(name, meaning) or default
    if len(values) != len(default):
        raise CommandError(f'{name} has {len(values)} numbers; give three, for x, y and z')
    x, y, z = values
    return x, y, z


def declare_frames(read: ParameterReader) -> Frames:
    """Declare the names of the frames."""
    prefix = read.text('frame_prefix', '', 'before each frame, as of robot_state_publisher')
    frames = read.settings(Frames)
    names = {name: getattr(frames, name) for name in Frames.__slots__ if name.endswith('_frame')}
    return replace(frames, **{name: prefix + frame for name, frame in names.items()})
