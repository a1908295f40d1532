# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the servo reports to tools and people: status, refusals, messages that went wrong."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from geometry_msgs.msg import TwistStamped
from input_devices import InjectedDevices
from isolation import Isolation
from model_robots import FOLDER, ready, robot, STRAIGHT, texts, two_arms_texts
from moveit_msgs.msg import ServoStatus
import numpy as np
import pytest
import rclpy
from rclpy.node import Node
from servo_commands import Drives, InlineWorker, jog, move_by, PERIOD, twist

from arm_canopen import Refusal, RefusalCause
from arm_model import ArmError
from arm_servo import (
    Cause,
    CoreSettings,
    IkSettings,
    JogRequest,
    Limiter,
    MotionCore,
    MotionReport,
    PauseRequest,
    ServoSettings,
    Source,
    TwistCommand,
    VelocityBoundsSettings,
)
from arm_servo.core.gateway import CommandGateway
from arm_servo.core.requests import CommandType
from arm_servo.ros.canopen_backend import CanopenMotion
from arm_servo.ros.group_motion import Offers
from arm_servo.ros.motion_goals import Refusals, REPEAT_PERIOD, STATUS_PERIOD
from arm_servo.ros.servo import code_of, Servo, status_of
from arm_servo.teleop.servo_gamepad import ServoGamepad
from arm_servo.teleop.servo_keyboard_input import ServoKeyboardInput
from node_runner import ParameterError
from operator_input import OperatorInputError


class Commands:
    """A servo without its ROS node, and the arm behind it."""

    def __init__(self) -> None:
        self.drives = Drives().following()
        self.logged: list[str] = []
        servo: Any = object.__new__(Servo)
        logger = SimpleNamespace(error=lambda text, **_: self.logged.append(text))
        servo._node = SimpleNamespace(get_logger=lambda: logger)
        servo._paused, servo._kind = '', None
        servo._gateway, servo._refusals = self.drives.gateway, Refusals()
        self.servo = servo

    def send(self, numbers: list[float], frame: str = '') -> None:
        """Deliver a twist; the cycle of the test has its own time."""
        expires = self.drives.now + 0.1

        def convert(_message: object, _sent: float) -> JogRequest:
            return JogRequest(TwistCommand(np.array(numbers)), expires)

        message = TwistStamped()
        message.header.frame_id = frame
        self.servo._take(CommandType.TWIST, convert, message)


def test_zeros_in_another_frame_do_not_touch_a_jog() -> None:
    """A gamepad at rest streams them, while somebody jogs with the keyboard."""
    commands = Commands()
    for _ in range(80):
        commands.send([0.0, 0.05, 0.0, 0.0, 0.0, 0.0])
        commands.send([0.0] * 6, 'panda_hand')
        commands.drives.run()
    point = commands.drives.gateway.snapshot.set_point
    assert point is not None
    model, state = commands.drives.gateway.model, point.state
    speed = (model.jacobian(state.position) @ state.velocity)[1]
    assert abs(speed - 0.05) < 1e-3
    commands.send([0.0] * 6)
    commands.drives.run(40)
    assert commands.drives.gateway.snapshot.source is Source.NONE


def test_whatever_a_command_raises_ends_that_command_only() -> None:
    """It is refused in the status, with a traceback in the log, and the next one counts."""
    commands = Commands()

    def fail(_message: object, _sent: float) -> JogRequest:
        raise ZeroDivisionError('no such luck')

    commands.servo._take(CommandType.TWIST, fail, TwistStamped())
    assert 'ZeroDivisionError: no such luck' in commands.servo._refusals.fresh(0.0)
    assert 'Traceback' in commands.logged[0]
    gateway = commands.drives.gateway
    gateway.get_ready = lambda: bool(1 // 0)
    commands.send([0.0, 0.05, 0.0, 0.0, 0.0, 0.0])
    assert len(commands.logged) == 2
    gateway.get_ready = lambda: False
    commands.send([0.0, 0.05, 0.0, 0.0, 0.0, 0.0])
    commands.drives.run()
    assert commands.drives.gateway.snapshot.source is Source.JOG


def test_a_stream_with_old_stamps_is_one_line_of_the_log() -> None:
    """What differs from message to message is a number; another reason is another line."""
    refusals = Refusals()
    lines = []
    for number in range(100):
        now = 0.03 * number
        refusals.note(f'stale: {0.1 + now:.2f} s old when it was read', now)
        assert refusals.fresh(now).startswith('stale')
        lines.append(refusals.to_log(now))
    assert [line for line in lines if line] == ['stale: 0.10 s old when it was read']
    refusals.note('there is no joint elbow', 3.0)
    assert refusals.to_log(3.0) == 'there is no joint elbow'


def test_the_same_mistake_made_later_is_logged_again() -> None:
    """A person who tries again after a while sees it again."""
    refusals = Refusals()
    refusals.note('paused', 1.0)
    assert refusals.to_log(1.0) == 'paused'
    later = 1.1 + REPEAT_PERIOD
    refusals.note('paused', later)
    assert refusals.to_log(later) == 'paused'


def test_the_status_forgets_a_refusal() -> None:
    """A while after it, or when a command is taken."""
    refusals = Refusals()
    refusals.note('paused', 1.0)
    assert refusals.fresh(1.1 + STATUS_PERIOD) == ''
    assert refusals.to_log(1.1 + STATUS_PERIOD) == ''
    refusals.note('paused', 3.0)
    refusals.clear(3.0)
    assert refusals.fresh(3.0) == ''


SPACE = '/refused'  # nodes of tests of before may still be known in the domain
TWO_ARMS = {
    'robot_description': two_arms_texts()[0],
    'robot_description_semantic': two_arms_texts()[1],
    'group': 'left',
    'other_groups': ['right'],
    'limits': two_arms_texts()[2],
}


def motion() -> CanopenMotion:
    """Make the motion nodes on a bus without drives."""
    bus: Any = SimpleNamespace(bus=SimpleNamespace(nodes=[], joints=(), file='bus.yml'))
    return CanopenMotion(bus, Offers())


def gamepad() -> Node:
    """Make the node without this machine's devices."""
    return ServoGamepad(InjectedDevices())


def parameters(folder: Path, **values: object) -> list[str]:
    """Write parameters for all nodes of a process, with those of an arm."""
    urdf, srdf = texts('gp110')
    arm = {'robot_description': urdf, 'robot_description_semantic': srdf}
    file = folder / 'parameters.yaml'
    limits = FOLDER / 'gp110' / 'limits.yaml'
    if table := values.pop('limits', None):
        limits = folder / 'limits.yaml'
        limits.write_text(json.dumps({'joint_limits': table}))
    whole = arm | {'joint_limits': str(limits)} | values
    file.write_text(json.dumps({'/**': {'ros__parameters': whole}}))
    return ['--ros-args', '--params-file', str(file)]


@pytest.mark.parametrize(
    ('make', 'values', 'reason'),
    [
        (motion, {'robot_description': ''}, 'no robot_description'),
        (motion, {'robot_description': '<robot/>'}, 'robot_description: .*no <link>'),
        (motion, {'robot_description_semantic': 'none'}, 'robot_description_semantic: .*no XML'),
        (motion, {'limits': {'elbow': {}}}, r'/limits\.yaml: joint joint_1_s is missing'),
        (motion, {'publish_joint_states': 3}, 'publish_joint_states is 3'),
        (motion, {'group': 'arm'}, "'arm'"),
        (motion, {'joints': ['a', 'b']}, 'not those of the group'),
        (motion, {}, 'bus.yml has no drive'),
        (
            motion,
            TWO_ARMS | {'controller_name': 'right_controller'},
            'another group of this robot',
        ),
        (ServoKeyboardInput, {'sped': 0.1}, "did you mean 'speed'"),
        (ServoKeyboardInput, {'speed': 1.5}, 'speed is 1.5: it must be 0.01 to 1.0'),
        (ServoKeyboardInput, {'rate': 1}, 'rate is 1: it must be 10.0 to 500.0'),
        (gamepad, {'enable_button': 'eastt'}, "did you mean 'east'"),
        (gamepad, {'deadman_timeout': 20}, 'must be at least deadman_timeout, 20'),
        (gamepad, {'preset': 'xbux'}, "did you mean 'xbox'"),
    ],
)
def test_a_refused_node_leaves_nothing_in_the_graph(
    isolation: Isolation,
    tmp_path: Path,
    make: Callable[[], object],
    values: dict[str, object],
    reason: str,
) -> None:
    """Neither the node whose parameter is wrong nor those before it are left in the process."""
    args = [*parameters(tmp_path, **values), '-r', f'__ns:={SPACE}']
    rclpy.init(args=args, domain_id=isolation.domain_id)
    try:
        watcher = Node('watcher')
        with pytest.raises((ParameterError, ArmError, OperatorInputError), match=reason):
            make()
        nodes = watcher.get_node_names_and_namespaces()
        assert [name for name, space in nodes if space == SPACE] == ['watcher']
        watcher.destroy_node()
    finally:
        rclpy.shutdown()


def attached(name: str = 'panda', at: Sequence[float] = ()) -> Drives:
    """Return drives that follow, in a pose."""
    drives = Drives(name)
    if at:
        drives.place(at)
    drives.attach()
    drives.run(2)
    return drives


def codes(drives: Drives, cycles: int) -> list[tuple[int, str]]:
    """Run cycles, and return the status of each that is another than the one before."""
    found: list[tuple[int, str]] = []
    for _ in range(cycles):
        drives.run()
        status = status_of(drives.gateway.snapshot, '', '', '')
        if not found or found[-1][0] != status[0]:
            found.append(status)
    return found


def test_a_free_jog_has_no_warning() -> None:
    """And the message says that nothing limits it."""
    drives = attached()
    twist(drives.gateway, [0.0, 0.02, 0.0, 0.0, 0.0, 0.0], drives.now, 60.0)
    assert codes(drives, 60)[-1] == (ServoStatus.NO_WARNING, 'free')


def test_a_jog_to_a_joint_limit_is_reported() -> None:
    """With the joint, as soon as it is slowed down."""
    drives = attached()
    jog(drives.gateway, {'panda_joint1': 2.0}, drives.now, 60.0)
    code, words = codes(drives, 300)[-1]
    assert code == ServoStatus.JOINT_BOUND
    assert 'panda_joint1' in words


def test_a_jog_into_contact_is_slowed_down_and_then_halted() -> None:
    """With the two links."""
    drives = attached()
    jog(drives.gateway, {'panda_joint6': -1.0}, drives.now, 60.0)
    found = codes(drives, 300)
    assert ServoStatus.DECELERATE_FOR_COLLISION in [code for code, _ in found]
    code, words = found[-1]
    assert code == ServoStatus.HALT_FOR_COLLISION
    assert 'panda_link5' in words
    assert 'panda_hand' in words


def test_a_direction_that_is_lost_is_reported() -> None:
    """The straight arm cannot go sideways without its elbow."""
    drives = attached('gp110', STRAIGHT['gp110'].tolist())
    twist(drives.gateway, [0.0, 0.1, 0.0, 0.0, 0.0, 0.0], drives.now, 60.0)
    code, words = codes(drives, 60)[-1]
    assert code == ServoStatus.HALT_FOR_SINGULARITY
    assert 'y is lost' in words


def test_a_stop_of_the_safety_filter_is_no_free_motion() -> None:
    """Where nothing else brakes in front of contact, it does, with code and links."""
    core = MotionCore(
        robot('panda'),
        CoreSettings(servo=ServoSettings(ik=IkSettings(brakes=VelocityBoundsSettings(pairs=0)))),
    )
    gateway = CommandGateway(core, InlineWorker(), lambda: 100.0)
    core.reset(ready('panda'))
    gateway.update(100.0, PERIOD, core.state, core.state.position, '')
    jog(gateway, {'panda_joint6': -1.0}, 100.0, 60.0)
    reported = set()
    for cycle in range(250):
        state = core.state
        gateway.update(100.0 + cycle * PERIOD, PERIOD, state, state.position, '')
        code, words = status_of(gateway.snapshot, '', '', '')
        reported.add(code)
        if code == ServoStatus.HALT_FOR_COLLISION:
            assert 'panda_link5' in words
            assert 'panda_hand' in words
    assert ServoStatus.HALT_FOR_COLLISION in reported
    assert core.model.clearance(core.state.position) > 0.004


def test_what_stops_a_trajectory_is_reported_too() -> None:
    """The safety filter holds whatever moves the arm; its code is not only the jog's."""
    drives = attached()
    move_by(drives.gateway, {'panda_joint1': 0.3})
    drives.run(5)
    snapshot = drives.gateway.snapshot
    assert snapshot.set_point is not None
    report = MotionReport(0.0, (Limiter(Cause.COLLISION, 'hand - arm', 0.01, 0.0),))
    for source in (Source.TARGET, Source.TRAJECTORY):
        point = replace(snapshot.set_point, source=source, report=report)
        code, words = status_of(replace(snapshot, set_point=point), '', '', '')
        assert code == ServoStatus.HALT_FOR_COLLISION
        assert 'hand - arm' in words


def test_the_strongest_limit_is_the_one_that_counts() -> None:
    """In whatever order they were found."""
    slowed = Limiter(Cause.COLLISION, 'hand - arm', 0.03, 0.6)
    halted = Limiter(Cause.JOINT_POSITION, 'elbow', 0.0, 0.0)
    for limiters in ((slowed, halted), (halted, slowed)):
        report = MotionReport(0.0, limiters)
        assert report.limiters[0] is halted
        assert code_of(report) == ServoStatus.JOINT_BOUND
    assert MotionReport(0.6, (slowed,)).with_limiter(halted).limiters[0] is halted


def test_a_refusal_comes_before_everything_else() -> None:
    """A person whose command was refused sees why, whatever else goes on."""
    drives = attached()
    assert status_of(drives.gateway.snapshot, 'stale', 'paused', 'cut') == (-1, 'stale')


def test_a_cycle_that_stands_still_is_reported() -> None:
    """What the last cycle said is not repeated for ever."""
    drives = attached()
    code, words = status_of(drives.gateway.snapshot, '', '', '', 3.0)
    assert code == ServoStatus.INVALID
    assert '3.0 s ago' in words


def test_a_blocked_arm_says_so() -> None:
    """Without drives the status is invalid, and names the remedy."""
    drives = attached()
    drives.source.released('panda_joint1', Refusal(RefusalCause.SINGLE_TARGET))
    drives.run(3)
    code, words = status_of(drives.gateway.snapshot, '', '', '')
    assert code == ServoStatus.INVALID
    assert 'panda_joint1' in words


def test_it_reports_what_moves_the_arm() -> None:
    """Also while nobody jogs."""
    drives = attached()
    assert status_of(drives.gateway.snapshot, '', '', '') == (ServoStatus.NO_WARNING, 'ready')
    move_by(drives.gateway, {'panda_joint1': 0.3})
    drives.run(5)
    assert 'target' in status_of(drives.gateway.snapshot, '', '', '')[1]
    twist(drives.gateway, [0.0, 0.02, 0.0, 0.0, 0.0, 0.0], drives.now, 60.0)
    drives.run(2)
    assert status_of(drives.gateway.snapshot, '', '', 'cut to 1')[1].startswith('cut to 1')


@pytest.mark.parametrize('paused', [False, True])
def test_a_pause_of_the_arm_is_reported(paused: bool) -> None:
    """Jogging is refused then, and the message names the service that ends it."""
    drives = attached()
    if paused:
        drives.gateway.command(PauseRequest())
    drives.run(2)
    words = status_of(drives.gateway.snapshot, '', '', '')[1]
    assert ('~/resume' in words) == paused


def test_a_joint_at_its_limit_has_nothing_left() -> None:
    """What rounding leaves beyond the limit is no negative zero."""
    at_limit = Limiter(Cause.JOINT_POSITION, 'elbow', -1e-9, 0.0)
    assert str(at_limit) == 'joint limit: elbow, 0.000 left, halted'
