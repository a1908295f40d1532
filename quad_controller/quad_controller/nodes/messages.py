# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Converts ROS messages to and from controller values; records steps without blocking."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
import math
from pathlib import Path
import threading
import time
from typing import Any

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from geometry_msgs.msg import Pose
import numpy as np
import rclpy
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.serialization import serialize_message
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Header

from message_definitions import DefinitionError, message_definition
from node_runner import init_ros
from quad_description import FEET, ImuSample, JointSample, Quadruped, Targets
from quad_description.rotations import (
    conjugate,
    multiply,
    normalized,
    Quaternion,
    roll_pitch_yaw,
    rotate,
)
from quad_msgs.msg import ControllerStep, FootContacts, JointCommand
from rosbag_files import BagError, BagWriter, OfferedQos, Topic, WriterOptions

from ..exceptions import ParameterError
from ..gait.velocity import BodyPose, REST
from ..recording import TOPIC
from ..states.modes import Output, Status

UNMEASURED = -1.0  # first covariance of what an IMU does not measure (sensor_msgs/Imu, REP 145)
STILL_TITLES = frozenset({'relax', 'to relax', 'lie', 'to lie'})
"""States of the controller in which no joint but those of the legs moves."""
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


def imu_sample(
    message: Imu, numbers: Sequence[float], rotation_of: Callable[[str], Quaternion]
) -> ImuSample:
    """Convert an IMU message to a sample in base_link.

    Args:
        message: The message; its numbers are passed separately.
        numbers: As :data:`IMU_NUMBERS` names them.
        rotation_of: Returns the rotation of a frame in base_link.

    Raises:
        ValueError: The orientation is not measured, or one of its variances is invalid.
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
    turned = rotation_of(message.header.frame_id)
    rate, felt = (rotate(turned, (x, y, z)) for x, y, z in (rest[:3], rest[3:]))
    return ImuSample(
        multiply((x, y, z, w), conjugate(turned)),
        None if message.angular_velocity_covariance[0] == UNMEASURED else rate,
        None if message.linear_acceleration_covariance[0] == UNMEASURED else felt,
        math.sqrt(max(covariance[0], covariance[4])),
    )


def foot_contacts(message: FootContacts) -> tuple[bool, ...]:
    """Return whether each foot is on the ground, in the order of :data:`quad_description.FEET`.

    Raises:
        ValueError: A foot is missing.
    """
    seen = dict(zip(message.name, message.contact, strict=False))
    if missing := [foot for foot in FEET if foot not in seen]:
        raise ValueError(f'foot_contacts: no contact of {", ".join(missing)}; publish all feet')
    return tuple(bool(seen[foot]) for foot in FEET)


def body_pose(message: Pose) -> BodyPose:
    """Return the pose of the body relative to its normal one; a zero quaternion means none."""
    place, turn = message.position, message.orientation
    rotation = turn.x, turn.y, turn.z, turn.w
    if not any(rotation):
        return BodyPose(place.x, place.y, place.z)
    return BodyPose(place.x, place.y, place.z, *roll_pitch_yaw(normalized(rotation)))


class JointReader:
    """Reorders the joints of a message into the robot's order.

    The legs must be measured. An arm's servo need not be: protocol v1 of the XGO does not report
    one of them. Such a joint is assumed to be at its target. It receives no target before it has
    to move, because the size of its jump is unknown. The permutation is cached until the order of
    the message changes.
    """

    def __init__(self, robot: Quadruped) -> None:
        self._names = robot.names
        self._spared = {robot.names[index] for index in robot.others}
        self._seen: list[str] | None = None
        self._places: list[int | None] = []
        # joints that were in no message yet; empty before the first
        self.unreported: tuple[str, ...] = ()
        self.velocity_error = 0.0  # of velocities, rms [rad/s]; 0 where it is unknown

    def read(
        self, message: JointState, numbers: Sequence[float], sent: Sequence[float]
    ) -> JointSample:
        """Return the joints of a message.

        Args:
            message: The message; its numbers are passed separately.
            numbers: Positions [rad], and velocities [rad/s] behind them.
            sent: Last targets of all joints [rad], used for joints that are never reported.

        Raises:
            ValueError: A leg joint or a previously reported joint is missing, or the numbers of
                positions and names differ.
        """
        if len(message.position) != len(message.name):
            raise ValueError(
                f'joint states: {len(message.position)} positions for {len(message.name)} names'
            )
        if message.name != self._seen:
            self._find(list(message.name))
        count = len(message.position)
        position, velocity = numbers[:count], numbers[count:]
        known = len(velocity) == count
        return JointSample(
            tuple(
                target if place is None else position[place]
                for place, target in zip(self._places, sent, strict=True)
            ),
            tuple(0.0 if place is None else velocity[place] for place in self._places)
            if known
            else None,
            velocity_error=self.velocity_error,
        )

    def _find(self, names: list[str]) -> None:
        missing = [name for name in self._names if name not in names]
        if needed := [name for name in missing if name not in self._spared]:
            self._seen = None
            raise ValueError(
                f'joint states without {", ".join(needed)}; does the hardware node use the same '
                'robot description?'
            )
        self._spared &= set(missing)
        self.unreported = tuple(missing)
        self._places = [names.index(name) if name in names else None for name in self._names]
        self._seen = names


class CommandFilter:
    """Selects the joints of a command: all, or only the legs, which come first."""

    def __init__(self, robot: Quadruped, *, others_move: bool) -> None:
        """Start with a robot that has not moved."""
        legs = len(robot.names) - len(robot.others)
        legs_first = all(index >= legs for index in robot.others)
        self._count = legs if legs_first else len(robot.names)
        # whether joints that are no legs' will be sent elsewhere, ever
        self.others_move = others_move
        self._moved = False

    def select(self, targets: Targets, title: str, unreported: Sequence[str]) -> Targets:
        """Select the targets to send from those of all joints [rad]."""
        self._moved = self._moved or title not in STILL_TITLES
        if unreported and not (self.others_move and self._moved):
            return targets[: self._count]
        return targets


def joint_command(stamp: Time, targets: Sequence[float]) -> JointCommand:
    """Build the message for joint targets [rad]."""
    return JointCommand(header=Header(stamp=stamp), position=targets)


def state_diagnostic(node: str, status: Status) -> DiagnosticStatus:
    """Build the diagnostic of the controller's state."""
    level, message = DiagnosticStatus.OK, status.title
    if status.faults:
        level, message = DiagnosticStatus.ERROR, '; '.join(status.faults)
    elif math.isinf(status.joints_age):
        words = ('waiting for /joint_states', *status.warnings)
        level, message = DiagnosticStatus.STALE, '; '.join(words)
    elif status.warnings:
        level, message = DiagnosticStatus.WARN, '; '.join(status.warnings)
    velocity = status.velocity
    return DiagnosticStatus(
        level=level,
        name=f'{node}: state',
        message=message,
        values=_values(
            {
                'state': status.title,
                'goal': status.goal.value,
                'gait': status.gait.value,
                'policy': status.policy,
                'velocity': f'{velocity.x:.3f} {velocity.y:.3f} {velocity.yaw:.3f}',
                'joint_states_age': f'{status.joints_age:.3f}',
                'imu_age': f'{status.imu_age:.3f}',
                'battery': '' if status.battery is None else f'{status.battery:.2f}',
                'refused': str(status.refused),
                'targets_slowed': str(status.limited),
                'out_of_reach': str(status.unreachable),
            }
        ),
    )


def loop_diagnostic(node: str, figures: Mapping[str, float]) -> DiagnosticStatus:
    """Build the diagnostic of the loop timing."""
    digits = {'steps': 0, 'overruns': 0, 'rate': 2}
    return DiagnosticStatus(
        level=DiagnosticStatus.OK,
        name=f'{node}: loop',
        message=f'{figures["rate"]:.1f} Hz, jitter p99 {figures["jitter_p99"] * 1e3:.2f} ms',
        values=_values({key: f'{value:.{digits.get(key, 6)}f}' for key, value in figures.items()}),
    )


def recorder_diagnostic(node: str, recorder: Recorder) -> DiagnosticStatus:
    """Build the diagnostic of the recording."""
    trouble = recorder.failure or (f'{recorder.lost} steps lost' if recorder.lost else '')
    return DiagnosticStatus(
        level=DiagnosticStatus.WARN if trouble else DiagnosticStatus.OK,
        name=f'{node}: recorder',
        message=trouble or f'records to {recorder.folder}',
        values=_values({'folder': str(recorder.folder), 'lost': str(recorder.lost)}),
    )


def _values(values: dict[str, str]) -> list[KeyValue]:
    return [KeyValue(key=key, value=value) for key, value in values.items()]


TYPE = 'quad_msgs/msg/ControllerStep'
NS = 1_000_000_000
BACKLOG = 500  # steps that wait at most: 10 s at 50 Hz
FLUSH_PERIOD = 1.0  # [s] after which what was written outlives the process


class Recorder:
    """Records steps until :meth:`close`."""

    def __init__(self, folder: Path, about: Mapping[str, str], backlog: int = BACKLOG) -> None:
        """Create the folder; the queue holds at most ``backlog`` steps.

        Raises:
            ParameterError: The folder cannot be created.
        """
        self.folder = folder
        self.lost = 0  # steps that were not written: the disk was too slow or full
        self.failure = ''  # why nothing is written any more
        try:
            self._writer = BagWriter(folder, WriterOptions(custom=about))
            definition = message_definition(TYPE)
            self._writer.set_topic(Topic(TOPIC, TYPE, definition, qos=(OfferedQos(),)))
        except (BagError, DefinitionError) as error:
            raise ParameterError(f'record: {error}') from error
        self._places = threading.BoundedSemaphore(backlog)
        self._writing = ThreadPoolExecutor(1, thread_name_prefix='recorder')
        self._flushed = time.monotonic()

    def offer(
        self, output: Output, stamp: int, dt: float, computing: float, latency: float | None
    ) -> None:
        """Queue a step without blocking; if the queue is full, drop and count it.

        Args:
            stamp: Time of sending in [ns since 1970].
            dt: Time since the previous step in [s].
            computing: Time from the start of the step to the command in [s].
            latency: Time from the joint states to the command in [s]; None without.
        """
        if not self._places.acquire(blocking=False):
            self.lost += 1
            return
        latency = math.nan if latency is None else latency
        self._writing.submit(self._write, output, stamp, dt, computing, latency)

    def close(self) -> None:
        """Write the queued steps and finish the recording."""
        self._writing.shutdown()
        try:
            self._writer.close()
        except BagError as error:
            self.failure = self.failure or str(error)

    def _write(self, output: Output, stamp: int, *times: float) -> None:
        try:
            self.lost += bool(self.failure)
            if self.failure:
                return
            step = serialize_message(_message(output, stamp, *times))
            self._writer.write(TOPIC, step, stamp, stamp)
            if time.monotonic() - self._flushed > FLUSH_PERIOD:
                self._flushed = time.monotonic()
                self._writer.flush()
        except Exception as error:  # noqa: BLE001  # whatever it is, the robot walks on
            self.failure = str(error)
            self.lost += 1
        finally:
            self._places.release()


def _message(
    output: Output, stamp: int, dt: float, computing: float, latency: float
) -> ControllerStep:
    """Build the recorded message of a step."""
    sec, nanosec = divmod(stamp, NS)
    seen, asked = output.situation, output.asked
    joints, imu = (seen.joints, seen.imu) if seen is not None else (None, None)
    velocity = seen.velocity if seen is not None else REST
    numbers = {
        'target': output.targets,
        'position': joints and joints.positions,
        'velocity': joints and joints.velocities,
        'orientation': imu and imu.orientation,
        'angular_velocity': imu and imu.angular_velocity,
        'acceleration': imu and imu.acceleration,
        'linear_velocity': seen and seen.linear_velocity,
        'foot_contacts': seen and seen.foot_contacts,
        'command': (velocity.x, velocity.y, velocity.yaw),
        'observation': asked and asked.answer.observation,
        'action': asked and asked.answer.action,
    }
    return ControllerStep(
        stamp=Time(sec=sec, nanosec=nanosec),
        state=output.title,
        policy=asked.policy.name if asked else '',
        policy_digest=asked.policy.digest if asked else '',
        policy_step=asked.step if asked else 0,
        dt=dt,
        computing=computing,
        latency=latency,
        **{name: _numbers(values) for name, values in numbers.items()},
    )


def _numbers(values: Any) -> array[float]:  # noqa: ANN401  # a sequence, an array or None
    return array('f', np.ravel(() if values is None else values).tolist())


class OtherTypeSubscription:
    """Subscription that calls back in its own thread until it is closed."""

    def __init__(
        self, node: Node, kind: type, topic: str, take: Callable[[Any], None], qos: int
    ) -> None:
        """Subscribe to an absolute topic; if DDS raises, clean up."""
        self._context = Context()
        init_ros([], self._context)
        try:
            self._node = Node(
                f'{node.get_name()}_{topic.rpartition("/")[2]}',
                context=self._context,
                namespace=node.get_namespace(),
                use_global_arguments=False,
                enable_rosout=False,
                start_parameter_services=False,
            )
            self._node.create_subscription(kind, topic, take, qos)
            self._executor = SingleThreadedExecutor(context=self._context)
            self._executor.add_node(self._node)
        except BaseException:
            rclpy.shutdown(context=self._context)
            raise
        self._thread = threading.Thread(target=self._spin, name=topic, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Close the subscription."""
        rclpy.shutdown(context=self._context)
        self._thread.join()

    def _spin(self) -> None:
        with suppress(ExternalShutdownException):
            self._executor.spin()
