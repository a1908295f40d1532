# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""/odom and /imu of a walk, fused as robot_localization does with a URDF of one's own."""

from __future__ import annotations

from collections import defaultdict
import math
import time
from types import SimpleNamespace
from typing import Any

from nav_msgs.msg import Odometry
import numpy as np
from numpy.typing import NDArray
import pytest
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import Imu
from sim_serial import Line

from quad_controller import Controller, GaitParameters, StateParameters, Velocity
from quad_description import movable_joints, quadruped, robot_urdf, RobotState
from quad_description.rotations import conjugate, from_rpy, multiply, rotate, yaw_of
from quad_hardware.backend import ReplayedRobot
from quad_hardware.estimation import Estimator, EstimatorSettings, ImuMounting
from quad_hardware.joints import JointMap, servo_of
from quad_hardware.link import LinkOptions
from quad_hardware.nodes.parameters import Deviations, Frames
from quad_hardware.nodes.robot_topics import RobotTopics
from quad_hardware.protocol import Protocol, V1, V2
from quad_hardware.serial_robot import RobotSettings
from quad_sim.physics import Robot

Array = NDArray[np.float64]

IMU_RPY = (math.pi, 0.0, 2.0)
URDF = robot_urdf().replace(
    '<joint name="imu_joint" type="fixed">\n    <origin rpy="0 0 0"',
    f'<joint name="imu_joint" type="fixed">\n    <origin rpy="{" ".join(map(str, IMU_RPY))}"',
)
"""A robot whose imu_link lies upside down and turned."""
SETTINGS = EstimatorSettings(mounting=ImuMounting(checked=True, rates_checked=True))
PERIOD = 0.02  # [s]


class Filter:
    """robot_localization's filter in two dimensions: x, y, yaw in odom; vx, vy, vyaw in base_link.

    Prediction and update (Joseph's form) are those of its ``ekf.cpp``, the noise of the process
    that of its ``ekf.yaml``, in [1/s], but for vyaw (0.02): a body that trots turns to and fro.
    """

    noise = np.diag([0.05, 0.05, 0.06, 0.025, 0.025, 0.5])

    def __init__(self) -> None:
        self.state, self.covariance, self.time = np.zeros(6), 1e-9 * np.eye(6), 0.0
        self.innovations = defaultdict[str, list[float]](list)  # squared, each by its covariance

    def update(
        self, name: str, now: float, places: list[int], values: list[float], noise: Array
    ) -> None:
        """Predict the state at a time [s], and correct it by a measurement."""
        dt, self.time = (now - self.time if self.time else 0.0), now
        sin, cos = math.sin(self.state[2]), math.cos(self.state[2])
        change, selects = np.eye(6), np.eye(6)[places]
        change[:3, 3:] = dt * np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
        x, y, _ = way = change[:3, 3:] @ self.state[3:]
        self.state[:3] += way
        change[:2, 2] = -y, x
        self.covariance = change @ self.covariance @ change.T + dt * self.noise
        innovation = np.array(values) - selects @ self.state  # no yaw comes near to half a turn
        spread = selects @ self.covariance @ selects.T + noise
        squared = innovation @ np.linalg.solve(spread, innovation) / len(places)
        self.innovations[name].append(float(squared))
        gain = self.covariance @ selects.T @ np.linalg.inv(spread)
        self.state += gain @ innovation
        left = np.eye(6) - gain @ selects
        self.covariance = left @ self.covariance @ left.T + gain @ noise @ gain.T


def part(covariance: Any, *places: int) -> Array:
    """Return a part of a covariance, which is symmetrical with variances above zero."""
    size = math.isqrt(len(covariance))
    matrix: Array = np.array(covariance).reshape(size, size)
    assert (matrix == matrix.T).all()
    assert (np.diag(matrix) > 0.0).all()
    return matrix[np.ix_(places, places)]


def fuse(fused: Filter, odom: Odometry, imu: Imu, *, placed: bool) -> None:
    """Give a filter what was published; imu_link is where the URDF has it."""
    assert (odom.header.frame_id, odom.child_frame_id) == ('odom', 'base_link')
    assert (imu.header.frame_id, imu.header.stamp) == ('imu_link', odom.header.stamp)
    now = odom.header.stamp.sec + 1e-9 * odom.header.stamp.nanosec
    turned, rate, mounted = imu.orientation, imu.angular_velocity, from_rpy(*IMU_RPY)
    attitude = multiply((turned.x, turned.y, turned.z, turned.w), conjugate(mounted))
    _, _, turning = rotate(mounted, (rate.x, rate.y, rate.z))
    noises = part(imu.orientation_covariance, 2), part(imu.angular_velocity_covariance, 2)
    noise = np.diag([float(each[0, 0]) for each in noises])
    fused.update('imu', now, [2, 5], [yaw_of(attitude), turning], noise)
    pose, speed = odom.pose.pose, odom.twist.twist.linear
    fused.update('twist', now, [3, 4], [speed.x, speed.y], part(odom.twist.covariance, 0, 1))
    place, turned = pose.position, pose.orientation
    places = [place.x, place.y, yaw_of((turned.x, turned.y, turned.z, turned.w))]
    covariance = part(odom.pose.covariance, 0, 1, 5)
    if placed:
        fused.update('pose', now, [0, 1, 2], places, covariance)


@pytest.mark.slow
@pytest.mark.parametrize('protocol', [V1, V2], ids=lambda protocol: protocol.name)
def test_robot_localization_finds_the_robot_by_odom_and_imu(protocol: Protocol) -> None:
    """Round a bend and sideways: within 10 % of the way, and surprises as its covariances say.

    By a filter that is given the twist alone, and by one that is given the pose, too.
    """
    line = Line('--start', 'stand', '--protocol', protocol.name, protocol=protocol)
    joints, plant = JointMap(map(servo_of, movable_joints(URDF))), line.robot.simulation.plant
    estimator, messages = Estimator(URDF, joints, SETTINGS), dict[str, Any]()
    filters = {placed: Filter() for placed in (False, True)}
    controller = Controller(quadruped(URDF), GaitParameters(), StateParameters())

    def create_publisher(kind: Any, topic: str, _: object) -> Any:
        return SimpleNamespace(publish=lambda data: messages.update({topic: (data, kind)}))

    clock = SimpleNamespace(now=lambda: SimpleNamespace(nanoseconds=round(line.now() * 1e9)))
    node: Any = SimpleNamespace(create_publisher=create_publisher, get_clock=lambda: clock)
    observed = ReplayedRobot(RobotSettings(LinkOptions('no port'), URDF, joints))
    topics = RobotTopics(
        *(node, observed, Frames(), Deviations()),
        steady=lambda moment: time.monotonic() - line.now() + moment,
    )

    def walk(duration: float, velocity: Velocity) -> tuple[Array, list[Array]]:
        end, state = line.now() + duration, RobotState()
        while line.now() < end:
            line.wait_until(line.now() + PERIOD)
            for report in line.reports():
                state = estimator.step(report) or RobotState()
                topics.publish(state)
                odom, imu = (deserialize_message(*messages[topic]) for topic in ('odom', 'imu'))
                for placed, fused in filters.items():
                    fuse(fused, odom, imu, placed=placed)
            controller.set_velocity(velocity)
            targets = controller.step(state, PERIOD).targets
            if targets is not None:
                line.command(joints.angles(targets))
        assert isinstance(plant, Robot)
        pose = plant.base_pose
        found = [fused.state[:3].copy() for fused in filters.values()]
        return np.array([*pose.position[:2], pose.roll_pitch_yaw[2]]), found

    walk(0.2, Velocity())
    assert controller.set_mode('walk').accepted
    start, begun = walk(3.0, Velocity())
    walk(5.0, Velocity(0.2, 0.0, 0.4))
    end, ended = walk(3.0, Velocity(0.0, 0.1))
    for before, after, fused in zip(begun, ended, filters.values(), strict=True):
        error = (after - before) - (end - start)
        assert math.hypot(*error[:2]) < 0.1 * 1.3
        assert abs(error[2]) < 0.05
        for name, squared in fused.innovations.items():
            least = 0.0 if name == 'pose' else 0.02  # what is less sure than it seems is of no use
            assert least < np.mean(squared) < 2.0, name
            assert np.percentile(squared, 99) < 10.0, name
