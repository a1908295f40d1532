# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Joint states as a master publishes them: of drives, of their channels and of the robot."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
import time
from typing import cast

from isolation import Isolation
import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.time import Time
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from arm_canopen import CanopenError
from arm_canopen.cia402.state import AxisState
from arm_canopen.nodes.joint_state_publisher import BusJointStates, DriveJointStates
from arm_canopen.nodes.output_thread import OutputThread

pytestmark = pytest.mark.slow

DEADLINE = 10.0  # [s] for what takes milliseconds
URDF = """<robot name="r"><link name="a"/><link name="b"/><link name="c"/><link name="d"/>
<joint name="elbow" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<joint name="shoulder" type="continuous"><parent link="b"/><child link="c"/>
<axis xyz="0 0 1"/></joint>
<joint name="finger" type="prismatic"><parent link="c"/><child link="d"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/>
<mimic joint="elbow" multiplier="2"/></joint></robot>"""


@dataclass
class Axis:
    """What is needed of the state of an axis."""

    name: str
    position: float
    velocity: float = 0.0
    effort: float = 0.0
    fresh: bool = True


class Scene:
    """A node with the joint states of one drive of two channels, and who listens to them."""

    def __init__(self, node: Node) -> None:
        """Make them."""
        self.node = node
        self.axes = [Axis('shoulder', 0.1, 0.2, 0.3), Axis('elbow', 0.4, 0.5, 0.6)]
        self.drive = DriveJointStates(node, cast('list[AxisState]', self.axes))
        self.output = OutputThread(node.get_logger())  # type: ignore[no-untyped-call]
        self.bus = BusJointStates(node, [self.drive], self.output)
        self.received: dict[str, JointState] = {}
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(node)
        self.output.start()

    def listen(self, topic: str) -> None:
        """Receive a topic."""
        self.node.create_subscription(
            JointState, topic, partial(self.received.__setitem__, topic), 10
        )

    def cycle(self, until: Callable[[], bool], sync_age: float = 0.0) -> None:
        """Run cycles until something holds."""
        deadline = time.monotonic() + DEADLINE
        while not until():
            self.bus.update_listeners()
            self.bus.feedback(time.monotonic() - sync_age)
            self._executor.spin_once(timeout_sec=0.02)
            assert time.monotonic() < deadline


@pytest.fixture
def scene(isolation: Isolation) -> Iterator[Scene]:
    """A scene in a ROS domain of its own."""
    rclpy.init(domain_id=isolation.domain_id)
    scene = Scene(Node('joint1'))
    yield scene
    scene.output.stop()
    scene.node.destroy_node()  # type: ignore[no-untyped-call]
    rclpy.shutdown()


def test_each_channel_has_the_joint_states_of_a_drive(scene: Scene) -> None:
    """Under its own name, which is that of a joint, beside those of the whole device."""
    for topic in ('joint1', 'shoulder', 'elbow'):
        scene.listen(f'/{topic}/joint_states')
    scene.cycle(lambda: len(scene.received) == 3)
    whole, elbow, shoulder = (
        scene.received[f'/{topic}/joint_states'] for topic in ('joint1', 'elbow', 'shoulder')
    )
    assert [*whole.name] == ['shoulder', 'elbow']
    assert [*whole.position] == [0.1, 0.4]
    assert [*elbow.name] == ['elbow']
    assert [elbow.position[0], elbow.velocity[0]] == [0.4, 0.5]
    assert [*shoulder.effort] == [0.3]
    assert not scene.node.get_publishers_info_by_topic('/joint_states')  # by default


def test_the_joints_of_the_robot_have_the_stamp_of_the_sync(scene: Scene) -> None:
    """All in one message, in the order of bus.yml as long as no URDF is known."""
    scene.bus.publish_robot('')
    scene.listen('/joint_states')
    scene.cycle(lambda: bool(scene.received), sync_age=5.0)
    message = scene.received['/joint_states']
    assert [*message.name] == ['shoulder', 'elbow']
    assert [*message.position] == [0.1, 0.4]
    age = scene.node.get_clock().now() - Time.from_msg(message.header.stamp)
    assert age.nanoseconds >= 5_000_000_000


def test_the_urdf_gives_the_order_and_joints_that_mimic(scene: Scene) -> None:
    """From the topic of robot_state_publisher."""
    latched = QoSProfile(  # type: ignore[no-untyped-call]
        depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL
    )
    scene.bus.publish_robot('')
    scene.listen('/joint_states')
    scene.node.create_publisher(String, 'robot_description', latched).publish(String(data=URDF))
    names = ['elbow', 'shoulder', 'finger']
    scene.cycle(lambda: bool(scene.received) and [*scene.received['/joint_states'].name] == names)
    assert [*scene.received['/joint_states'].position] == [0.4, 0.1, 0.8]


@pytest.mark.parametrize(
    ('first', 'published'),
    [('lid', ['lid', 'tool', 'left', 'right']), ('elbow', ['elbow', 'finger'])],
)
def test_drives_that_the_urdf_lacks_are_named_once(
    first: str, published: list[str], scene: Scene, capfd: pytest.CaptureFixture[str]
) -> None:
    """They keep their own topics; where it lacks all of them, that of the robot, too."""
    names = [(first, 'tool'), ('left', 'right')]
    drives = [
        DriveJointStates(scene.node, cast('list[AxisState]', [Axis(axis, 0.7) for axis in axes]))
        for axes in names
    ]
    scene.bus = BusJointStates(scene.node, drives, scene.output)
    scene.bus.publish_robot(URDF)
    topics = ['/joint_states', *(f'/{axis}/joint_states' for axes in names for axis in axes)]
    for topic in topics:
        scene.listen(topic)
    scene.cycle(lambda: len(scene.received) == len(topics))
    assert [*scene.received['/joint_states'].name] == published
    (line,) = [line for line in capfd.readouterr().err.splitlines() if 'tool' in line]
    assert ('elbow, shoulder, finger' in line) == (first == 'lid')


def test_a_drive_that_is_not_fresh_is_left_out_after_a_while(scene: Scene) -> None:
    """What is not known is not invented; the drive comes back with its TPDOs."""
    other = Axis('wrist', 0.7)
    drives = [scene.drive, DriveJointStates(scene.node, cast('list[AxisState]', [other]))]
    scene.bus = BusJointStates(scene.node, drives, scene.output)
    scene.bus.publish_robot('')
    scene.listen('/joint_states')

    def published() -> list[str]:
        return [*scene.received['/joint_states'].name] if scene.received else []

    scene.cycle(lambda: published() == ['shoulder', 'elbow', 'wrist'])
    other.fresh = False
    scene.cycle(lambda: published() == ['shoulder', 'elbow'])
    other.fresh = True
    scene.cycle(lambda: published() == ['shoulder', 'elbow', 'wrist'])


@pytest.mark.parametrize(
    ('text', 'words'),
    [('<robot>', 'no XML'), ('<robot name="r"><link name="a"/></robot>', 'no revolute')],
)
def test_a_text_that_is_no_robot_is_refused(scene: Scene, text: str, words: str) -> None:
    """The parameter robot_description, before anything runs."""
    with pytest.raises(CanopenError, match=words):
        scene.bus.publish_robot(text)
