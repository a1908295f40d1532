# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""hardware_node over DDS and a real pseudo-terminal: its topics, and the fault matrix."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import math
from pathlib import Path
import re
import signal
import time
from types import SimpleNamespace
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from isolation import Isolation, reserve
import pytest
import rclpy
from rclpy.context import Context
from rclpy.node import Node
from rclpy.qos import ReliabilityPolicy
from std_msgs.msg import String
from std_srvs.srv import SetBool

from node_runner import LATCHED, ParameterError
from quad_description import FEET, movable_joints, Pose, pose_positions, robot_urdf
from quad_hardware import CommandError, HardwareError
from quad_hardware.joints import LimiterSettings, MAX_PERIOD
from quad_hardware.nodes import parameters
from quad_hardware.nodes.hardware_node import HardwareNode
from quad_hardware.nodes.parameters import NodeSettings
from quad_msgs.msg import FootContacts
from quad_node_rig import NodeRig, TIMEOUT

WRONG = {
    'protocol:=v3': "protocol is 'v3': it must be auto, vendor, v1, developer or v2",
    'joints.fl_hip_joint.sign:=0': 'sign 0 is neither 1 nor -1',
    'joints.fl_calf_joint.offset:=6.9': 'correct joints.fl_calf_joint.offset',
    'robot_description:=<robot/>': 'has no <link>',
    'max_joint_speed:=fast': "max_joint_speed is 'fast': it must be a number",
    'max_joint_speed:=500.0': 'max_joint_speed is 500.0: it must be 0.1 to 100.0',
    'publish_tf:=3': 'publish_tf is 3: it must be true or false',
}


def read(*arguments: str) -> NodeSettings:
    """What the node understands of parameters on its command line."""
    context = Context()
    words = [word for argument in arguments for word in ('-p', argument)]
    rclpy.init(args=['--ros-args', *words], context=context)
    node = Node('hardware_node', context=context, enable_rosout=False)
    try:
        return parameters.declare_parameters(node)
    finally:
        node.destroy_node()
        rclpy.shutdown(context=context)


@pytest.mark.parametrize(('argument', 'reason'), WRONG.items())
def test_a_wrong_parameter_is_refused(argument: str, reason: str) -> None:
    """The message names the value and the remedy."""
    with pytest.raises((ParameterError, HardwareError), match=re.escape(reason)):
        read(argument)


METHOD = 'vendor_servo_method:=write_servo_angle'


@pytest.mark.parametrize(
    ('installed', 'arguments', 'vendor'),
    [
        (False, (), False),
        (True, ('protocol:=v2',), False),
        (True, ('protocol:=v1',), False),
        (True, ('protocol:=vendor', METHOD), True),
        (True, (), 'set protocol'),
        (True, ('protocol:=vendor',), 'vendor_servo_method'),
        (False, ('protocol:=vendor', METHOD), 'protocol'),
    ],
)
def test_the_vendors_library_is_used_when_it_was_chosen(
    monkeypatch: pytest.MonkeyPatch, *, installed: bool, arguments: tuple[str, ...], vendor: object
) -> None:
    """What would have to be guessed is refused before the port is opened, by its parameter."""
    monkeypatch.setattr(parameters, 'is_installed', lambda: installed)
    if isinstance(vendor, str):
        with pytest.raises(CommandError, match=vendor):
            read(*arguments)
    else:
        assert read(*arguments).robot.link.vendor is vendor


def on_node(test: Callable[..., None]) -> Callable[..., None]:
    """Mark a test that starts the node, which those of this file share."""
    marked: Callable[..., None] = pytest.mark.xdist_group('hardware_node')(test)
    pytest.mark.scenario(marked)
    return marked


HOME = [0.0] * 12
POSE = [0.0, 0.6, -0.3] * 4
LARGEST_STEP = math.degrees(LimiterSettings().max_joint_speed * MAX_PERIOD)  # [deg]
LYING = list(pose_positions(Pose.LIE).values())
LEGS_ORDER = [13, 12, 11, 23, 22, 21, 43, 42, 41, 33, 32, 31]


@pytest.fixture(scope='module')
def shared_rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[NodeRig]:
    """The node with a robot of protocol v2, started once."""
    with reserve() as isolation, NodeRig(isolation, tmp_path_factory.mktemp('port')) as rig:
        yield rig


@pytest.fixture
def rig(shared_rig: NodeRig) -> NodeRig:
    """The node with a robot that stands at zero and behaves."""
    shared_rig.begin_anew()
    return shared_rig


@on_node
def test_the_topics_of_the_article(rig: NodeRig) -> None:
    """Joints in radians in URDF order, IMU, odometry, battery, transforms; servos follow."""
    problems = rig.client.listen(String, '/servo_problem', LATCHED)
    rig.peer.behaviour.attitude = (0.0, 0.0, 90.0)
    rig.stream(POSE, 1.0)
    joints = rig.receive('/joint_states', 3)
    assert list(joints.name) == [j.name for j in movable_joints(robot_urdf('lite'))]
    assert list(joints.position) == pytest.approx(POSE, abs=0.01)
    assert [rig.peer.angles[m] for m in LEGS_ORDER] == pytest.approx(
        [math.degrees(p) for p in POSE], abs=0.5
    )
    imu = rig.receive('/imu')
    assert imu.header.frame_id == 'imu_link'
    assert (imu.orientation.z, imu.orientation.w) == pytest.approx((0.5**0.5, 0.5**0.5))
    assert imu.linear_acceleration.z == pytest.approx(9.8, abs=0.01)
    assert rig.receive('/odom').child_frame_id == 'base_link'
    contacts = rig.receive('/foot_contacts')
    assert list(contacts.name) == list(FEET)
    assert list(contacts.contact) == [True] * 4
    assert contacts.source == FootContacts.MEASURED_HEIGHT
    assert rig.receive('/battery_state').percentage == pytest.approx(0.8)
    assert [problem.data for problem in problems] == ['']
    pairs = [(t.header.frame_id, t.child_frame_id) for t in rig.receive('/tf').transforms]
    assert pairs == [('odom', 'base_link'), ('base_link', 'base_footprint')]
    published = rig.client.node.get_publishers_info_by_topic('/joint_states')
    assert published[0].qos_profile.reliability == ReliabilityPolicy.RELIABLE
    rig.wait_for_status('serial link', DiagnosticStatus.OK, 'reports arrive')
    assert rig.largest_step() <= LARGEST_STEP + 0.01


@on_node
def test_wrong_commands_move_nothing_and_are_reported(rig: NodeRig) -> None:
    """NaN, infinity, wrong lengths: refused with the reason, and not a byte is sent."""
    for wrong, reason in (
        ([math.nan, *HOME[1:]], 'fl_hip_joint'),
        ([*HOME[:11], math.inf], 'br_calf_joint'),
        (HOME[:5], '5 positions for 12 joints'),
    ):
        rig.command(wrong)
        rig.wait_for_status('joint commands', DiagnosticStatus.WARN, reason)
    rig.command(HOME, velocity=[1.0])
    rig.wait_for_status('joint commands', DiagnosticStatus.WARN, '1 values of velocity')
    assert rig.peer.commands == []
    rig.command(HOME)
    rig.client.spin_until(lambda: bool(rig.peer.commands), TIMEOUT, 'right command')


@on_node
def test_with_a_dead_imu_the_joints_are_reported_and_follow(rig: NodeRig) -> None:
    """No /imu, /odom and contacts, an error that says so, and a command reaches the servos."""
    rig.peer.behaviour.attitude = (math.nan,) * 3
    rig.wait_for_status('robot', DiagnosticStatus.ERROR, 'imu')
    silent = ('/imu', '/odom', '/foot_contacts')
    counts = [len(rig.received[topic]) for topic in silent]
    rig.stream(POSE, 1.0)
    assert list(rig.receive('/joint_states', 3).position) == pytest.approx(POSE, abs=0.01)
    assert [len(rig.received[topic]) for topic in silent] == counts
    rig.peer.behaviour.attitude = (0.0, 0.0, 0.0)
    rig.receive('/imu')


@on_node
def test_limits_of_the_urdf_count_and_a_servo_beyond_them_is_left_there(rig: NodeRig) -> None:
    """A target beyond ends at the limit; a stream that asks a servo to stay sends where it is."""
    rig.stream([2.0, 0.0, 0.0] * 4, 1.0)
    rig.wait_for_status('joint commands', DiagnosticStatus.WARN, 'fl_hip_joint')
    assert rig.peer.angles[13] == pytest.approx(math.degrees(0.5236), abs=0.02)
    rig.begin_anew()
    rig.peer.angles[13] = 40.0
    rig.receive('/joint_states', 30)  # by then the stream of before has ended
    rig.peer.commands.clear()
    rig.stream([math.radians(40.0), *HOME[1:]], 0.3)
    assert {command[13] for command in rig.peer.commands} == {40.0}
    status = rig.wait_for_status('joint commands', DiagnosticStatus.WARN, 'found beyond limits')
    assert 'fl_hip_joint' in status.message
    rig.stream(HOME, 0.8)
    assert rig.peer.angles[13] == pytest.approx(0.0, abs=0.1)
    assert rig.largest_step() <= LARGEST_STEP + 0.01


@on_node
def test_joints_that_were_never_checked_do_not_move(isolation: Isolation, tmp_path: Path) -> None:
    """Commands are refused, and the controller receives why the robot must not stand up."""
    with NodeRig(isolation, tmp_path, '-p', 'joints_checked:=false') as rig:
        problems = rig.client.listen(String, '/servo_problem', LATCHED)
        rig.client.spin_until(lambda: bool(problems), TIMEOUT, 'problem')
        assert 'never checked' in problems[-1].data
        rig.command(POSE)
        rig.wait_for_status('joint commands', DiagnosticStatus.WARN, 'calibrate first-motion')
        assert rig.peer.commands == []


@on_node
def test_silence_holds_the_servos(rig: NodeRig) -> None:
    """After half a second nothing is sent, diagnostics says so; then the stream begins anew."""
    rig.stream(POSE, 0.8)
    rig.peer.behaviour.silent = True
    rig.wait_for_status('serial link', DiagnosticStatus.STALE, 'hold their last target')
    sent = len(rig.peer.commands)
    rig.stream(HOME, 0.4)
    assert len(rig.peer.commands) == sent
    rig.wait_for_status('joint commands', DiagnosticStatus.WARN, 'not sent')
    rig.peer.behaviour.silent = False
    rig.wait_for_status('serial link', DiagnosticStatus.OK, 'reports arrive')
    rig.stream(HOME, 1.0)
    assert rig.peer.angles[12] == pytest.approx(0.0, abs=0.1)
    assert rig.largest_step() <= LARGEST_STEP + 0.01


def is_folded(rig: NodeRig) -> bool:
    """Return whether the servos are in the lying pose."""
    angles = [math.radians(rig.peer.angles[motor]) for motor in LEGS_ORDER]
    return bool(angles == pytest.approx(LYING, abs=0.002))


@on_node
def test_commands_that_break_off_in_motion_end_in_a_safe_posture(rig: NodeRig) -> None:
    """The legs fold softly and diagnostics is in error, until somebody commands again."""
    rig.swing(7)
    rig.wait_for_status('joint commands', DiagnosticStatus.ERROR, 'lies down')
    rig.client.spin_until(lambda: is_folded(rig), TIMEOUT, 'lying pose')
    assert rig.largest_step() <= LARGEST_STEP + 0.01
    rig.receive('/joint_states', 10)
    count = len(rig.peer.commands)
    rig.receive('/joint_states', 10)
    assert len(rig.peer.commands) == count
    rig.stream(LYING, 0.1)
    rig.wait_for_status('joint commands', DiagnosticStatus.OK, 'received')


@on_node
def test_commands_that_end_at_rest_leave_the_posture(rig: NodeRig) -> None:
    """Nothing moves unasked: not a byte is sent after the last command."""
    rig.stream(POSE, 1.5)
    rig.receive('/joint_states', 5)
    count = len(rig.peer.commands)
    rig.receive('/joint_states', 50)
    assert len(rig.peer.commands) == count


@on_node
@pytest.mark.parametrize('stall', [0.0, 0.8])
def test_a_node_that_ends_in_motion_folds_the_legs_first(
    isolation: Isolation, tmp_path: Path, stall: float
) -> None:
    """As when the controller has died and the rest of the bring-up is stopped; after a stall."""
    with NodeRig(isolation, tmp_path) as rig:
        rig.swing(7)
        if stall:
            rig.peer.behaviour.silent = True  # the machine stalls, and what reports with it
            rig.node.signal(signal.SIGSTOP)
            time.sleep(stall)
        rig.node.signal(signal.SIGINT)
        rig.node.signal(signal.SIGCONT)
        time.sleep(0.1)
        rig.peer.behaviour.silent = False
        assert rig.node.wait() == 0
        # on a busy machine the robot takes its last frames later than the node ends
        rig.client.spin_until(lambda: is_folded(rig), TIMEOUT, f'end of {rig.node.output}')


def test_a_timer_that_waited_behind_a_command_counts_nothing() -> None:
    """A command came while its event waited for the executor."""
    robot = SimpleNamespace(is_commanded=True, miss_commands=lambda: pytest.fail('it counted'))
    node: Any = SimpleNamespace(_robot=robot)
    HardwareNode._miss_commands(node)


@on_node
@pytest.mark.parametrize('load', [0.0, 12.0])
def test_servos_that_still_pull_are_not_said_to_be_without_torque(
    rig: NodeRig, load: float
) -> None:
    """The answer comes of what they report then, and not of what was sent, or of before.

    The node serves others while it waits for that: of two that ask for torque off, and one that
    wants it back, none waits for another.
    """
    name, off, on = '/hardware_node/torque', SetBool.Request(), SetBool.Request(data=True)
    rig.peer.behaviour.load, rig.peer.behaviour.limp_load = load, 12.0
    rig.receive('/joint_states', 5)
    answer = rig.client.call(SetBool, name, off)
    assert not answer.success
    assert 'still report load' in answer.message
    answers = [rig.client.call_async(SetBool, name, off) for _ in range(2)]
    assert rig.client.call(SetBool, name, on).success
    rig.client.spin_until(lambda: all(a.done() for a in answers), TIMEOUT, 'answers')
    assert not any(each.result().success for each in answers)
    for each in answers:  # on a busy machine the time for letting go may be over first
        assert re.search('switched on again meanwhile|still report load', each.result().message)
    rig.client.spin_until(lambda: rig.peer.torque, TIMEOUT, 'torque on')
    rig.peer.behaviour.limp_load = 0.0
    assert rig.client.call(SetBool, name, off).success
    assert rig.client.call(SetBool, name, on).success


@on_node
def test_a_controller_that_goes_on_moves_no_servo_that_was_let_go(rig: NodeRig) -> None:
    """Without torque no command is sent; with it, the servos hold where they were put.

    The targets of the stream are those of a robot that stood; after a stall, too, until they are
    near.
    """
    rig.stream(HOME, 0.5)

    def give(on: bool) -> SetBool.Response:
        return rig.client.call(SetBool, '/hardware_node/torque', SetBool.Request(data=on))

    timer = rig.client.node.create_timer(0.02, lambda: rig.command(HOME))
    answer = give(False)
    assert (answer.success, answer.message) == (True, 'the servos are without torque')
    rig.client.spin_until(lambda: not rig.peer.torque, TIMEOUT, 'torque off')
    before = len(rig.peer.commands)
    rig.wait_for_status('joint commands', DiagnosticStatus.WARN, 'without torque')
    rig.peer.angles.update(dict.fromkeys(rig.peer.angles, 20.0))
    rig.receive_position(math.radians(20.0))
    assert len(rig.peer.commands) == before
    assert give(True).success
    rig.client.spin_until(lambda: rig.peer.torque, TIMEOUT, 'torque on')
    rig.wait_for_status('joint commands', DiagnosticStatus.WARN, 'set the mode relax, then stand')
    rig.receive('/joint_states', 30)
    rig.client.node.destroy_timer(timer)
    targets = [angle for angles in rig.peer.commands[before:] for angle in angles.values()]
    assert targets
    assert targets == pytest.approx([20.0] * len(targets), abs=0.01)
    count = len(rig.peer.commands)
    rig.receive('/joint_states', 80)  # longer than the pause that ends a stream
    rig.stream(HOME, 0.5)
    assert len(rig.peer.commands) == count
    rig.stream(list(rig.receive('/joint_states', 1).position), 0.5)
    rig.stream(HOME, 1.0)
    assert len(rig.peer.commands) > count
    assert rig.peer.angles[11] != pytest.approx(20.0, abs=1.0)
