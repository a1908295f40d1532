# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The state of the robot as ROS messages (REP 103, 105, 145), and as /diagnostics (REP 107).

What is published with every report comes as a template, which makes the message, and as the
numbers that change from one message to the next. Standard deviations are None where a value is
not measured.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import asdict, dataclass
import math
from typing import Any, TypeAlias

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from geometry_msgs.msg import Point, Quaternion, Transform, TransformStamped, Vector3
from nav_msgs.msg import Odometry
from sensor_msgs.msg import BatteryState, Imu, JointState
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from quad_description import (
    EMPTY_BATTERY,
    FEET,
    ImuSample,
    JointSample,
    LOW_BATTERY,
    OdometryState,
    RobotState,
)
from quad_description.rotations import about_z, conjugate, multiply, rotate, yaw_of
from quad_description.rotations import Quaternion as Rotation
from quad_msgs.msg import FootContacts

from ..commander import CommandCounters
from ..link import latency_problem, LinkState, LinkStatus
from ..protocol import Fault, ParserCounters
from ..report import FAULT_TEXTS
from ..serial_robot import COMMANDS, LINK, ROBOT
from .parameters import Deviations, Frames

NOT_THERE = [-1.0, *([0.0] * 8)]  # covariance of what is not measured (REP 145)
UNUSED = 1e6  # variance of what is not measured
VELOCITY_VARIANCE = 0.03**2  # [m²/s²]
HEIGHT_VARIANCE = 0.01**2  # [m²]

Numbers = Sequence[float]
Message: TypeAlias = Any


@dataclass(frozen=True, slots=True)
class Template:
    """What messages that differ by stamp and numbers have in common."""

    make: Callable[..., Message]  # of stamp, numbers, and the arguments
    count: int  # of the numbers
    arguments: tuple[Hashable, ...]  # what does not change from one message to the next

    def message(self, stamp: Time, numbers: Numbers) -> Message:
        """Make a message."""
        return self.make(stamp, numbers, *self.arguments)


def joint_states(names: tuple[str, ...], joints: JointSample) -> tuple[Template, Numbers]:
    """Return the joints that are measured, of all joints by name; efforts are not known."""
    columns = joints.positions, joints.velocities or ()
    if joints.unmeasured:
        names = tuple(joints.measured(names))
        left_out = joints.unmeasured
        numbers = [n for column in columns for i, n in enumerate(column) if i not in left_out]
        return Template(_joint_states, 2 * len(names), names), numbers
    return Template(_joint_states, 2 * len(names), names), (*columns[0], *columns[1])


def _joint_states(stamp: Time, numbers: Numbers, *names: str) -> JointState:
    return JointState(
        header=Header(stamp=stamp),
        name=list(names),
        position=numbers[: len(names)],
        velocity=numbers[len(names) :],
    )


def imu(sample: ImuSample, deviations: Deviations, frame: str) -> tuple[Template, Numbers]:
    """Return attitude, angular velocity and specific force; zeros for what is not measured."""
    acceleration = None if sample.acceleration is None else deviations.acceleration
    known = _tilt(sample, deviations), _rate(sample, deviations), acceleration
    rate, felt = sample.angular_velocity or _ZERO, sample.acceleration or _ZERO
    return Template(_imu, 10, (frame, known)), (*sample.orientation, *rate, *felt)


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
) -> tuple[Template, Numbers]:
    """Return the pose in odom and the velocity in base_link (or in the footprint)."""
    rotation, height = state.rotation, state.height
    rate = sample.angular_velocity or _ZERO  # in the body
    child, velocity = frames.base, state.velocity_in_base
    if frames.footprint_is_parent:
        child, velocity = frames.footprint, (state.velocity_x, state.velocity_y, 0.0)  # level
        rate = rotate(_level(rotation), rate)
        rotation, height = about_z(yaw_of(rotation)), 0.0
    known = _tilt(sample, deviations), _rate(sample, deviations)
    place = state.x, state.y, height
    variances = state.position_variance, known[0] ** 2 + state.yaw_variance
    numbers = (*place, *rotation, *velocity, *rate, *variances)
    return Template(_odometry, len(numbers), (frames.odom, child, known)), numbers


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


def foot_contacts(state: OdometryState) -> tuple[Template, Numbers]:
    """Return which feet are taken to stand, and how that is known."""
    return Template(_foot_contacts, 0, (state.contact_source.value, *state.standing)), ()


def _foot_contacts(stamp: Time, _numbers: Numbers, source: str, *contacts: bool) -> FootContacts:
    return FootContacts(
        header=Header(stamp=stamp), name=list(FEET), contact=list(contacts), source=source
    )


def transforms(state: OdometryState, frames: Frames) -> tuple[Template, Numbers]:
    """Return odom to base_link and base_link to base_footprint, or the other way round."""
    tilt, place = _level(state.rotation), (state.x, state.y)
    if frames.footprint_is_parent:
        names = frames.odom, frames.footprint, frames.base
        heading = about_z(yaw_of(state.rotation))
        numbers = (*place, 0.0, *heading, 0.0, 0.0, state.height, *tilt)
    else:
        names, upright = (frames.odom, frames.base, frames.footprint), conjugate(tilt)
        below = rotate(upright, (0.0, 0.0, -state.height))
        numbers = (*place, state.height, *state.rotation, *below, *upright)
    return Template(_transforms, len(numbers), names), numbers


def _transforms(stamp: Time, numbers: Numbers, odom: str, first: str, second: str) -> TFMessage:
    return TFMessage(
        transforms=[
            _transform(odom, first, numbers[:7], stamp),
            _transform(first, second, numbers[7:], stamp),
        ]
    )


def battery(state: RobotState, stamp: Time) -> BatteryState:
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
        percentage=unknown if state.battery is None else state.battery,
        power_supply_status=BatteryState.POWER_SUPPLY_STATUS_UNKNOWN,
        power_supply_health=BatteryState.POWER_SUPPLY_HEALTH_UNKNOWN,
        power_supply_technology=BatteryState.POWER_SUPPLY_TECHNOLOGY_LION,
        present=True,
    )


_ZERO = (0.0, 0.0, 0.0)


def _tilt(sample: ImuSample, deviations: Deviations) -> float:
    return max(deviations.orientation, sample.deviation)


def _rate(sample: ImuSample, deviations: Deviations) -> float | None:
    if sample.angular_velocity is None:
        return None
    return deviations.rate if sample.rate_differentiated else deviations.gyro


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


HOT_SERVO = 65.0  # [°C]
GRAVITY_ERROR = math.radians(15.0)  # [rad] between accelerometer and attitude
MAX_DAMAGE_RATIO = 0.01  # of the frames, above which a cable is bad

UNCHECKED = (
    'the IMU was not compared with gravity, nor its gyro with turning by hand, so the '
    'controller does not level: ros2 run quad_hardware calibrate imu'
)
"""What is said of an attitude whose signs may be wrong."""

_LINK_LEVELS = {
    LinkState.CONNECTING: DiagnosticStatus.ERROR,
    LinkState.FAILED: DiagnosticStatus.ERROR,
    LinkState.WAITING: DiagnosticStatus.WARN,
    LinkState.RUNNING: DiagnosticStatus.OK,
    LinkState.STALE: DiagnosticStatus.STALE,
    LinkState.REFUSED: DiagnosticStatus.ERROR,
    LinkState.STOPPED: DiagnosticStatus.ERROR,
}


class LinkDiagnostic:
    """Describes the serial link, look by look: damage is judged since the last one."""

    def __init__(self) -> None:
        # what is wrong with its frames since the last look; empty while they are good
        self.damage = ''
        self._frames = self._damaged = 0

    def describe(
        self, node: str, port: str, status: LinkStatus, recording: str = ''
    ) -> DiagnosticStatus:
        """Describe the link and the last file of its black box, and begin to look anew."""
        level, message = _LINK_LEVELS[status.state], status.detail
        parser = status.parser
        frames, damaged = self._since(parser)
        self.damage = ''
        if damaged > MAX_DAMAGE_RATIO * max(frames, 100):
            self.damage = f'{damaged} damaged and {frames} good frames lately; is the cable loose?'
        if level == DiagnosticStatus.OK and self.damage:
            level, message = DiagnosticStatus.WARN, self.damage
        if level == DiagnosticStatus.OK and (slow := latency_problem(port, status.latency)):
            level, message = DiagnosticStatus.WARN, slow
        values = {
            'state': status.state.value,
            'protocol': status.protocol,
            'baud': status.baud,
            'firmware': status.firmware,
            'connections': status.connections,
            'report_age': '' if math.isinf(status.age) else f'{status.age:.3f}',
            'latency_timer': '' if status.latency is None else f'{status.latency:.3f}',
            'reports_refused': status.refused,
            'black_box': recording,
            'commands_sent': status.commands,
            'commands_dropped': status.dropped,
            **asdict(parser),
            **asdict(status.dialect),
        }
        return _status(level, f'{node}: {LINK}', message, port, values)

    def _since(self, parser: ParserCounters) -> tuple[int, int]:
        """Return the valid and the damaged frames since the last look."""
        since = parser.frames - self._frames, parser.damaged - self._damaged
        self._frames, self._damaged = parser.frames, parser.damaged
        # another connection counts from 0
        return since if min(since) >= 0 else (parser.frames, parser.damaged)


def robot_diagnostic(
    node: str,
    port: str,
    state: RobotState,
    status: LinkStatus,
    *,
    gravity_error: float | None,
    recording: str = '',
) -> DiagnosticStatus:
    """Describe battery, servos and IMU.

    Args:
        gravity_error: Between accelerometer and attitude [rad]; None while it is not known.
        recording: Last file of the black box with a fault of it; empty before one.
    """
    level, message = DiagnosticStatus.OK, 'no faults'
    signs_checked = state.imu is not None and not state.imu.is_uncertain
    if not signs_checked:
        level, message = DiagnosticStatus.WARN, UNCHECKED
    charge = state.battery
    hot = [motor for motor, t in state.temperatures.items() if t > HOT_SERVO]
    if gravity_error is not None and gravity_error > GRAVITY_ERROR:
        level = DiagnosticStatus.WARN
        angle = f'{math.degrees(gravity_error):.0f} degrees'
        message = (
            f'accelerometer and attitude disagree by {angle}; restart the robot on level ground'
        )
    if hot:
        level = DiagnosticStatus.WARN
        message = f'hot servos: {", ".join(map(str, hot))}'
    if charge is not None and charge < LOW_BATTERY:
        empty = charge < EMPTY_BATTERY
        level = DiagnosticStatus.ERROR if empty else DiagnosticStatus.WARN
        message = f'battery at {100.0 * charge:.0f} %; charge it'
    faults = Fault(state.faults & sum(Fault))
    if state.servo_problem:
        level, message = DiagnosticStatus.ERROR, state.servo_problem
    if state.imu_problem:
        level = DiagnosticStatus.ERROR
        message = f'{state.imu_problem}; lie down, then switch the robot off and on'
    if faults:
        level = DiagnosticStatus.ERROR
        message = f'the robot reports {"; ".join(FAULT_TEXTS[f] for f in Fault if f in faults)}'
    values = {
        'battery': '' if charge is None else f'{100.0 * charge:.0f}',
        'voltage': '' if state.voltage is None else f'{state.voltage:.2f}',
        'faults': state.faults,
        'imu_signs_checked': signs_checked,
        'gravity_error': '' if gravity_error is None else f'{gravity_error:.3f}',
        'joint_velocity_error': ''
        if state.joints is None
        else f'{state.joints.velocity_error:.2f}',
        'hottest_servo': max(state.temperatures.values(), default=0.0),
        'implausible_reports': status.refused,
        'last_implausible': status.refusal,
        'black_box': recording,
    }
    return _status(level, f'{node}: {ROBOT}', message, port, values)


def command_diagnostic(node: str, port: str, counters: CommandCounters) -> DiagnosticStatus:
    """Describe what became of joint commands, and begin to look anew."""
    level = DiagnosticStatus.WARN if counters.troubled else DiagnosticStatus.OK
    message = counters.reason if counters.troubled else f'{counters.received} received'
    if counters.loss:
        level = DiagnosticStatus.ERROR
        message = f'{counters.loss}; {message}' if counters.troubled else counters.loss
    values = {k: v for k, v in asdict(counters).items() if k != 'troubled'}
    counters.troubled, counters.largest_step = False, 0.0
    return _status(level, f'{node}: {COMMANDS}', message, port, values)


def _status(
    level: bytes, name: str, message: str, hardware: str, values: dict[str, object]
) -> DiagnosticStatus:
    pairs = [KeyValue(key=key, value=str(value)) for key, value in values.items()]
    return DiagnosticStatus(
        level=level, name=name, message=message, hardware_id=hardware, values=pairs
    )
