# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Several robots in one ROS domain on one machine, each with its operator and a namespace."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
import os
from pathlib import Path
import shutil
import signal
from typing import Any

from ament_index_python.packages import get_package_share_directory
from control_msgs.msg import JointJog
from isolation import Isolation
from nav_msgs.msg import Odometry
from processes import executable, find_children, RunningProcess
import pytest
from rclpy.qos import qos_profile_sensor_data
from ros_client import RosClient
from sensor_msgs.msg import JointState
from tf2_msgs.msg import TFMessage

from quad_msgs.srv import SetMode

pytestmark = [pytest.mark.scenario, pytest.mark.timeout(240)]

STARTING = 90.0  # [s] several robots on a busy machine
MOVING = 40.0  # [s] the same
GLOBAL = {'/tf', '/tf_static', '/rosout', '/parameter_events'}
"""Topics that all robots share, as tf2 and rclpy name them."""


class Robot:
    """A robot in a namespace.

    Attributes:
        name: The namespace.
        cycles: Programs of it that own a cycle.
        ending: What its bring-up prints at the end.
        client: The test's own node.
        bringup: Its processes.
    """

    package: str
    ready: str
    cycles: tuple[str, str]
    ending = ''

    def __init__(self, name: str, isolation: Isolation, client: RosClient, *command: str) -> None:
        self.name, self.client = name, client
        program = [executable(self.package, 'bringup'), *command, '--simulate']
        arguments = ['--namespace', name, '--timeout', f'{STARTING:g}']
        self.bringup = RunningProcess([*program, *arguments], isolation.env)

    def place(self) -> tuple[float, ...]:
        """Return where it is, in [m] or [rad]; nothing before that is known."""
        raise NotImplementedError

    def move(self) -> None:
        """Do what its operator does again and again to move it."""
        raise NotImplementedError


class Arm(Robot):
    """The Panda, whose first joint is jogged."""

    package, ready = 'arm_bringup', 'are enabled'
    cycles = ('fake_slaves', 'motion_node')

    def __init__(self, name: str, isolation: Isolation, client: RosClient, folder: Path) -> None:
        """Copy the robot with a slower cycle, so that two leave the machine time."""
        robot = folder / f'{name}_robot' / 'panda'
        shutil.copytree(Path(get_package_share_directory('arm_bringup'), 'robots/panda'), robot)
        bus = robot / 'bus.yml'
        text = bus.read_text()
        assert 'sync_period: 10000' in text
        bus.write_text(text.replace('sync_period: 10000', 'sync_period: 40000'))
        super().__init__(name, isolation, client, str(robot), '--enable')
        self._states = client.listen(JointState, f'/{name}/joint_states')
        topic = f'/{name}/servo_node/delta_joint_cmds'
        self._jogs = client.node.create_publisher(JointJog, topic, 10)

    def place(self) -> tuple[float, ...]:
        """Return the positions of its joints."""
        return tuple(self._states[-1].position) if self._states else ()

    def move(self) -> None:
        """Jog the first joint, as every teleop of the arm does."""
        message = JointJog(joint_names=['panda_joint1'], velocities=[0.2])
        message.header.stamp = self.client.node.get_clock().now().to_msg()
        self._jogs.publish(message)


class Dog(Robot):
    """The quadruped, lying, which stands up."""

    package, ready = 'quad_bringup', 'all is ready'
    ending = 'lying down first'
    cycles = ('hardware_node', 'controller_node')

    def __init__(self, name: str, isolation: Isolation, client: RosClient, _: Path) -> None:
        super().__init__(name, isolation, client)
        topic = f'/{name}/fake_xgo/ground_truth'
        self._truth = client.listen(Odometry, topic, qos_profile_sensor_data)
        self._modes = client.node.create_client(SetMode, f'/{name}/set_mode')

    def place(self) -> tuple[float, ...]:
        """Return its height: a robot that is simulated drifts on the ground by hairs."""
        return (self._truth[-1].pose.pose.position.z,) if self._truth else ()

    def move(self) -> None:
        """Request that it stands."""
        self._modes.call_async(SetMode.Request(mode='stand'))


REFUSED = 'has no real-time priority'
FAR = 0.01
"""Further than this has moved [m] or [rad]."""


def distance(one: Sequence[float], other: Sequence[float]) -> float:
    """Return the largest difference."""
    return max(abs(a - b) for a, b in zip(one, other, strict=True))


def moves_alone(robot: Robot, others: Sequence[Robot]) -> None:
    """Its operator moves it, and no other robot."""
    before = {each.name: each.place() for each in (robot, *others)}

    def moved() -> bool:
        return distance(robot.place(), before[robot.name]) > FAR

    timer = robot.client.node.create_timer(0.1, robot.move)
    try:
        robot.client.spin_until(moved, MOVING, 'motion')
    except AssertionError as error:
        raise AssertionError(robot.bringup.output) from error
    finally:
        robot.client.node.destroy_timer(timer)
    for other in others:
        assert distance(other.place(), before[other.name]) < FAR


def real_time_threads(pid: int) -> list[int]:
    """Return the threads of a process that have real-time priority."""
    threads = [int(task.name) for task in Path(f'/proc/{pid}/task').iterdir()]
    mask = ~os.SCHED_RESET_ON_FORK
    return [each for each in threads if os.sched_getscheduler(each) & mask == os.SCHED_FIFO]


def cycles_have_priority(robot: Robot) -> None:
    """One thread of each program with a cycle; where it is refused, a line says how to get it."""
    for program in robot.cycles:
        (process,) = find_children(robot.bringup.pid, f'/{program}')
        refused = any(REFUSED in line and program in line for line in robot.bringup.lines)
        assert len(real_time_threads(process.pid)) == (0 if refused else 1), program


def frames_of(client: RosClient, robots: Sequence[Robot]) -> None:
    """All transforms have the prefix of their robot; no frame is in two robots."""
    frames: set[str] = set()

    def take(message: TFMessage) -> None:
        for transform in message.transforms:
            frames.update((transform.child_frame_id, transform.header.frame_id))

    subscription = client.node.create_subscription(TFMessage, '/tf', take, 100)
    names = {robot.name for robot in robots}
    client.spin_until(
        lambda: {frame.partition('/')[0] for frame in frames} >= names, 20.0, f'frames of {names}'
    )
    client.node.destroy_subscription(subscription)
    assert {frame.partition('/')[0] for frame in frames} == names


def outside(client: RosClient, robots: Sequence[Robot]) -> set[str]:
    """Return topics and services in no robot's namespace."""
    mine = f'{client.node.get_fully_qualified_name()}/'
    pairs: list[Any] = [
        *client.node.get_topic_names_and_types(),
        *client.node.get_service_names_and_types(),
    ]
    inside = (*(f'/{robot.name}/' for robot in robots), mine)
    return {name for name, _ in pairs if not name.startswith(inside)} - GLOBAL


def test_robots_of_one_domain(isolation: Isolation, tmp_path: Path) -> None:
    """Each is moved by its own operator and stopped without the others noticing."""
    with ExitStack() as stack:
        client = stack.enter_context(RosClient(isolation.domain_id))
        kinds = {'arm0': Arm, 'dog1': Dog, 'arm2': Arm}
        robots = [kind(name, isolation, client, tmp_path) for name, kind in kinds.items()]
        for robot in robots:
            stack.enter_context(robot.bringup)
        for robot in robots:
            robot.bringup.wait_for(robot.ready, STARTING)
        for robot in robots:
            cycles_have_priority(robot)
        client.spin_until(lambda: all(each.place() for each in robots), 20.0, 'all robots')
        assert outside(client, robots) == set()
        frames_of(client, robots)
        while robots:
            first, *rest = robots
            moves_alone(first, rest)
            first.bringup.signal(signal.SIGINT)
            assert first.bringup.wait(40.0) == 0, first.bringup.output
            assert first.ending in first.bringup.output
            assert all(each.bringup.is_running() for each in rest)
            robots = rest
