# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the servo reports to tools and people: status, refusals, messages that went wrong."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from input_devices import InjectedDevices
from isolation import Isolation
from model_robots import FOLDER, STRAIGHT, texts, two_arms_texts
from moveit_msgs.msg import ServoStatus
import pytest
import rclpy
from rclpy.node import Node
from servo_commands import Drives, jog, move_by, twist

from arm_canopen import Refusal, RefusalCause
from arm_model import ArmError
from arm_servo import (
    Cause,
    CoreSettings,
    IkSettings,
    Limiter,
    MotionReport,
    PauseRequest,
    ServoSettings,
    Source,
    VelocityBoundsSettings,
)
from arm_servo.ros.canopen_backend import CanopenMotion
from arm_servo.ros.group_motion import Offers
from arm_servo.ros.motion_goals import Refusals, REPEAT_PERIOD, STATUS_PERIOD
from arm_servo.ros.servo import code_of, status_of
from arm_servo.teleop.servo_gamepad import ServoGamepad
from arm_servo.teleop.servo_keyboard_input import ServoKeyboardInput
from node_runner import ParameterError
from operator_input import OperatorInputError


def test_a_refusal_is_one_line_of_the_log() -> None:
    """Of a stream too, where only numbers differ; another reason is another line.

    The status forgets it after a while, or with an accepted command. Later it is logged again.
    """
    refusals, lines = Refusals(), []
    for number in range(100):
        now = 0.03 * number
        refusals.note(f'stale: {0.1 + now:.2f} s old when it was read', now)
        assert refusals.fresh(now).startswith('stale')
        lines.append(refusals.to_log(now))
    assert [line for line in lines if line] == ['stale: 0.10 s old when it was read']
    refusals.note('paused', 3.0)
    assert refusals.to_log(3.0) == 'paused'
    later = 3.1 + STATUS_PERIOD
    assert refusals.fresh(later) == refusals.to_log(later) == ''
    again = 3.1 + REPEAT_PERIOD
    refusals.note('paused', again)
    assert refusals.to_log(again) == 'paused'
    refusals.clear(again)
    assert refusals.fresh(again) == ''


SPACE = '/refused'  # nodes of tests of before may still be known in the domain
URDF, SRDF, LIMITS = two_arms_texts()
TWO_ARMS = {
    'robot_description': URDF,
    'robot_description_semantic': SRDF,
    'group': 'left',
    'other_groups': ['right'],
    'limits': LIMITS,
    'controller_name': 'right_controller',
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
    limits = FOLDER / 'gp110' / 'limits.yaml'
    if table := values.pop('limits', None):
        limits = folder / 'limits.yaml'
        limits.write_text(json.dumps({'joint_limits': table}))
    arm = {'robot_description': urdf, 'robot_description_semantic': srdf}
    whole = arm | {'joint_limits': str(limits)} | values
    file = folder / 'parameters.yaml'
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
        (motion, TWO_ARMS, 'another group of this robot'),
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


LATE = ServoSettings(ik=IkSettings(brakes=VelocityBoundsSettings(pairs=0)))
"""With these a jog brakes in front of no link, so that the safety filter stops it."""


SLOWED, HALTED = ServoStatus.DECELERATE_FOR_COLLISION, ServoStatus.HALT_FOR_COLLISION


SIDEWAYS = [0.0, 0.1, 0.0, 0.0, 0.0, 0.0]  # of the tool
OUTWARDS = {'panda_joint1': 2.0}  # to its end
INWARDS = {'panda_joint6': -1.0}  # the hand into the forearm


@pytest.mark.parametrize(
    ('name', 'servo', 'asked', 'codes', 'words'),
    [
        ('panda', ServoSettings(), SIDEWAYS, [ServoStatus.NO_WARNING], ['free']),
        ('panda', ServoSettings(), OUTWARDS, [ServoStatus.JOINT_BOUND], ['panda_joint1']),
        ('panda', ServoSettings(), INWARDS, [SLOWED, HALTED], ['panda_link5', 'panda_hand']),
        ('panda', LATE, INWARDS, [HALTED], ['panda_link5', 'panda_hand']),
        ('gp110', ServoSettings(), SIDEWAYS, [ServoStatus.HALT_FOR_SINGULARITY], ['y is lost']),
    ],
)
def test_what_limits_a_jog_is_reported(
    name: str,
    servo: ServoSettings,
    asked: list[float] | dict[str, float],
    codes: list[int],
    words: list[str],
) -> None:
    """As soon as it slows down, with the joint, the links or the direction."""
    begin = STRAIGHT['gp110'].tolist() if name == 'gp110' else None
    drives = Drives(name, begin=begin, settings=CoreSettings(servo=servo)).following()
    if isinstance(asked, dict):
        jog(drives.gateway, asked, drives.now, 60.0)
    else:
        twist(drives.gateway, asked, drives.now, 60.0)
    found: dict[int, str] = {}
    for _ in range(60 if asked is SIDEWAYS else 300):
        drives.run()
        code, text = status_of(drives.gateway.snapshot, '', '', '')
        found[code] = text
    assert set(codes) <= set(found)
    assert code == codes[-1]
    assert all(word in found[codes[-1]] for word in words)
    assert drives.gateway.model.clearance(drives.path[-1]) > 0.004


def test_what_stops_a_trajectory_is_reported_too() -> None:
    """The safety filter holds whatever moves the arm; its code is not only the jog's."""
    drives = Drives().following()
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
    # what rounding leaves beyond the limit is no negative zero
    beyond = replace(halted, amount=-1e-9)
    assert str(beyond) == 'joint limit: elbow, 0.000 left, halted'


def test_it_reports_what_moves_the_arm_and_why_it_does_not() -> None:
    """A refusal first of all, with the remedy; a cycle that stands still is no news."""
    drives = Drives().following()

    def status(
        refusal: str = '', paused: str = '', capped: str = '', age: float = 0.0
    ) -> tuple[int, str]:
        drives.run(3)
        return status_of(drives.gateway.snapshot, refusal, paused, capped, age)

    assert status() == (ServoStatus.NO_WARNING, 'ready')
    assert status('stale', 'paused', 'cut') == (ServoStatus.INVALID, 'stale')
    assert status(paused='paused', capped='cut') == (ServoStatus.NO_WARNING, 'paused')
    move_by(drives.gateway, {'panda_joint1': 0.3})
    assert 'target' in status()[1]
    twist(drives.gateway, [0.0, 0.02, 0.0, 0.0, 0.0, 0.0], drives.now, 60.0)
    assert status(capped='cut to 1')[1].startswith('cut to 1')
    code, words = status(age=3.0)
    assert code == ServoStatus.INVALID
    assert '3.0 s ago' in words
    drives.gateway.command(PauseRequest())
    assert '~/resume' in status()[1]
    drives.source.released('panda_joint1', Refusal(RefusalCause.SINGLE_TARGET))
    code, words = status()
    assert code == ServoStatus.INVALID
    assert 'panda_joint1' in words
