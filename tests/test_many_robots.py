# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Several robots in one ROS domain on one machine, each with its operator and a namespace."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, ExitStack
from pathlib import Path
import shutil
import signal
from typing import Any

from ament_index_python.packages import get_package_share_directory
from control_msgs.msg import JointJog
from isolation import Isolation
from nav_msgs.msg import Odometry
from processes import executable, RunningProcess
import pytest
from rclpy.qos import qos_profile_sensor_data
from ros_client import RosClient
from sensor_msgs.msg import JointState
from tf2_msgs.msg import TFMessage
from tmux_pane import Pane

pytestmark = [
    pytest.mark.scenario,
    pytest.mark.timeout(240),
    pytest.mark.skipif(shutil.which('tmux') is None, reason='needs tmux, for real key presses'),
]

STARTING = 90.0  # [s] several robots on a busy machine
MOVING = 40.0  # [s] the same
GLOBAL = {'/tf', '/tf_static', '/rosout', '/parameter_events'}
"""Topics that all robots share, as tf2 and rclpy name them."""


class Robot(ABC):
    """A robot in a namespace.

    Attributes:
        name: The namespace.
        bringup: Its processes.
    """

    package: str
    ready: str
    repeat = 0.05  # [s] between two commands of its operator

    def __init__(self, name: str, isolation: Isolation, client: RosClient, folder: Path) -> None:
        """Start the bring-up; listen to the robot."""
        self.name = name
        self.client = client
        self._folder, self._isolation = folder, isolation
        arguments = [*self.arguments(), '--namespace', name, '--timeout', f'{STARTING:g}']
        self.bringup = RunningProcess(
            [executable(self.package, 'bringup'), *arguments], isolation.env
        )
        self.listen()

    @abstractmethod
    @contextmanager
    def operator(self) -> Iterator[Callable[[], object]]:
        """Let a person come; yield what he does again and again to move the robot."""

    @abstractmethod
    def arguments(self) -> Sequence[str]:
        """Return those of its bring-up."""

    @abstractmethod
    def listen(self) -> None:
        """Listen to what shows whether it moves."""

    @abstractmethod
    def place(self) -> tuple[float, ...]:
        """Return where it is, in [m] or [rad]."""


class Arm(Robot):
    """The Panda."""

    package, ready = 'arm_bringup', 'are enabled'

    def arguments(self) -> Sequence[str]:
        """Return a copy of the robot with a slower cycle, so that two leave the machine time."""
        robot = self._folder / f'{self.name}_robot' / 'panda'
        shutil.copytree(Path(get_package_share_directory('arm_bringup'), 'robots/panda'), robot)
        bus = robot / 'bus.yml'
        text = bus.read_text()
        assert 'sync_period: 10000' in text
        bus.write_text(text.replace('sync_period: 10000', 'sync_period: 40000'))
        return [str(robot), '--simulate', '--enable']

    def listen(self) -> None:
        """The positions of its joints."""
        self._states = self.client.listen(JointState, f'/{self.name}/joint_states')

    def place(self) -> tuple[float, ...]:
        """Return the positions of its joints."""
        return tuple(self._states[-1].position) if self._states else ()

    @contextmanager
    def operator(self) -> Iterator[Callable[[], object]]:
        """Jog the first joint, as every teleop of the arm does."""
        node = self.client.node
        topic = f'/{self.name}/servo_node/delta_joint_cmds'
        publisher = node.create_publisher(JointJog, topic, 10)

        def jog() -> None:
            message = JointJog(joint_names=['panda_joint1'], velocities=[0.2])
            message.header.stamp = node.get_clock().now().to_msg()
            publisher.publish(message)

        yield jog  # the publisher stays: the last callback of a timer may come after its end


class Dog(Robot):
    """The quadruped, lying."""

    package, ready = 'quad_bringup', 'all is ready'
    repeat = 1.0  # [s] each key is a process of tmux

    def arguments(self) -> Sequence[str]:
        """Return that it is one in physics."""
        return ['--simulate']

    def listen(self) -> None:
        """Where its body is, in physics."""
        topic = f'/{self.name}/fake_xgo/ground_truth'
        self._truth = self.client.listen(Odometry, topic, qos_profile_sensor_data)

    def place(self) -> tuple[float, ...]:
        """Return its height: a robot that is simulated drifts on the ground by hairs."""
        if not self._truth:
            return ()
        return (self._truth[-1].pose.pose.position.z,)

    @contextmanager
    def operator(self) -> Iterator[Callable[[], object]]:
        """Let it stand up, by a key of its teleop."""
        folder = self._folder / self.name
        folder.mkdir()
        pane = Pane(folder, dict(self._isolation.env))
        try:
            namespace = f'--ros-args -r __ns:=/{self.name}'
            pane.press(f'ros2 run quad_teleop teleop_keyboard {namespace}', 'Enter')
            pane.wait_for(r'idle +\|')
            yield lambda: pane.press('1')
        finally:
            pane.stop()


KINDS: dict[str, Callable[..., Robot]] = {'arm': Arm, 'dog': Dog}
FAR = 0.01
"""Further than this has moved [m] or [rad]."""


def distance(one: Sequence[float], other: Sequence[float]) -> float:
    """Return the largest difference."""
    return max(abs(a - b) for a, b in zip(one, other, strict=True))


def moves_alone(robot: Robot, others: Sequence[Robot]) -> None:
    """Its operator moves it, and no other robot."""
    with robot.operator() as move:
        before = {each.name: each.place() for each in (robot, *others)}

        def moved() -> bool:
            return distance(robot.place(), before[robot.name]) > FAR

        timer = robot.client.node.create_timer(robot.repeat, move)
        try:
            robot.client.spin_until(moved, MOVING, 'motion')
        except AssertionError as error:
            raise AssertionError(robot.bringup.output) from error
        finally:
            robot.client.node.destroy_timer(timer)
        for other in others:
            assert distance(other.place(), before[other.name]) < FAR


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


@pytest.mark.parametrize('kinds', [('arm', 'dog', 'arm')], ids='-'.join)
def test_robots_of_one_domain(kinds: Sequence[str], isolation: Isolation, tmp_path: Path) -> None:
    """Each is moved by its own operator and stopped without the others noticing."""
    with ExitStack() as stack:
        client = stack.enter_context(RosClient(isolation.domain_id))
        robots = [
            KINDS[kind](f'{kind}{number}', isolation, client, tmp_path)
            for number, kind in enumerate(kinds)
        ]
        for robot in robots:
            stack.enter_context(robot.bringup)
        for robot in robots:
            robot.bringup.wait_for(robot.ready, STARTING)
        client.spin_until(lambda: all(each.place() for each in robots), 20.0, 'all robots')
        assert outside(client, robots) == set()
        frames_of(client, robots)
        while robots:
            first, *rest = robots
            moves_alone(first, rest)
            first.bringup.signal(signal.SIGINT)
            assert first.bringup.wait(40.0) == 0, first.bringup.output
            assert all(each.bringup.is_running() for each in rest)
            robots = rest
