# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Publishes the state of a robot, live or from a log, as ROS topics (REP 103, 105, 145).

Each message published per report consists of a template and the numbers that change from message
to message. Standard deviations are None for unmeasured values.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
import math
import time

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import Point, Quaternion, Transform, TransformStamped, Vector3
from nav_msgs.msg import Odometry
from rclpy.node import Node
from sensor_msgs.msg import BatteryState, Imu, JointState
from std_msgs.msg import Float64, Header, String
from tf2_msgs.msg import TFMessage

from message_templates import FastPublisher, MessageTemplate
from node_runner import LATCHED
from quad_description import FEET, ImuSample, JointSample, OdometryState, RobotState
from quad_description.rotations import about_z, conjugate, multiply, rotate, yaw_of
from quad_description.rotations import Quaternion as Rotation
from quad_msgs.msg import FootContacts

from ..link import LinkState
from ..serial_robot import ObservedRobot, ROBOT
from .diagnostics import LinkDiagnostic, robot_diagnostic
from .parameters import Deviations, FootprintMode, Frames

NOT_THERE = [-1.0, *([0.0] * 8)]  # covariance of what is not measured (REP 145)
UNUSED = 1e6  # variance of what is not measured
VELOCITY_VARIANCE = 0.03**2  # [m²/s²]
HEIGHT_VARIANCE = 0.01**2  # [m²]
_ZERO = (0.0, 0.0, 0.0)

Numbers = Sequence[float]


def joint_states(names: tuple[str, ...], joints: JointSample) -> tuple[MessageTemplate, Numbers]:
    """Return the template for the measured joints, out of all joint names; without efforts."""
    columns = joints.positions, joints.velocities or ()
    if joints.unmeasured:
        names = tuple(joints.measured(names))
        left_out = joints.unmeasured
        numbers = [n for column in columns for i, n in enumerate(column) if i not in left_out]
        return MessageTemplate(_joint_states, 2 * len(names), names), numbers
    return MessageTemplate(_joint_states, 2 * len(names), names), (*columns[0], *columns[1])


def _joint_states(stamp: Time, numbers: Numbers, *names: str) -> JointState:
    return JointState(
        header=Header(stamp=stamp),
        name=list(names),
        position=numbers[: len(names)],
        velocity=numbers[len(names) :],
    )


def imu(
    sample: ImuSample, deviations: Deviations, frame: str, turned: Rotation
) -> tuple[MessageTemplate, Numbers]:
    """Return attitude, angular velocity and specific force; unmeasured ones are zero.

    Args:
        frame: Name of the frame of the message.
        turned: Rotation of that frame in base_link, the frame of the sample.
    """
    body = conjugate(turned)
    acceleration = None if sample.acceleration is None else deviations.linear_acceleration_stddev
    known = _tilt(sample, deviations), _rate(sample, deviations), acceleration
    rate = rotate(body, sample.angular_velocity or _ZERO)
    felt = rotate(body, sample.acceleration or _ZERO)
    orientation = multiply(sample.orientation, turned)
    return MessageTemplate(_imu, 10, (frame, known)), (*orientation, *rate, *felt)


def _imu(
    stamp: Time,
    numbers: Numbers,
    frame: str,
    deviations: tuple[float, float | None, float | None],
) -> Imu:
    orientation, rate, acceleration = map(_diagonal3, deviations)
    return Imu(
        header=Header(stamp=stamp, frame_id=frame),
        orientation=_quaternion(numbers[:4]),
        orientation_covariance=orientation,
        angular_velocity=_vector(numbers[4:7]),
        angular_velocity_covariance=rate,
        linear_acceleration=_vector(numbers[7:]),
        linear_acceleration_covariance=acceleration,
    )


def odometry(
    sample: ImuSample, state: OdometryState, deviations: Deviations, frames: Frames
) -> tuple[MessageTemplate, Numbers]:
    """Return the pose in odom and the velocity in base_link (or in the footprint)."""
    rotation, height = state.rotation, state.height
    rate = sample.angular_velocity or _ZERO  # in the body
    child, velocity = frames.base_frame, state.velocity_in_base
    if frames.footprint_mode is FootprintMode.PARENT:
        # level
        child, velocity = frames.footprint_frame, (state.velocity_x, state.velocity_y, 0.0)
        rate = rotate(_level(rotation), rate)
        rotation, height = about_z(yaw_of(rotation)), 0.0
    known = _tilt(sample, deviations), _rate(sample, deviations)
    place = state.x, state.y, height
    variances = state.position_variance, known[0] ** 2 + state.yaw_variance
    numbers = (*place, *rotation, *velocity, *rate, *variances)
    return MessageTemplate(_odometry, len(numbers), (frames.odom_frame, child, known)), numbers


def _odometry(
    stamp: Time,
    numbers: Numbers,
    frame: str,
    child: str,
    deviations: tuple[float, float | None],
) -> Odometry:
    tilt, rate = deviations
    message = Odometry(header=Header(stamp=stamp, frame_id=frame))
    message.child_frame_id = child
    x, y, z = numbers[:3]
    message.pose.pose.position = Point(x=x, y=y, z=z)
    message.pose.pose.orientation = _quaternion(numbers[3:7])
    place, yaw = numbers[13:]
    level = tilt**2
    message.pose.covariance = _diagonal6((place, place, HEIGHT_VARIANCE, level, level, yaw))
    message.twist.twist.linear = _vector(numbers[7:10])
    message.twist.twist.angular = _vector(numbers[10:13])
    turning = UNUSED if rate is None else rate**2
    message.twist.covariance = _diagonal6(
        (VELOCITY_VARIANCE, VELOCITY_VARIANCE, UNUSED, *[turning] * 3)
    )
    return message


def foot_contacts(state: OdometryState) -> tuple[MessageTemplate, Numbers]:
    """Return the estimated foot contacts."""
    return MessageTemplate(_foot_contacts, 0, state.standing), ()


def _foot_contacts(stamp: Time, _numbers: Numbers, *contacts: bool) -> FootContacts:
    source, header = FootContacts.MEASURED_HEIGHT, Header(stamp=stamp)
    return FootContacts(header=header, name=list(FEET), contact=list(contacts), source=source)


def transforms(state: OdometryState, frames: Frames) -> tuple[MessageTemplate, Numbers]:
    """Return the transforms odom to base_link to base_footprint, or odom to footprint to base."""
    tilt, place = _level(state.rotation), (state.x, state.y)
    if frames.footprint_mode is FootprintMode.PARENT:
        names = frames.odom_frame, frames.footprint_frame, frames.base_frame
        heading = about_z(yaw_of(state.rotation))
        numbers = (*place, 0.0, *heading, 0.0, 0.0, state.height, *tilt)
    else:
        names = frames.odom_frame, frames.base_frame, frames.footprint_frame
        upright = conjugate(tilt)
        below = rotate(upright, (0.0, 0.0, -state.height))
        numbers = (*place, state.height, *state.rotation, *below, *upright)
    return MessageTemplate(_transforms, len(numbers), names), numbers


def _transforms(stamp: Time, numbers: Numbers, odom: str, first: str, second: str) -> TFMessage:
    return TFMessage(
        transforms=[
            _transform(odom, first, numbers[:7], stamp),
            _transform(first, second, numbers[7:], stamp),
        ]
    )


def battery(state: RobotState, stamp: Time) -> BatteryState:
    """Return the battery state; unreported values are NaN, as the message requires."""
    unknown = math.nan
    return BatteryState(
        header=Header(stamp=stamp),
        voltage=unknown if state.voltage is None else state.voltage,
        temperature=unknown,
        current=unknown,
        charge=unknown,
        capacity=unknown,
        design_capacity=unknown,
        percentage=unknown if state.battery is None else state.battery,
        power_supply_status=BatteryState.POWER_SUPPLY_STATUS_UNKNOWN,
        power_supply_health=BatteryState.POWER_SUPPLY_HEALTH_UNKNOWN,
        power_supply_technology=BatteryState.POWER_SUPPLY_TECHNOLOGY_LION,
        present=True,
    )


def _tilt(sample: ImuSample, deviations: Deviations) -> float:
    return max(deviations.orientation_stddev, sample.deviation)


def _rate(sample: ImuSample, deviations: Deviations) -> float | None:
    if sample.angular_velocity is None:
        return None
    gyro = not sample.rate_differentiated
    return deviations.gyro_stddev if gyro else deviations.angular_velocity_stddev


def _level(rotation: Rotation) -> Rotation:
    """Return a rotation's roll and pitch, without its yaw."""
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


SENSOR_DEPTH = 10  # reliable, which best-effort subscribers can receive as well
WARN_PERIOD = 2.0  # [s] between two warnings of the same kind


def log_link(node: Node, state: LinkState, detail: str) -> None:
    """Log a change of the link state."""
    if state in {LinkState.REFUSED, LinkState.FAILED}:
        node.get_logger().error(f'{state.value}: {detail}')
    elif state in {LinkState.STALE, LinkState.CONNECTING}:
        node.get_logger().warning(f'{state.value}: {detail}')
    elif state is LinkState.STOPPED:
        node.get_logger().debug(detail)
    else:
        node.get_logger().info(f'{state.value}: {detail}')


class RobotTopics:
    """Publishes joints, imu, odom, contacts, /tf, battery, servo problems and diagnostics."""

    def __init__(
        self,
        node: Node,
        robot: ObservedRobot,
        frames: Frames,
        deviations: Deviations,
        steady: Callable[[float], float] = lambda moment: moment,
    ) -> None:
        """Create the publishers; ``steady`` converts state times to the monotonic clock [s]."""
        self.link = LinkDiagnostic()  # what is said of the serial link
        self._node, self._robot = node, robot
        self._frames, self._deviations = frames, deviations
        self._steady = steady
        self._imu_turned = robot.rotation_of(frames.imu_frame)
        self._joint_states = FastPublisher(
            node.create_publisher(JointState, 'joint_states', SENSOR_DEPTH)
        )
        self._imu = FastPublisher(node.create_publisher(Imu, 'imu', SENSOR_DEPTH))
        self._odom = FastPublisher(node.create_publisher(Odometry, 'odom', SENSOR_DEPTH))
        self._contacts = FastPublisher(
            node.create_publisher(FootContacts, 'foot_contacts', SENSOR_DEPTH)
        )
        self._battery = node.create_publisher(BatteryState, 'battery_state', SENSOR_DEPTH)
        self._tf = FastPublisher(node.create_publisher(TFMessage, '/tf', 100))
        self._diagnostics = node.create_publisher(DiagnosticArray, 'diagnostics', SENSOR_DEPTH)
        self._servos = node.create_publisher(String, 'servo_problem', LATCHED)
        self._servo_problem: str | None = None
        self._velocity_error = node.create_publisher(Float64, 'joint_velocity_error', LATCHED)

    def publish(self, state: RobotState) -> None:
        """Publish a report from the thread that received it."""
        if state.servo_problem is not None and state.servo_problem != self._servo_problem:
            self._servo_problem = state.servo_problem
            self._servos.publish(String(data=state.servo_problem))
        # what a controller waits for comes first
        if (joints := state.joints) is not None:
            template, numbers = joint_states(self._robot.names, joints)
            self._joint_states.publish(template, self._stamp(joints.time), numbers)
        measured, way = state.imu, state.odometry
        if measured is None or way is None:
            self._node.get_logger().error(
                f'no /imu, /odom, /foot_contacts and transforms: {state.imu_problem}; the joints '
                'are published, and the robot can lie down',
                throttle_duration_sec=WARN_PERIOD,
            )
            return
        deviations, frames, stamp = self._deviations, self._frames, self._stamp(state.time)
        for publisher, (template, numbers) in (
            (self._imu, imu(measured, deviations, frames.imu_frame, self._imu_turned)),
            (self._odom, odometry(measured, way, deviations, frames)),
            (self._contacts, foot_contacts(way)),
        ):
            publisher.publish(template, stamp, numbers)
        if frames.publish_tf:
            template, numbers = transforms(way, frames)
            self._tf.publish(template, stamp, numbers)

    def publish_diagnostics(
        self,
        name: str,
        port: str,
        recording: Callable[[str], str],
        commands: DiagnosticStatus | None = None,
    ) -> None:
        """Publish link and robot diagnostics, and the battery.

        Args:
            name: Name of the node.
            port: Serial port, or the log in its place.
            recording: Returns the last black box file, optionally for one subject.
            commands: Counters of joint commands; None if unknown.
        """
        state, status = self._robot.latest, self._robot.status()
        now = self._node.get_clock().now().to_msg()
        array = DiagnosticArray()
        array.header.stamp = now
        array.status = [self.link.describe(name, port, status, recording(''))]
        if commands is not None:
            array.status.append(commands)
        if state is not None:
            error, box = self._robot.gravity_error, recording(ROBOT)
            array.status.append(
                robot_diagnostic(name, port, state, status, gravity_error=error, recording=box)
            )
            self._battery.publish(battery(state, now))
            if state.joints is not None:
                self._velocity_error.publish(Float64(data=state.joints.velocity_error))
        self._diagnostics.publish(array)

    def _stamp(self, moment: float) -> int:
        """Convert a state time of the robot to ROS time [ns]."""
        age = round((time.monotonic() - self._steady(moment)) * 1e9)
        return max(self._node.get_clock().now().nanoseconds - age, 0)
