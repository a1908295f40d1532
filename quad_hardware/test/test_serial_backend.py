# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The robot on a pseudo-terminal as a back end: without ROS, in real time."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
import math
from pathlib import Path
import time

import pytest

from quad_description import movable_joints, Pose, pose_positions, robot_urdf
from quad_hardware import CommandError, NoAnswerError
from quad_hardware.backend import SerialBackend
from quad_hardware.joints import JointMap, LimiterSettings, MAX_PERIOD, servo_of
from quad_hardware.link import LinkOptions
from quad_hardware.protocol import LEG_MOTORS, Protocol, V1, V2
from quad_hardware.serial_robot import RobotSettings, SerialRobot
from quad_pty_peer import PtyPeer

URDF = robot_urdf('lite')
JOINTS = JointMap(map(servo_of, movable_joints(URDF)))
POSE = pose_positions(Pose.STAND)
STAND = [POSE[name] for name in JOINTS.names]


@pytest.fixture(params=[V2, V1], ids=lambda protocol: protocol.name)
def peer(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[PtyPeer]:
    """A robot without physics."""
    protocol: Protocol = request.param
    with PtyPeer(tmp_path / 'port', protocol) as peer:
        yield peer


def backend_of(peer: PtyPeer) -> SerialBackend:
    """A back end for it."""
    return SerialBackend(RobotSettings(LinkOptions(str(peer.link)), URDF, JOINTS))


def test_it_observes_and_commands_in_si_units(peer: PtyPeer) -> None:
    """Attitude and joints in radians, in the order of the URDF; targets arrive as degrees."""
    peer.behaviour.attitude = (0.0, math.degrees(0.1), 0.0)
    with backend_of(peer) as backend:
        state = backend.reset()
        assert backend.names == JOINTS.names
        assert state.imu is not None
        assert state.imu.roll_pitch_yaw == pytest.approx((0.0, 0.1, 0.0), abs=2e-3)
        assert state.imu.is_uncertain  # nobody has compared its signs with gravity
        assert state.position is not None
        for _ in range(60):
            before, state = state, backend.step(STAND)
            assert state.time >= before.time
        assert state is backend.observe()
        assert state.joints is not None
        assert state.joints.positions == pytest.approx(STAND, abs=0.02)
    wanted = JOINTS.angles(STAND)
    assert {m: peer.angles[m] for m in LEG_MOTORS} == pytest.approx(wanted, abs=1.0)


@pytest.mark.parametrize('peer', [V2], indirect=True)
def test_commands_that_could_not_leave_add_up_to_no_jump(peer: PtyPeer) -> None:
    """A computer that holds up only the thread of the line sends the newest, one step on."""
    robot = SerialRobot(RobotSettings(LinkOptions(str(peer.link)), URDF, JOINTS))
    robot.start()
    deadline = time.monotonic() + 10.0
    try:
        while not robot.command([0.0] * 12):
            assert time.monotonic() < deadline
            time.sleep(0.02)
        held = iter([0.4])
        for tick in range(60):
            if tick == 20:
                robot.on_state = lambda _: time.sleep(next(held, 0.0))
            robot.command([0.0, 0.0 if tick < 20 else 0.9, 0.0] * 4)
            time.sleep(0.02)
    finally:
        robot.end(print)
    angles = [command[12] for command in peer.commands]
    assert angles[-1] == pytest.approx(math.degrees(0.9), abs=0.1)
    steps = [abs(b - a) for a, b in pairwise(angles)]
    assert max(steps) <= math.degrees(LimiterSettings().speed * MAX_PERIOD) + 0.01


def test_what_is_no_command_is_refused(peer: PtyPeer) -> None:
    """Before a byte leaves, with the reason."""
    with backend_of(peer) as backend:
        backend.reset()
        with pytest.raises(CommandError, match='finite'):
            backend.step([math.nan] * 12)
        backend.step(None)
    assert peer.commands == []


def test_a_program_that_stops_stepping_leaves_no_leg_in_the_air(peer: PtyPeer) -> None:
    """As with the node: 0.5 s after the last targets the robot is laid down."""
    lifted = [q + 0.3 * (name == 'fl_thigh_joint') for name, q in POSE.items()]
    lying = JOINTS.angles([pose_positions(Pose.LIE)[name] for name in JOINTS.names])
    with backend_of(peer) as backend:
        backend.reset()
        for _ in range(80):
            backend.step(lifted)
        until = time.monotonic() + 10.0
        while time.monotonic() < until:
            if all(abs(peer.angles[motor] - lying[motor]) < 1.5 for motor in LEG_MOTORS):
                break
            time.sleep(0.05)
        else:
            pytest.fail(f'it is not laid down: {peer.angles}')


def test_a_robot_that_is_lost_is_reported(peer: PtyPeer) -> None:
    """By the step that waits for its report."""

    def step_for_ever() -> None:
        while True:
            backend.step(None)

    with backend_of(peer) as backend:
        backend.reset()
        peer.behaviour.silent = True
        with pytest.raises(NoAnswerError):
            step_for_ever()


def test_what_protocol_v1_cannot_send_is_a_limit_of_the_joint(tmp_path: Path) -> None:
    """93 of 109 degrees of a mini: the clamp is reported. As a lite it is not commanded."""
    urdf = robot_urdf('mini')
    joints = JointMap(map(servo_of, movable_joints(urdf)))
    beyond = [1.9 if name == 'fl_thigh_joint' else q for name, q in POSE.items()]
    with PtyPeer(tmp_path / 'port', V1, firmware='M-4.3.3') as peer:
        link = LinkOptions(str(peer.link))
        with (
            SerialBackend(RobotSettings(link, URDF, JOINTS)) as other,
            pytest.raises(NoAnswerError, match='start with preset mini'),
        ):
            other.reset()
        robot = SerialRobot(RobotSettings(link, urdf, joints))
        warnings: list[str] = []
        robot.on_warning = warnings.append
        robot.start()
        until = time.monotonic() + 15.0
        while time.monotonic() < until and peer.angles[12] < 92.0:
            if robot.latest is not None:
                robot.command(beyond)
            time.sleep(0.02)
        sent = robot._estimator._sent['fl_thigh_joint']
        robot.end(warnings.append)
    assert robot.counters.clamped > 0
    assert any('beyond limits, taken to them: fl_thigh_joint' in text for text in warnings)
    assert sent == pytest.approx(math.radians(93.0), abs=0.01)
