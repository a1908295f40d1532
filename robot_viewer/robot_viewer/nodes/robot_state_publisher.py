# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run robot_viewer robot_state_publisher``: computes /tf from /joint_states and a URDF."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import fields
from pathlib import Path
import sys

from geometry_msgs.msg import TransformStamped
from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import qos_profile_sensor_data
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.time import Time
from rclpy.utilities import remove_ros_args
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage
from urdf_reader import DescriptionError, JointKind, read_urdf

from node_runner import (
    destroyed_when_refused,
    LATCHED,
    notify_ready,
    ParameterError,
    ParameterReader,
    refuse_misspelt,
    run_node,
)

from ..state_publisher import (
    FrameTransform,
    HIGHEST_FREQUENCY,
    MessageProblem,
    Settings,
    StatePublisher,
)

NAME = 'robot_state_publisher'
DESCRIPTION = 'robot_description'
DEFAULTS = Settings()
TF_DEPTH = 100
"""Queue depth of /tf, as in tf2_ros."""


class RobotStatePublisher(Node):
    """Publishes /tf, /tf_static and robot_description."""

    @destroyed_when_refused
    def __init__(self, description: str = '') -> None:
        """Publish fixed transforms, and subscribe to joint states.

        Raises:
            ParameterError: A parameter is wrong, or there is no description.
            DescriptionError: The description cannot be used.
        """
        super().__init__(NAME)
        read = ParameterReader(self, fixed=False)
        read.number(
            'publish_frequency',
            DEFAULTS.publish_frequency,
            (0.0, HIGHEST_FREQUENCY),
            'greatest rate of each transform in [Hz]; 0: one for every message',
        )
        read.text(
            'frame_prefix', DEFAULTS.frame_prefix, 'put in front of each frame name, as it is'
        )
        read.flag(
            'ignore_timestamp', 'publish at each message, whatever its stamp is', default=False
        )
        read.text(DESCRIPTION, description, 'URDF as XML text; may be changed while it runs')
        refuse_misspelt(self)
        if not self.get_parameter(DESCRIPTION).value:
            raise ParameterError(
                'no robot_description: give the URDF as a parameter, or the name of a URDF file '
                'as an argument'
            )
        self._tf = self.create_publisher(TFMessage, '/tf', TF_DEPTH)
        self._tf_static = self.create_publisher(TFMessage, '/tf_static', LATCHED)
        self._description = self.create_publisher(String, 'robot_description', LATCHED)
        self._apply()
        self.create_subscription(
            JointState,
            'joint_states',
            self._take,
            qos_profile_sensor_data,
            qos_overriding_options=QoSOverridingOptions.with_default_policies(),
        )
        self.add_on_set_parameters_callback(self._check)
        self.add_post_set_parameters_callback(self._changed)

    def _apply(self) -> None:
        text = str(self.get_parameter(DESCRIPTION).value)
        try:
            model = read_urdf(text)
        except DescriptionError as error:
            raise DescriptionError(f'{DESCRIPTION}: {error}') from error
        settings = (self.get_parameter(each.name).value for each in fields(Settings))
        self._core = StatePublisher(model, Settings(*settings))
        self._description.publish(String(data=text))
        fixed = self._core.fixed()
        self._tf_static.publish(_message(fixed, self.get_clock().now()))
        for joint in model.joints:
            if joint.kind in {JointKind.FLOATING, JointKind.PLANAR}:
                how = 'left out' if joint.kind is JointKind.FLOATING else 'taken as fixed'
                self.get_logger().info(f'{joint.kind.value} joint {joint.name} is {how}')
        moving = sum(1 for _ in model.movable())
        rate = self._core.settings.publish_frequency
        self.get_logger().info(
            f'publishing {len(fixed)} fixed and {moving} moving frames of robot {model.name!r}, '
            + (f'at most {rate:g} times a second' if rate else 'at each message')
        )

    def _check(self, parameters: Iterable[Parameter]) -> SetParametersResult:
        """Reject an unusable description; rclpy checks the ranges."""
        for parameter in parameters:
            if parameter.name == DESCRIPTION:
                try:
                    read_urdf(str(parameter.value or ''))
                except DescriptionError as error:
                    return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _changed(self, parameters: list[Parameter]) -> None:
        if any(parameter.name != 'use_sim_time' for parameter in parameters):
            self._apply()

    def _take(self, message: JointState) -> None:
        stamp = message.header.stamp
        stamp_ns = stamp.sec * 1_000_000_000 + stamp.nanosec
        now = self.get_clock().now().nanoseconds
        update = self._core.update(message.name, message.position, stamp_ns, now)
        for problem in update.problems:
            self._warn(problem, message.name)
        if update.transforms:
            self._tf.publish(_message(update.transforms, Time(nanoseconds=update.stamp)))

    def _warn(self, problem: MessageProblem, names: Sequence[str]) -> None:
        text = f'message about {", ".join(names[:3]) or "no joint"}: {problem.value}'
        if problem is MessageProblem.LENGTHS:
            self.get_logger().error(text, throttle_duration_sec=5.0)
        elif problem is MessageProblem.BACKWARDS:
            self.get_logger().warning(problem.value)
        else:
            self.get_logger().warning(f'{text} (logged once)', once=True)


def _message(transforms: Iterable[FrameTransform], stamp: Time) -> TFMessage:
    time_message = stamp.to_msg()
    return TFMessage(transforms=[_stamped(each, time_message) for each in transforms])


def _stamped(named: FrameTransform, stamp: object) -> TransformStamped:
    message = TransformStamped(child_frame_id=named.child)
    message.header.frame_id = named.parent
    message.header.stamp = stamp
    translation, rotation = message.transform.translation, message.transform.rotation
    translation.x, translation.y, translation.z = named.transform.translation
    rotation.x, rotation.y, rotation.z, rotation.w = named.transform.rotation
    return message


def _read_argument(argv: Sequence[str]) -> str:
    """Read the URDF file named on the command line, if any."""
    files = remove_ros_args(list(argv))[1:]
    if not files:
        return ''
    if len(files) > 1:
        raise ParameterError(f'one URDF file at most, not {" ".join(files)}')
    try:
        text = Path(files[0]).read_text(encoding='utf-8')
        read_urdf(text)  # here, where the file name is known
    except (OSError, UnicodeDecodeError, DescriptionError) as error:
        raise DescriptionError(f'{files[0]}: {error}') from error
    return text


def _start() -> RobotStatePublisher:
    node = RobotStatePublisher(_read_argument(sys.argv))
    notify_ready()
    return node


def main() -> int:
    """Run until Ctrl-C; return 0, or 1 if it could not start."""
    return run_node(NAME, _start, DescriptionError)
