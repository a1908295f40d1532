# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The demo's ROS client: jogs, sends trajectories, and keeps what the controller says."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
import math

from control_msgs.action import FollowJointTrajectory
from control_msgs.msg import JointTrajectoryControllerState, SpeedScalingFactor
from geometry_msgs.msg import TwistStamped
from moveit_msgs.msg import ServoStatus
import numpy as np
from rclpy.action.client import ActionClient
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from arm_model import Array, RobotModel
from node_runner import LATCHED
from process_supervisor import CallError

from ..client import ActionRun, ArmClient
from ..figures import AxisFigures
from .figures import MotionFigures
from .samples import cycles_between, peak_jerk, Sample


class MotionClient(ArmClient):
    """A node of its own; use it in one thread.

    Attributes:
        samples: States of the controller since they were cleared.
        words: What the servo said last.
        limited: What it said while something limited the motion, since that was cleared.
    """

    def __init__(
        self,
        given_up: Callable[[], bool],
        model: RobotModel,
        controller: str,
        period: float,
        namespace: str = '',
    ) -> None:
        """Join the ROS graph.

        Args:
            given_up: True when nothing shall be waited for any more.
            model: The arm, for where the tool is.
            controller: Name of the trajectory controller.
            period: Period of the cycle in [s].
            namespace: That of the arm.
        """
        super().__init__(given_up, namespace)
        self.figures = MotionFigures()
        self.samples: list[Sample] = []
        self.words = ''
        self.limited: list[str] = []
        self._model, self._period = model, period
        node = self.node
        self._twist = node.create_publisher(TwistStamped, 'servo_node/delta_twist_cmds', 10)
        self._speed = node.create_publisher(
            SpeedScalingFactor, f'{controller}/speed_scaling_input', LATCHED
        )
        self._action_name = f'{controller}/follow_joint_trajectory'
        self._action = ActionClient(node, FollowJointTrajectory, self._action_name)
        node.create_subscription(
            JointTrajectoryControllerState, f'{controller}/controller_state', self._state, 50
        )
        node.create_subscription(ServoStatus, 'servo_node/status', self._status, 10)

    @property
    def last(self) -> Sample:
        """The latest sample.

        Raises:
            CallError: The controller said nothing since they were cleared.
        """
        if not self.samples:
            raise CallError('the trajectory controller publishes no state: is the arm enabled?')
        return self.samples[-1]

    @property
    def age(self) -> float:
        """Age of the latest sample in [s]; infinite when there is none."""
        if not self.samples:
            return math.inf
        return 1e-9 * self.node.get_clock().now().nanoseconds - self.samples[-1].time

    def jog(self, linear: Array, frame: str) -> None:
        """Move the tool; counts for a tenth of a second.

        Args:
            linear: Its velocity in [m/s].
            frame: Link along whose axes.
        """
        message = TwistStamped()
        message.header.stamp = self.node.get_clock().now().to_msg()
        message.header.frame_id = frame
        vector = message.twist.linear
        vector.x, vector.y, vector.z = (float(value) for value in linear)
        self._twist.publish(message)

    def override(self, speed: float) -> None:
        """Set the speed of trajectories.

        Args:
            speed: 0 to 1.
        """
        self._speed.publish(SpeedScalingFactor(factor=speed))

    def send(self, end: Array, duration: float) -> ActionRun:
        """Send a trajectory to a pose, at rest there, and wait until it is accepted.

        Args:
            end: Positions in [rad].
            duration: Its time in [s].

        Raises:
            CallError: It was refused, or nobody answers.
            GivenUpError: It is no longer wanted.
        """
        rest = [0.0] * len(end)
        point = JointTrajectoryPoint(positions=end.tolist(), velocities=rest, accelerations=rest)
        point.time_from_start.sec = int(duration)
        point.time_from_start.nanosec = round(duration % 1.0 * 1e9)
        names = list(self._model.joints)
        goal = FollowJointTrajectory.Goal(
            trajectory=JointTrajectory(joint_names=names, points=[point])
        )
        return ActionRun(self, self._action, goal, self._action_name)

    def _state(self, message: JointTrajectoryControllerState) -> None:
        position, velocity, acceleration = (
            np.array(values)
            for values in (
                message.reference.positions,
                message.reference.velocities,
                message.reference.accelerations,
            )
        )
        measured = np.array(message.feedback.positions)
        stamp = message.header.stamp
        sample = Sample(
            stamp.sec + 1e-9 * stamp.nanosec,
            position,
            velocity,
            acceleration,
            measured,
            message.speed_scaling_factor,
            self._model.pose(position).position,
            self._model.pose(measured).position,
        )
        self._show(sample)
        self.samples.append(sample)

    def _show(self, sample: Sample) -> None:
        if not isinstance(self.figures, MotionFigures):
            return
        speed, jerk = 0.0, 0.0
        if self.samples:
            before = self.samples[-1]
            cycles = max(cycles_between(before, sample, self._period), 1)
            way = float(np.linalg.norm(sample.tool - before.tool))
            speed = way / (cycles * self._period)
            jerk = peak_jerk([before, sample], self._period, self._model.limits.jerk)
        self.figures = replace(
            self.figures,
            axes={name: AxisFigures(active=True) for name in self._model.joints},
            tool_speed=speed,
            override=sample.speed,
            jerk=max(self.figures.jerk, jerk),
            words=self.words,
        )

    def _status(self, message: ServoStatus) -> None:
        self.words = message.message
        if message.code > 0:
            self.limited.append(message.message)
