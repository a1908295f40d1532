# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Messages of the servo's topics: units, caps, frames, how long they count, who gets drives."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import Future
import math
import time
from typing import Any

from control_msgs.msg import JointJog
import core_commands
from geometry_msgs.msg import PoseStamped, TransformStamped, TwistStamped
from isolation import Isolation
from model_robots import ready, robot, table, texts
import numpy as np
import pytest
import rclpy
from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.parameter import Parameter
from servo_commands import Drives
from tf2_msgs.msg import TFMessage

from arm_model import Array, CommandError, Pose, RobotModel
from arm_servo import JogRequest, MotionCore, PoseCommand, ServoSettings, TwistCommand
from arm_servo.ros.servo import Servo
from arm_servo.ros.servo_commands import (
    CommandConverter,
    declare_servo,
    PREFIX,
    Scales,
    ServoParameters,
    Units,
)

PERIOD = 0.01
SPEED = Scales(Units.SPEED, 0.2, 0.5, 0.5, 1.0)
UNITLESS = Scales(Units.UNITLESS, 0.2, 0.5, 0.4, 1.0)


class Frames:
    """Links of the arm, and one frame of TF beside it, turned by a quarter about z."""

    def link(self, frame: str) -> str | None:
        """Return a frame that is a link."""
        return frame if frame in robot('gp110').frames else None

    def pose(self, frame: str) -> Pose:
        """Return the pose of the table; any other frame is unknown."""
        if frame != 'table':
            raise CommandError(f'no frame {frame!r}')
        return Pose(np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]]), np.array([0.5, 0.0, 0.0]))


def converter(scales: Scales, *, about_tip: bool = True) -> CommandConverter:
    """Return what makes commands."""
    parameters = ServoParameters(
        0.005, ServoSettings(), apply_twist_commands_about_ee_frame=about_tip
    )
    frames: Any = Frames()
    return CommandConverter(robot('gp110'), frames, parameters, scales)


def twist(numbers: Sequence[float], frame: str = '') -> TwistStamped:
    """Return a twist."""
    message = TwistStamped()
    message.header.frame_id = frame
    linear, angular = message.twist.linear, message.twist.angular
    linear.x, linear.y, linear.z, angular.x, angular.y, angular.z = map(float, numbers)
    return message


def tool_twist(made: CommandConverter, message: TwistStamped) -> tuple[Array, Array]:
    """Carry a command out for a while; return the twist reached in the base, and the positions."""
    core = MotionCore(robot('gp110'))
    core.reset(ready('gp110'))
    for number in range(60):
        now = number * PERIOD
        core_commands.command(core, made.twist(message, now), now)
        core.step(number * PERIOD, PERIOD)
    state = core.state
    return core.model.jacobian(state.position) @ state.velocity, state.position


def test_unitless_numbers_are_shares_of_the_scales() -> None:
    """Half of 0.2 m/s is 0.1 m/s, within a hundredth."""
    reached, _ = tool_twist(converter(UNITLESS), twist([0, 0, 0.5, 0, 0, 0]))
    assert reached == pytest.approx([0, 0, 0.1, 0, 0, 0], abs=1e-3)


def test_speeds_are_taken_as_they_are_up_to_the_cap() -> None:
    """The direction is kept, and what was cut off is reported."""
    made = converter(SPEED)
    reached, _ = tool_twist(made, twist([0, 0.05, 0.05, 0, 0, 0]))
    assert reached == pytest.approx([0, 0.05, 0.05, 0, 0, 0], abs=1e-3)
    assert made.capped == ''
    reached, _ = tool_twist(made, twist([0, 0.3, 0.4, 0, 0, 0]))
    assert reached == pytest.approx([0, 0.12, 0.16, 0, 0, 0], abs=2e-3)
    assert '0.40x' in made.capped


def test_a_twist_in_a_frame_of_tf_is_turned() -> None:
    """X of the table is y of the base; it turns nothing."""
    reached, _ = tool_twist(converter(SPEED), twist([0.1, 0, 0, 0, 0, 0], 'table'))
    assert reached == pytest.approx([0, 0.1, 0, 0, 0, 0], abs=1e-3)


def test_a_twist_may_turn_about_the_origin_of_its_frame() -> None:
    """The tip then moves on a circle about the table, else it only turns."""
    message = twist([0, 0, 0, 0, 0, 0.1], 'table')
    turned, _ = tool_twist(converter(SPEED), message)
    assert turned == pytest.approx([0, 0, 0, 0, 0, 0.1], abs=1e-3)
    carried, at = tool_twist(converter(SPEED, about_tip=False), message)
    arm = robot('gp110').pose(at).position - Frames().pose('table').position
    wanted = [*np.cross([0, 0, 0.1], arm), 0, 0, 0.1]
    assert carried == pytest.approx(wanted, abs=3e-3)


def test_a_joint_jog_is_cut_and_scaled() -> None:
    """Twice full speed is full speed, which the scale says."""
    made = converter(UNITLESS)
    core = MotionCore(robot('gp110'))
    core.reset(ready('gp110'))
    name = core.model.joints[0]
    for number in range(60):
        request = made.jog(JointJog(joint_names=[name], velocities=[2.0]), number * PERIOD)
        assert isinstance(request, JogRequest)
        core_commands.command(core, request)
        core.step(number * PERIOD, PERIOD)
    assert core.state.velocity[0] == pytest.approx(0.4, abs=1e-3)
    assert 'cut' in made.capped


@pytest.mark.parametrize(
    ('message', 'words'),
    [
        (JointJog(joint_names=['a', 'a'], velocities=[1.0, 1.0]), 'twice'),
        (JointJog(joint_names=['a']), 'either'),
        (JointJog(joint_names=['a'], velocities=[1.0], displacements=[1.0]), 'either'),
        (JointJog(joint_names=['a'], velocities=[1.0], duration=-1.0), 'duration'),
        (JointJog(joint_names=['a'], velocities=[1.0], duration=float('nan')), 'duration'),
    ],
)
def test_a_joint_jog_that_makes_no_sense_is_refused(message: JointJog, words: str) -> None:
    """Before it reaches the core."""
    with pytest.raises(CommandError, match=words):
        converter(UNITLESS).jog(message, 0.0)


def test_a_command_expires_a_time_out_after_it_was_sent() -> None:
    """Not after it arrived: what is old already has less time; a duration counts likewise."""
    made = converter(UNITLESS)
    assert made.twist(twist([0, 0, 0.5, 0, 0, 0]), 20.0).expires == pytest.approx(20.1)
    jog = made.jog(JointJog(joint_names=['joint_1_s'], velocities=[1.0], duration=2.0), 20.0)
    assert isinstance(jog, JogRequest)
    assert jog.expires == pytest.approx(22.0)


def test_a_pose_is_approached_at_the_speeds_of_the_scales() -> None:
    """As they are now, times the override."""
    made = converter(Scales(Units.SPEED, 0.2, 0.5, 0.5, 0.5))
    message = PoseStamped()
    message.pose.orientation.w = 1.0
    command = made.pose(message, 0.0).command
    assert isinstance(command, PoseCommand)
    assert (command.linear_speed, command.angular_speed) == pytest.approx((0.1, 0.25))
    made.scales = Scales(Units.SPEED, 0.4, 0.8, 0.5, 1.0)
    command = made.pose(message, 0.0).command
    assert isinstance(command, PoseCommand)
    assert (command.linear_speed, command.angular_speed) == pytest.approx((0.4, 0.8))


def test_a_pose_is_not_approached_faster_than_its_speed() -> None:
    """Seen on the tool."""
    core = MotionCore(robot('gp110'))
    core.reset(ready('gp110'))
    here = core.model.pose(core.state.position)
    there = Pose(here.rotation, here.position + np.array((0.0, 0.3, 0.0)))
    jog = JogRequest(PoseCommand(there, 0.05, 0.8), 10.0)
    core_commands.command(core, jog)
    for number in range(200):
        core.step(number * PERIOD, PERIOD)
    speed = core.model.jacobian(core.state.position) @ core.state.velocity
    assert speed[1] == pytest.approx(0.05, rel=0.05)


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
    """The servo of drives that follow, and what it gives to the gateway."""

    def __init__(self, node: Node, monkeypatch: pytest.MonkeyPatch) -> None:
        self.node = node
        self.prepared = 0  # how often the drives were asked for
        self.requests: list[JogRequest] = []  # jogs so far
        self.drives = Drives(model=HELD).following()
        gateway = self.drives.gateway
        command = gateway.command

        def noted(request: JogRequest) -> Future[None]:
            self.requests.append(request)
            return command(request)

        monkeypatch.setattr(gateway, 'command', noted)
        gateway.get_ready = self._get_ready
        timeout = parameter('incoming_command_timeout', TIMEOUT)
        node._parameter_overrides[timeout.name] = timeout
        parameters = declare_servo(node, gateway.model)
        self._servo = Servo(node, gateway, parameters)

    def _get_ready(self) -> bool:
        self.prepared += 1
        return False

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


def test_a_stream_of_zeros_takes_no_drives_back(topics: Topics) -> None:
    """An idle joystick leaves halted drives halted; whoever moves it gets them."""
    for _ in range(5):
        topics.send(TWIST, twist((0.0, 0, 0, 0, 0, 0)))
        topics.send(JOG, JointJog(joint_names=['panda_joint1'], velocities=[0.0]))
    assert topics.prepared == 0
    topics.send(TWIST, twist((0.5, 0, 0, 0, 0, 0)))
    assert topics.prepared == 1


def test_the_world_of_the_srdf_is_a_frame(topics: Topics) -> None:
    """The planning frame of MoveIt, in which its servo takes twists, is in no /tf."""
    for frame in ('world', 'panda_link0', 'moon'):
        message = twist((0.5, 0, 0, 0, 0, 0))
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
    message = twist((0.5, 0, 0, 0, 0, 0))
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
    assert 'panda_joint1 at ' in topics._servo._refusals.fresh(0.0)


def test_displacements_before_one_into_contact_are_carried_out(topics: Topics) -> None:
    """The last would turn the hand into the forearm; those that it added to lead where asked."""
    begin = topics.drives.path[-1][5]
    for way in (-0.01, -0.01, -0.02, -1.4):
        topics.send(JOG, JointJog(joint_names=['panda_joint6'], displacements=[way]))
    topics.drives.run(300)
    assert topics.drives.path[-1][5] - begin == pytest.approx(-0.04, abs=1e-6)


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
        (TWIST, twist((0.5, 0, 0, 0, 0, 0))),
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
