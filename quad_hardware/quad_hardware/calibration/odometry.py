# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Odometry scale: the robot walks, and the user measures the real distance."""

from __future__ import annotations

from contextlib import closing
import math
import time

from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rcl_interfaces.srv import GetParameters

from process_supervisor import CallError
from process_supervisor.graph_client import GraphClient
from quad_description.rotations import yaw_of

from ..estimation import SCALES
from ..exceptions import NoAnswerError
from ..link import DEFAULT_PORT
from .wizard import Console, prompt_number

BRING_UP = f'start it first: ros2 run quad_bringup bringup --port {DEFAULT_PORT}'
ODOMETRY_TIMEOUT = 10.0  # [s] for odometry to come
MIN_SPEED_RATIO = 0.3  # of the speed requested, below which the robot does not walk
SETTLING = 1.5  # [s] to stop

Place = tuple[float, float, float]
"""Where odometry has the robot: x, y [m], yaw [rad]."""


def way(start: Place, end: Place, axis: str) -> float:
    """Return the distance between two positions along an axis, x or y [m]."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    cosine, sine = math.cos(start[2]), math.sin(start[2])
    return cosine * dx + sine * dy if axis == 'x' else cosine * dy - sine * dx


class Walker(GraphClient):
    """Drives a robot over ROS along one of its axes: x or y."""

    def __init__(self, axis: str) -> None:
        super().__init__('quad_calibrate', lambda: False)
        self._axis = axis
        self._places: list[Place] = []  # since the last look
        self._velocity = self.node.create_publisher(Twist, 'cmd_vel', 1)
        self.node.create_subscription(Odometry, 'odom', self._take, 10)

    def place(self) -> Place:
        """Return the present position from odometry.

        Raises:
            NoAnswerError: Nothing publishes /odom.
        """
        self._places.clear()
        try:
            self.wait_until(lambda: bool(self._places), ODOMETRY_TIMEOUT, '/odom')
        except CallError as error:
            raise NoAnswerError(f'no publisher of /odom; {BRING_UP}') from error
        return self._places[-1]

    def scale(self) -> float:
        """Return hardware_node's present odometry scale along the axis.

        Raises:
            NoAnswerError: hardware_node does not answer.
        """
        client = self.node.create_client(GetParameters, 'hardware_node/get_parameters')
        request = GetParameters.Request(names=[f'odometry.scale_{self._axis}'])
        try:
            self.wait_until(client.service_is_ready, ODOMETRY_TIMEOUT, client.srv_name)
            future = client.call_async(request)
            self.wait_until(future.done, ODOMETRY_TIMEOUT, client.srv_name)
        except CallError as error:
            raise NoAnswerError(f'hardware_node does not answer; {BRING_UP}') from error
        return float(future.result().values[0].double_value)

    def walk(self, distance: float, speed: float) -> float:
        """Drive until odometry shows a distance; return the final distance [m].

        Raises:
            NoAnswerError: The robot does not walk, or /odom fell silent.
        """
        start = self.place()
        deadline = time.monotonic() + distance / (speed * MIN_SPEED_RATIO) + ODOMETRY_TIMEOUT / 2
        try:
            while way(start, self.place(), self._axis) < distance:
                if time.monotonic() > deadline:
                    raise NoAnswerError(
                        'the robot does not get there; is it standing, and in mode walk '
                        "(ros2 service call /set_mode quad_msgs/srv/SetMode '{mode: walk}')?"
                    )
                self._send(speed)
        finally:
            self._send(0.0)
        self.listen(SETTLING)
        return way(start, self.place(), self._axis)

    def _send(self, speed: float) -> None:
        message = Twist()
        setattr(message.linear, self._axis, speed)
        self._velocity.publish(message)

    def _take(self, message: Odometry) -> None:
        position, turn = message.pose.pose.position, message.pose.pose.orientation
        yaw = yaw_of((turn.x, turn.y, turn.z, turn.w))
        self._places.append((position.x, position.y, yaw))


def calibrate_odometry(console: Console, axis: str, distance: float, speed: float) -> float:
    """Drive the robot, prompt for the real distance, and return the corrected scale.

    Raises:
        NoAnswerError: The robot does not walk.
    """
    with closing(Walker(axis)) as walker:
        before = walker.scale()
        console.prompt('Mark where the robot stands, and stand clear. Enter')
        measured = walker.walk(distance, speed)
    console.write(f'odometry measured {measured:.3f} m')
    while True:
        scale = before * prompt_number(console, 'How far did it really come [m]?') / measured
        if SCALES[0] <= scale <= SCALES[1]:
            console.write(f'odometry.scale_{axis}: {before:.4f} -> {scale:.4f}')
            return round(scale, 4)
        console.write(f'that makes a scale of {scale:.3g}, which is none; was it in metres?')
