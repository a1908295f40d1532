# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run quad_description display``: publishes robot description and joint states to view."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import math
import sys
from typing import Final

from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage
from urdf_reader import DescriptionError

from node_runner import destroyed_when_refused, LATCHED, ParameterReader, refuse_misspelt, run_node

from .kinematics import quadruped
from .presets import Joint, movable_joints, Pose, pose_positions, PRESETS, robot_urdf

SWEEP_DURATION: Final = 2.5  # [s] for one joint, there and back


def sweep(joints: Sequence[Joint], rest: Mapping[str, float], elapsed: float) -> dict[str, float]:
    """Return the positions [rad] at a time [s] of a sweep through all joints, which repeats.

    One joint after another moves from rest to its upper limit, its lower limit and back, along a
    sine each way; the others rest.
    """
    positions = {joint.name: rest[joint.name] for joint in joints}
    turn, phase = divmod(elapsed / SWEEP_DURATION, 1.0)
    moving = joints[int(turn) % len(joints)]
    wave = math.sin(2.0 * math.pi * phase)
    here = rest[moving.name]
    amplitude = moving.limits.upper - here if wave > 0.0 else here - moving.limits.lower
    positions[moving.name] = here + amplitude * wave
    return positions


SWEEP = 'sweep'
MOTIONS = (SWEEP, *(pose.value for pose in Pose))

RATES = (1.0, 200.0)  # [Hz]


class Display(Node):
    """Publishes ``/robot_description`` (latched), ``/joint_states`` and base_footprint."""

    @destroyed_when_refused
    def __init__(self) -> None:
        """Read the parameters and start to publish.

        Raises:
            ParameterError: A parameter is invalid.
            DescriptionError: The description cannot be generated.
        """
        super().__init__('display')
        read = ParameterReader(self)
        preset = read.choice('preset', 'lite', {name: name for name in PRESETS}, 'the robot')
        arm = read.flag('arm', 'with the arm on its back', default=False)
        motion = read.choice('motion', SWEEP, {name: name for name in MOTIONS}, 'what it does')
        rate = read.number('rate', 50.0, RATES, 'joint states a second [Hz]')
        self._prefix = read.text('frame_prefix', '', 'before each frame')
        refuse_misspelt(self)
        urdf = robot_urdf(preset, arm)
        self._robot, self._joints = quadruped(urdf), movable_joints(urdf)
        self._moves = motion == SWEEP
        self._rest = pose_positions(Pose.STAND if self._moves else Pose(motion), arm)
        self._description = self.create_publisher(String, 'robot_description', LATCHED)
        self._description.publish(String(data=urdf))
        self._states = self.create_publisher(JointState, 'joint_states', 10)
        self._tf = self.create_publisher(TFMessage, '/tf', 10)
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
        self._tf.publish(TFMessage(transforms=[self._to_footprint(message)]))

    def _to_footprint(self, states: JointState) -> TransformStamped:
        """Return the ground position below a level body that stands on its lowest foot."""
        transform = TransformStamped(child_frame_id=f'{self._prefix}base_footprint')
        transform.header.stamp = states.header.stamp
        transform.header.frame_id = f'{self._prefix}base_link'
        transform.transform.translation.z = -self._robot.standing_height(states.position)
        return transform


def run(args: list[str] | None = None) -> int:
    """Run the display until Ctrl-C; return the exit code."""
    return run_node('display', Display, DescriptionError, args=args)


def main() -> None:
    """Entry point."""
    sys.exit(run())


if __name__ == '__main__':
    main()
