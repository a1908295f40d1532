# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run quad_description display``: the robot's description and joint states to look at."""

from __future__ import annotations

import difflib
import sys
from typing import TypeVar

from geometry_msgs.msg import TransformStamped
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
import rclpy
from rclpy.exceptions import ParameterException
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.utilities import try_shutdown
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from .exceptions import DescriptionError
from .feet import standing_height
from .joints import movable_joints
from .motion import sweep
from .poses import Pose, pose_positions
from .urdf import PRESETS, robot_urdf

Value = TypeVar('Value', bool, float, str)

SWEEP = 'sweep'
MOTIONS = (SWEEP, *(pose.value for pose in Pose))

RATE_RANGE = FloatingPointRange(from_value=1.0, to_value=200.0)


class Display(Node):
    """Publishes ``/robot_description``, latched, ``/joint_states`` and base_footprint."""

    def __init__(self) -> None:
        """Read the parameters and begin to publish.

        Raises:
            DescriptionError: A parameter has no sense.
        """
        super().__init__('display')
        preset = self._declare('preset', 'lite', f'the robot: {", ".join(PRESETS)}')
        arm = self._declare('arm', False, 'with the arm on its back')
        motion = self._declare('motion', SWEEP, f'what it does: {", ".join(MOTIONS)}')
        rate = self._declare('rate', 50.0, 'joint states a second [Hz]', RATE_RANGE)
        self._refuse_misspelt()
        if motion not in MOTIONS:
            raise DescriptionError(f'motion {motion!r} is none of {", ".join(MOTIONS)}')
        urdf = robot_urdf(preset, arm)
        self._joints = movable_joints(urdf)
        self._moves = motion == SWEEP
        self._rest = pose_positions(Pose.STAND if self._moves else Pose(motion), arm)
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._description = self.create_publisher(String, 'robot_description', latched)
        self._description.publish(String(data=urdf))
        self._states = self.create_publisher(JointState, 'joint_states', 10)
        self._footprint = self.create_publisher(TFMessage, '/tf', 10)
        self._start = self.get_clock().now()
        self.create_timer(1.0 / rate, self._publish)
        self.get_logger().info(f'{preset}: {len(self._joints)} joints, motion {motion}')

    def _publish(self) -> None:
        now = self.get_clock().now()
        positions = self._rest
        if self._moves:
            positions = sweep(self._joints, self._rest, (now - self._start).nanoseconds * 1e-9)
        message = JointState(name=list(positions), position=list(positions.values()))
        message.header.stamp = now.to_msg()
        self._states.publish(message)
        self._footprint.publish(TFMessage(transforms=[_footprint(message)]))

    def _declare(
        self, name: str, default: Value, description: str, bounds: FloatingPointRange | None = None
    ) -> Value:
        descriptor = ParameterDescriptor(description=description, read_only=True)
        if bounds is not None:
            descriptor.floating_point_range = [bounds]
        return type(default)(self.declare_parameter(name, default, descriptor).value)

    def _refuse_misspelt(self) -> None:
        known = list(self.get_parameters_by_prefix(''))
        for name in self._parameter_overrides:  # rclpy has no public way to ask
            close = difflib.get_close_matches(name, known, n=1, cutoff=0.8)
            if close and not self.has_parameter(name):
                raise DescriptionError(f'unknown parameter {name!r}; did you mean {close[0]!r}?')


def _footprint(states: JointState) -> TransformStamped:
    """Return where the ground is below a body that is level and stands on its lowest foot."""
    transform = TransformStamped(child_frame_id='base_footprint')
    transform.header.stamp = states.header.stamp
    transform.header.frame_id = 'base_link'
    positions = dict(zip(states.name, states.position, strict=True))
    transform.transform.translation.z = -standing_height(positions)
    return transform


def run(args: list[str] | None = None) -> int:
    """Display until Ctrl-C; return the exit code."""
    rclpy.init(args=args)
    try:
        rclpy.spin(Display())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except (DescriptionError, ParameterException) as error:
        sys.stderr.write(f'display: {error}\n')
        return 2
    finally:
        try_shutdown()
    return 0


def main() -> None:
    """Entry point."""
    sys.exit(run())


if __name__ == '__main__':
    main()
