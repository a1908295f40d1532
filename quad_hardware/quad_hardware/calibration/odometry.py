# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The scale of the odometry: the robot walks, and someone measures how far it really came."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
import math
import time
from typing import TYPE_CHECKING

from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rcl_interfaces.srv import GetParameters
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from node_runner import init_ros
from quad_description.rotations import yaw_of

from ..estimation import SCALES
from ..exceptions import NoAnswerError
from ..link import DEFAULT_PORT
from .wizard import Console, prompt_number

if TYPE_CHECKING:
    from types import TracebackType

    from typing_extensions import Self

BRING_UP = f'start it first: ros2 run quad_bringup bringup --port {DEFAULT_PORT}'
PERIOD = 0.05  # [s] between velocities
ODOMETRY_TIMEOUT = 10.0  # [s] for odometry to come
MIN_SPEED_RATIO = 0.3  # of the speed requested, below which the robot does not walk
SETTLING = 1.5  # [s] to stop


class Axis(Enum):
    """Which way is measured."""

    X = 'x'  # forward
    Y = 'y'  # to the left


@dataclass(frozen=True, slots=True)
class Place:
    """Where odometry has the robot [m], [rad]."""

    x: float
    y: float
    yaw: float

    def way(self, other: Place, axis: Axis) -> float:
        """Return how far another place is along an axis of this one [m]."""
        dx, dy = other.x - self.x, other.y - self.y
        cosine, sine = math.cos(self.yaw), math.sin(self.yaw)
        return cosine * dx + sine * dy if axis is Axis.X else cosine * dy - sine * dx


class Walker:
    """A robot that can be sent somewhere, over ROS."""

    def __init__(self) -> None:
        """Join ROS; use it in a with statement."""
        self._context = Context()
        init_ros(context=self._context)
        self._node = Node('quad_calibrate', context=self._context, enable_rosout=False)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._place: Place | None = None
        self._velocity = self._node.create_publisher(Twist, 'cmd_vel', 1)
        self._node.create_subscription(Odometry, 'odom', self._take, 10)

    def place(self) -> Place:
        """Return where odometry has the robot now.

        Raises:
            NoAnswerError: Nobody publishes /odom.
        """
        self._place = None
        deadline = time.monotonic() + ODOMETRY_TIMEOUT
        while self._place is None:
            if time.monotonic() > deadline:
                raise NoAnswerError(f'no publisher of /odom; {BRING_UP}')
            self._executor.spin_once(PERIOD)
        return self._place

    def scale(self, axis: Axis) -> float:
        """Return by what hardware_node multiplies the way along an axis now.

        Raises:
            NoAnswerError: It does not answer.
        """
        client = self._node.create_client(GetParameters, 'hardware_node/get_parameters')
        name = f'odometry.scale_{axis.value}'
        future = None
        deadline = time.monotonic() + ODOMETRY_TIMEOUT
        while time.monotonic() < deadline:
            if future is None and client.service_is_ready():
                future = client.call_async(GetParameters.Request(names=[name]))
            if future is not None and (response := future.result()) is not None:
                return float(response.values[0].double_value)
            self._executor.spin_once(PERIOD)
        raise NoAnswerError(f'hardware_node does not answer; {BRING_UP}')

    def walk(self, distance: float, speed: float, axis: Axis) -> float:
        """Walk until odometry says that a distance is done; return what it says at the end [m].

        Raises:
            NoAnswerError: The robot does not walk, or /odom fell silent.
        """
        start = self.place()
        deadline = time.monotonic() + distance / (speed * MIN_SPEED_RATIO) + ODOMETRY_TIMEOUT / 2
        try:
            while start.way(self.place(), axis) < distance:
                if time.monotonic() > deadline:
                    raise NoAnswerError(
                        'the robot does not get there; is it standing, and in mode walk '
                        "(ros2 service call /set_mode quad_msgs/srv/SetMode '{mode: walk}')?"
                    )
                self._send(speed, axis)
        finally:
            self._send(0.0, axis)
        end = time.monotonic() + SETTLING
        while (left := end - time.monotonic()) > 0:
            self._executor.spin_once(left)
        return start.way(self.place(), axis)

    def _send(self, speed: float, axis: Axis) -> None:
        message = Twist()
        setattr(message.linear, axis.value, speed)
        self._velocity.publish(message)

    def _take(self, message: Odometry) -> None:
        position, turn = message.pose.pose.position, message.pose.pose.orientation
        yaw = yaw_of((turn.x, turn.y, turn.z, turn.w))
        self._place = Place(position.x, position.y, yaw)

    def __enter__(self) -> Self:
        """Use it in a with statement."""
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Leave ROS."""
        self._executor.shutdown()
        self._node.destroy_node()
        rclpy.shutdown(context=self._context)


def calibrate_odometry(
    console: Console, walker: Walker, axis: Axis, distance: float, speed: float
) -> float:
    """Let the robot walk, ask how far it came, and return the scale that its odometry should have.

    Raises:
        NoAnswerError: The robot does not walk.
    """
    console.prompt('Mark where the robot stands, and stand clear. Enter')
    said = walker.walk(distance, speed, axis)
    console.write(f'odometry measured {said:.3f} m')
    before = walker.scale(axis)
    while True:
        scale = before * prompt_number(console, 'How far did it really come [m]?') / said
        if SCALES[0] <= scale <= SCALES[1]:
            return scale
        console.write(f'that makes a scale of {scale:.3g}, which is none; was it in metres?')
