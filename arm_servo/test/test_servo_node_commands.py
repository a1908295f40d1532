# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the topics of the servo become: who gets the drives back, for how long, how fast."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Future
import math
import time
from typing import Any

from control_msgs.msg import JointJog
from geometry_msgs.msg import PoseStamped, TransformStamped, TwistStamped
from isolation import Isolation
from model_robots import table, texts
import pytest
import rclpy
from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.parameter import Parameter
from servo_drives import Drives
from tf2_msgs.msg import TFMessage

from arm_model import RobotModel
from arm_servo import JogRequest, PoseCommand, TwistCommand
from arm_servo.ros.servo.node import Servo
from arm_servo.ros.servo.parameters import declare_servo, PREFIX

TWIST, JOG, POSE = 'delta_twist_cmds', 'delta_joint_cmds', 'pose_target_cmds'
TIMEOUT = 0.5
WORLD = '<virtual_joint name="v" type="fixed" parent_frame="world" child_link="panda_link0"/>'
URDF, SRDF = texts('panda')
HELD = RobotModel(URDF, SRDF.replace('</robot>', f'{WORLD}</robot>'), table('panda'))
"""The Panda, in the world of a virtual joint as the Setup Assistant writes it."""


def parameter(name: str, value: float) -> Parameter:
    """Return a parameter of the servo."""
    return Parameter(PREFIX + name, value=value)  # type: ignore[no-untyped-call]


class Topics:
    """The servo of drives that follow, and what it gives to the gateway.

    Attributes:
        prepared: How often the drives were asked for.
        requests: Jogs so far.
    """

    def __init__(self, node: Node, monkeypatch: pytest.MonkeyPatch) -> None:
        self.node = node
        self.prepared = 0
        self.requests: list[JogRequest] = []
        self.drives = Drives(model=HELD)
        self.drives.attach()
        self.drives.run(2)
        gateway = self.drives.gateway
        monkeypatch.setattr(gateway, 'command', self._jog)
        timeout = parameter('incoming_command_timeout', TIMEOUT)
        node._parameter_overrides[timeout.name] = timeout
        parameters = declare_servo(node, gateway.model)
        self._servo = Servo(node, gateway, parameters, self._prepare)

    def _prepare(self) -> None:
        self.prepared += 1

    def _jog(self, request: JogRequest, get_ready: Callable[[], None]) -> Future[None]:
        get_ready()
        self.requests.append(request)
        return Future()

    def send(self, topic: str, message: Any, age: float = 0.0) -> None:
        """Deliver a message that was sent some time ago in [s]."""
        sent = self.node.get_clock().now() - Duration(nanoseconds=round(age * 1e9))
        message.header.stamp = sent.to_msg()
        (taken,) = (each for each in self.node.subscriptions if each.topic_name.endswith(topic))
        taken.callback(message)


@pytest.fixture
def topics(isolation: Isolation, monkeypatch: pytest.MonkeyPatch) -> Iterator[Topics]:
    """A servo_node whose messages the test hands over."""
    context = Context()
    rclpy.init(context=context, domain_id=isolation.domain_id)
    node: Any = Node('servo_node', context=context, enable_rosout=False)
    try:
        yield Topics(node, monkeypatch)
    finally:
        node.destroy_node()
        rclpy.shutdown(context=context)


def twist(speed: float) -> TwistStamped:
    """Return a twist along x."""
    message = TwistStamped()
    message.twist.linear.x = speed
    return message


def test_a_stream_of_zeros_takes_no_drives_back(topics: Topics) -> None:
    """An idle joystick leaves halted drives halted; whoever moves it gets them."""
    for _ in range(5):
        topics.send(TWIST, twist(0.0))
        topics.send(JOG, JointJog(joint_names=['panda_joint1'], velocities=[0.0]))
    assert topics.prepared == 0
    topics.send(TWIST, twist(0.5))
    assert topics.prepared == 1


def test_the_world_of_the_srdf_is_a_frame(topics: Topics) -> None:
    """The planning frame of MoveIt, in which its servo takes twists, is in no /tf."""
    for frame in ('world', 'panda_link0', 'moon'):
        message = twist(0.5)
        message.header.frame_id = frame
        topics.send(TWIST, message)
    twists = [each.command for each in topics.requests if isinstance(each.command, TwistCommand)]
    assert [(each.link, each.axes) for each in twists] == [(None, None)] * 2


def test_tf_decides_where_the_world_is(topics: Topics) -> None:
    """An arm may stand on a pedestal: static_transform_publisher says so."""
    placed = TransformStamped(child_frame_id='panda_link0')
    placed.header.frame_id = 'world'
    placed.transform.rotation.x, placed.transform.rotation.w = 1.0, 0.0
    (static,) = (each for each in topics.node.subscriptions if each.topic_name == '/tf_static')
    static.callback(TFMessage(transforms=[placed]))
    message = twist(0.5)
    message.header.frame_id = 'world'
    topics.send(TWIST, message)
    (request,) = topics.requests
    assert isinstance(request.command, TwistCommand)
    assert request.command.axes is not None
    assert request.command.axes.diagonal() == pytest.approx([1.0, -1.0, -1.0])


def test_displacements_that_come_faster_than_they_begin_add_up(topics: Topics) -> None:
    """Within limits none is refused or late: those that wait become one; a wrong one is alone."""
    joints = ['panda_joint1', 'panda_joint2']
    drives, begin = topics.drives, topics.drives.path[-1]
    for number in range(150):
        joint = joints[number % 2]
        topics.send(JOG, JointJog(joint_names=[joint], displacements=[0.001]))
        topics.send(JOG, JointJog(joint_names=[joint], displacements=[math.nan]))
        topics.send(JOG, JointJog(joint_names=['elbow'], displacements=[0.001]))
        drives.run()
    drives.run(100)
    assert (drives.path[-1] - begin)[:2] == pytest.approx([0.075, 0.075], abs=1e-6)


def test_a_displacement_that_does_not_fit_is_refused_alone(topics: Topics) -> None:
    """Those before it are carried out to the limit, and one that leads back from there."""
    drives = topics.drives
    limit = float(drives.gateway.model.limits.upper[0])
    near = limit - 0.055 - drives.path[-1][0]
    for ways in ([near], [0.01] * 10 + [9.0, -0.02], [0.02, 9.0]):
        for way in ways:
            topics.send(JOG, JointJog(joint_names=['panda_joint1'], displacements=[way]))
        drives.run(1000)
    assert limit - drives.path[-1][0] == pytest.approx(0.005, abs=1e-6)
    # also when the one before it begins afterwards
    assert 'panda_joint1: ' in topics._servo._refusals.fresh(0.0)


def test_a_displacement_of_zero_keeps_those_that_wait(topics: Topics) -> None:
    """Also that they get the drives."""
    begin = topics.drives.path[-1][0]
    for way in (0.01, 0.01, 0.0):
        topics.send(JOG, JointJog(joint_names=['panda_joint1'], displacements=[way]))
    topics.drives.run(200)
    assert topics.drives.path[-1][0] - begin == pytest.approx(0.02, abs=1e-6)
    assert topics.prepared == 2


def test_displacements_before_a_stop_do_not_come_back_with_the_next(topics: Topics) -> None:
    """Also those that waited."""
    step = JointJog(joint_names=['panda_joint1'], displacements=[0.01])
    for _ in range(20):
        topics.send(JOG, step)
    topics.drives.gateway.interrupt('a stop')
    topics.send(JOG, JointJog(joint_names=['panda_joint1'], displacements=[0.0]))
    topics.drives.run(200)
    stands = topics.drives.path[-1][0]
    topics.send(JOG, step)
    topics.drives.run(200)
    assert topics.drives.path[-1][0] - stands == pytest.approx(0.01, abs=1e-6)


@pytest.mark.parametrize(
    ('topic', 'message'),
    [
        (TWIST, twist(0.5)),
        (JOG, JointJog(joint_names=['panda_joint1'], velocities=[0.5])),
        (POSE, PoseStamped()),
    ],
)
def test_a_command_lives_from_when_it_was_sent(topics: Topics, topic: str, message: Any) -> None:
    """What is nearly stale when it arrives expires soon, and not a whole time-out later."""
    if isinstance(message, PoseStamped):
        message.pose.orientation.w = 1.0
    topics.send(topic, message, TIMEOUT - 0.2)
    (request,) = topics.requests
    assert 0.0 < request.expires - time.monotonic() <= 0.2


def test_a_change_of_the_scales_counts_for_the_next_pose(topics: Topics) -> None:
    """The speed of the tool and the override, while the servo runs."""
    message = PoseStamped()
    message.pose.orientation.w = 1.0
    changes = {'scale.linear': 0.06, 'override_velocity_scaling_factor': 0.5}
    topics.node.set_parameters([parameter(name, value) for name, value in changes.items()])
    topics.send(POSE, message)
    command = topics.requests[-1].command
    assert isinstance(command, PoseCommand)
    assert command.linear_speed == pytest.approx(0.03)
