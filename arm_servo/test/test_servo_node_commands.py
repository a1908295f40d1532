# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Messages of the servo's topics: units, caps, frames, how long they count, who gets drives."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import Future
import math
import time
from types import SimpleNamespace
from typing import Any

from control_msgs.msg import JointJog
from core_commands import core_of
from geometry_msgs.msg import PoseStamped, TransformStamped, TwistStamped
from isolation import Isolation
from model_robots import robot
import numpy as np
import pinocchio as pin
import pytest
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.parameter import Parameter
from servo_commands import Drives, held_panda
from servo_nodes import ros_node
from tf2_msgs.msg import TFMessage

from arm_model import Array, CommandError, Pose, RobotModel
from arm_servo import JogRequest, PoseCommand, ServoSettings, Source, TwistCommand
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
    core = core_of('gp110')
    for number in range(60):
        now = number * PERIOD
        core.command(made.twist(message, now), now)
        core.step(now, PERIOD)
    state = core.state
    return core.model.jacobian(state.position) @ state.velocity, state.position


@pytest.mark.parametrize(
    ('scales', 'asked', 'frame', 'wanted', 'capped'),
    [
        (UNITLESS, [0, 0, 0.5, 0, 0, 0], '', [0, 0, 0.1, 0, 0, 0], ''),  # half of 0.2 m/s
        (SPEED, [0, 0.05, 0.05, 0, 0, 0], '', [0, 0.05, 0.05, 0, 0, 0], ''),
        (SPEED, [0, 0.3, 0.4, 0, 0, 0], '', [0, 0.12, 0.16, 0, 0, 0], '0.40x'),
        (SPEED, [0.1, 0, 0, 0, 0, 0], 'table', [0, 0.1, 0, 0, 0, 0], ''),  # x of it is y
        (SPEED, [0, 0, 0, 0, 0, 0.1], 'table', [0, 0, 0, 0, 0, 0.1], ''),  # about the tip
    ],
)
def test_a_twist_moves_the_tool_as_asked(
    scales: Scales, asked: list[float], frame: str, wanted: list[float], capped: str
) -> None:
    """By the units, up to the cap, in its frame; the direction is kept, a cut is reported."""
    made = converter(scales)
    reached, _ = tool_twist(made, twist(asked, frame))
    assert reached == pytest.approx(wanted, abs=2e-3 if capped else 1e-3)
    assert capped in made.capped
    assert bool(capped) == bool(made.capped)


def test_a_twist_may_turn_about_the_origin_of_its_frame() -> None:
    """The tip then moves on a circle about the table."""
    message = twist([0, 0, 0, 0, 0, 0.1], 'table')
    carried, at = tool_twist(converter(SPEED, about_tip=False), message)
    arm = robot('gp110').pose(at).position - Frames().pose('table').position
    assert carried == pytest.approx([*np.cross([0, 0, 0.1], arm), 0, 0, 0.1], abs=3e-3)


def test_a_joint_jog_is_cut_and_scaled() -> None:
    """Twice full speed is full speed, which the scale says."""
    made, core = converter(UNITLESS), core_of('gp110')
    for number in range(60):
        message = JointJog(joint_names=[core.model.joints[0]], velocities=[2.0])
        core.command(made.jog(message, number * PERIOD))
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


def test_a_pose_is_approached_at_the_speeds_of_the_scales() -> None:
    """As they are now, times the override; seen on the tool."""
    made, core = converter(Scales(Units.SPEED, 0.4, 0.8, 0.5, 1.0)), core_of('gp110')
    made.scales = Scales(Units.SPEED, 0.1, 0.5, 0.5, 0.5)
    here = core.model.pose(core.state.position)
    message = PoseStamped()
    target, turn = message.pose.position, message.pose.orientation
    target.x, target.y, target.z = (here.position + np.array([0.0, 0.3, 0.0])).tolist()
    turn.x, turn.y, turn.z, turn.w = pin.Quaternion(here.rotation).coeffs().tolist()
    request = made.pose(message, 10.0)
    assert isinstance(request.command, PoseCommand)
    assert request.command.angular_speed == pytest.approx(0.25)
    core.command(request)
    for number in range(200):
        core.step(number * PERIOD, PERIOD)
    speed = core.model.jacobian(core.state.position) @ core.state.velocity
    assert speed[1] == pytest.approx(0.05, rel=0.05)


TWIST, JOG, POSE = 'delta_twist_cmds', 'delta_joint_cmds', 'pose_target_cmds'
TIMEOUT = 0.5


def parameter(name: str, value: float) -> Parameter:
    """Return a parameter of the servo."""
    return Parameter(PREFIX + name, value=value)  # type: ignore[no-untyped-call]


class Topics:
    """The servo of drives that follow, and what it gives to the gateway."""

    def __init__(self, node: Node, monkeypatch: pytest.MonkeyPatch) -> None:
        self.node = node
        self.prepared = 0  # how often the drives were asked for
        self.requests: list[JogRequest] = []  # jogs so far
        self.drives = Drives(model=RobotModel(*held_panda())).following()
        self.gateway = gateway = self.drives.gateway
        command = gateway.command

        def noted(request: JogRequest) -> Future[None]:
            self.requests.append(request)
            return command(request)

        monkeypatch.setattr(gateway, 'command', noted)
        gateway.get_ready = self._get_ready
        timeout = parameter('incoming_command_timeout', TIMEOUT)
        node._parameter_overrides[timeout.name] = timeout
        self.servo = Servo(node, gateway, declare_servo(node, gateway.model))

    def _get_ready(self) -> bool:
        self.prepared += 1
        return False

    def send(self, topic: str, message: Any, age: float = 0.0) -> None:
        """Deliver a message that was sent some time ago in [s]."""
        sent = self.node.get_clock().now() - Duration(nanoseconds=round(age * 1e9))
        message.header.stamp = sent.to_msg()
        (taken,) = (each for each in self.node.subscriptions if each.topic_name.endswith(topic))
        taken.callback(message)

    def move_by(self, *amounts: float, joint: str = 'panda_joint1') -> None:
        """Send displacements of a joint, one after the other."""
        for amount in amounts:
            self.send(JOG, JointJog(joint_names=[joint], displacements=[amount]))

    def run(self, cycles: int = 200) -> Array:
        """Run cycles; return how far the joints have been moved so far."""
        self.drives.run(cycles)
        return self.drives.path[-1] - self.drives.path[0]


@pytest.fixture
def topics(isolation: Isolation, monkeypatch: pytest.MonkeyPatch) -> Iterator[Topics]:
    """A servo_node whose messages the test hands over."""
    with ros_node(isolation, 'servo_node') as node:
        yield Topics(node, monkeypatch)


def test_a_stream_of_zeros_takes_no_drives_back(topics: Topics) -> None:
    """An idle joystick leaves halted drives halted; who moves it gets them."""
    for _ in range(5):
        topics.send(TWIST, twist((0.0, 0, 0, 0, 0, 0)))
        topics.send(JOG, JointJog(joint_names=['panda_joint1'], velocities=[0.0]))
    assert topics.prepared == 0
    topics.send(TWIST, twist((0.5, 0, 0, 0, 0, 0)))
    assert topics.prepared == 1


def test_zeros_in_another_frame_do_not_touch_a_jog(topics: Topics) -> None:
    """A gamepad at rest streams them, while another client jogs with the keyboard."""
    topics.send(TWIST, twist([0.0, 0.5, 0.0, 0.0, 0.0, 0.0]))
    topics.send(TWIST, twist([0.0] * 6, 'panda_hand'))
    begin, end = topics.run(40), topics.run(10)
    assert np.abs(end - begin).max() > 0.005
    topics.send(TWIST, twist([0.0] * 6))
    begin, end = topics.run(40), topics.run(10)
    assert np.abs(end - begin).max() < 1e-4


def test_whatever_a_command_raises_ends_that_command_only(
    topics: Topics, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is refused in the status, with a traceback in the log, and the next one counts."""
    logged: list[str] = []
    logger = SimpleNamespace(error=lambda text, **_: logged.append(text))
    monkeypatch.setattr(topics.node, 'get_logger', lambda: logger)
    for owner, name in ((topics.servo, '_admitted'), (topics.gateway, 'get_ready')):
        with monkeypatch.context() as patch:
            patch.setattr(owner, name, lambda *_: 1 // 0)
            topics.send(TWIST, twist((0.5, 0, 0, 0, 0, 0)))
        assert 'ZeroDivisionError' in topics.servo._refusals.fresh(time.monotonic())
        assert 'Traceback' in logged.pop()
    topics.send(TWIST, twist((0.5, 0, 0, 0, 0, 0)))
    topics.run(2)
    assert topics.gateway.snapshot.source is Source.JOG


def test_the_world_of_the_srdf_is_a_frame(topics: Topics) -> None:
    """The planning frame of MoveIt, in which its servo takes twists, is in no /tf.

    TF decides where it is: an arm may stand on a pedestal.
    """
    for frame in ('world', 'panda_link0', 'moon'):
        topics.send(TWIST, twist((0.5, 0, 0, 0, 0, 0), frame))
    placed = TransformStamped(child_frame_id='panda_link0')
    placed.header.frame_id = 'world'
    placed.transform.rotation.x, placed.transform.rotation.w = 1.0, 0.0
    (static,) = (each for each in topics.node.subscriptions if each.topic_name == '/tf_static')
    static.callback(TFMessage(transforms=[placed]))
    topics.send(TWIST, twist((0.5, 0, 0, 0, 0, 0), 'world'))
    twists = [each.command for each in topics.requests if isinstance(each.command, TwistCommand)]
    world, base, turned = twists
    assert (world.link, world.axes) == (base.link, base.axes) == (None, None)
    assert turned.axes is not None
    assert turned.axes.diagonal() == pytest.approx([1.0, -1.0, -1.0])


def test_displacements_that_come_faster_than_they_begin_add_up(topics: Topics) -> None:
    """Within limits none is refused or late: those that wait become one; a wrong one is alone."""
    for number in range(150):
        joint = ('panda_joint1', 'panda_joint2')[number % 2]
        topics.move_by(0.001, math.nan, joint=joint)
        topics.move_by(0.001, joint='elbow')
        topics.run(1)
    assert topics.run(100)[:2] == pytest.approx([0.075, 0.075], abs=1e-6)


def test_a_displacement_that_does_not_fit_is_refused_alone(topics: Topics) -> None:
    """Those before it are carried out to the limit, and one that leads back from there."""
    limit = float(topics.gateway.model.limits.upper[0])
    near = limit - 0.055 - topics.drives.path[-1][0]
    for ways in ([near], [0.01] * 10 + [9.0, -0.02], [0.02, 9.0]):
        topics.move_by(*ways)
        topics.run(1000)
    assert limit - topics.drives.path[-1][0] == pytest.approx(0.005, abs=1e-6)
    # also when the one before it begins afterwards
    assert 'panda_joint1 at ' in topics.servo._refusals.fresh(0.0)


def test_displacements_before_one_into_contact_are_carried_out(topics: Topics) -> None:
    """The last would turn the hand into the forearm; those that it added to lead where asked."""
    topics.move_by(-0.01, -0.01, -0.02, -1.4, joint='panda_joint6')
    assert topics.run(300)[5] == pytest.approx(-0.04, abs=1e-6)


def test_a_displacement_of_zero_keeps_those_that_wait(topics: Topics) -> None:
    """Also that they get the drives."""
    topics.move_by(0.01, 0.01, 0.0)
    assert topics.run()[0] == pytest.approx(0.02, abs=1e-6)
    assert topics.prepared == 2


def test_displacements_before_a_stop_do_not_come_back_with_the_next(topics: Topics) -> None:
    """Also those that waited."""
    topics.move_by(*[0.01] * 20)
    topics.gateway.interrupt('a stop')
    topics.move_by(0.0)
    stands = topics.run()[0]
    topics.move_by(0.01)
    assert topics.run()[0] - stands == pytest.approx(0.01, abs=1e-6)


@pytest.mark.parametrize(
    ('topic', 'message', 'duration'),
    [
        (TWIST, twist((0.5, 0, 0, 0, 0, 0)), TIMEOUT),
        (JOG, JointJog(joint_names=['panda_joint1'], velocities=[0.5]), TIMEOUT),
        (JOG, JointJog(joint_names=['panda_joint1'], velocities=[0.5], duration=2.0), 2.0),
        (POSE, PoseStamped(), TIMEOUT),
    ],
)
def test_a_command_lives_from_when_it_was_sent(
    topics: Topics, topic: str, message: Any, duration: float
) -> None:
    """What is nearly stale when it arrives expires soon, and not a whole time-out later."""
    if isinstance(message, PoseStamped):
        message.pose.orientation.w = 1.0
    age, before = TIMEOUT - 0.2, time.monotonic()
    topics.send(topic, message, age)
    (request,) = topics.requests
    left = request.expires + age - duration
    assert before - 0.01 <= left <= time.monotonic()


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
