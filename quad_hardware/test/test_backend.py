# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The robot on a pseudo-terminal as a back end: without ROS, in real time."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
import json
import math
from pathlib import Path
from statistics import median
import threading
import time
from typing import NamedTuple

import pytest

from quad_description import movable_joints, Pose, pose_positions, robot_urdf, RobotState
from quad_hardware import CommandError, NoAnswerError, RecordingError
from quad_hardware.backend import recorded_in, ReplayedRobot, SerialBackend
from quad_hardware.estimation import EstimatorSettings, ImuMounting
from quad_hardware.joints import JointMap, LimiterSettings, MAX_PERIOD, servo_of
from quad_hardware.link import LinkOptions, LinkState
from quad_hardware.protocol import BULK_READ_ORDER, LEG_MOTORS, MOTOR_ORDER, Protocol, V1, V2
from quad_hardware.recording import read_serial_log
from quad_hardware.serial_robot import RobotSettings, SerialRobot
from quad_pty_peer import PtyPeer, TIMEOUT, wait_for

URDF = robot_urdf('lite')
JOINTS = JointMap(map(servo_of, movable_joints(URDF)))
POSE = pose_positions(Pose.STAND)
STAND = [POSE[name] for name in JOINTS.names]
STANDING = (0.0, 0.6, -0.3) * 4
LIFTED = (0.0, 0.9, -0.9)  # of a leg in the air


def settings_at(port: Path, log: Path | None = None) -> RobotSettings:
    """Return a robot whose bytes are written to a log, if there is one."""
    mounting = ImuMounting(checked=log is not None, rates_checked=log is not None)
    estimator = EstimatorSettings(mounting=mounting)
    return RobotSettings(LinkOptions(str(port)), URDF, JOINTS, estimator=estimator, serial_log=log)


class Seen(NamedTuple):
    """What was published of a robot, live or replayed."""

    states: list[RobotState]
    commands: int  # how many were sent

    def contact_ratios(self) -> list[float]:
        """Return the ratio of the states in which each foot stands."""
        contacts = [state.foot_contacts or () for state in self.states]
        return [sum(foot) / len(contacts) for foot in zip(*contacts, strict=True)]


def session(peer: PtyPeer, log: Path) -> Seen:
    """Record a robot that swings its legs in turn, while its body turns."""
    states: list[RobotState] = []
    arrived = threading.Condition()

    def take(state: RobotState) -> None:
        with arrived:
            states.append(state)
            arrived.notify_all()

    robot = SerialRobot(settings_at(peer.link, log))
    robot.on_state = take
    robot.start()
    try:
        for turn in range(50):
            leg = turn // 5 % 4
            lifts = turn < 40 and turn % 5 < 3  # at the end all stand, and nobody is laid down
            targets = STANDING[: 3 * leg] + LIFTED + STANDING[3 * leg + 3 :] if lifts else STANDING
            peer.behaviour.attitude = (0.0, 0.5, 0.5 * turn)
            with arrived:
                seen = len(states)

                def may_go_on(seen: int = seen) -> bool:  # a newer command replaces an unsent one
                    return len(states) > seen and len(peer.commands) >= robot.status().commands

                assert arrived.wait_for(may_go_on, TIMEOUT)
            robot.command(targets)
    finally:
        robot.end(lambda loss: None)
    return Seen(states, robot.status().commands)


def comparable(state: RobotState) -> tuple[object, ...]:
    """Return what was measured, as it came over the wire."""
    assert state.joints is not None
    assert state.imu is not None
    return (state.joints.positions, state.imu.orientation, state.imu.acceleration, state.battery)


@pytest.fixture(scope='module', params=[V2, V1], ids=lambda protocol: protocol.name)
def recorded(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Protocol, Path, Seen]:
    """Return the log of a session in a protocol, and what was seen live."""
    folder = tmp_path_factory.mktemp('session')
    with PtyPeer(folder / 'port', request.param) as peer:
        return request.param, folder / 'serial.log', session(peer, folder / 'serial.log')


@pytest.mark.xdist_group('replayed_robot')
@pytest.mark.slow
def test_the_states_of_a_log_are_those_of_the_robot(recorded: tuple[Protocol, Path, Seen]) -> None:
    """Measured values are the same; what needs times is as near as the times are."""
    _, log, live = recorded
    replayed = recorded_in(log, URDF, imu_checked=True)
    by_measured = {comparable(state): state for state in reversed(replayed)}
    first_live = {comparable(state): state for state in reversed(live.states)}
    assert len(first_live) > 20
    assert first_live.keys() <= by_measured.keys()
    pairs = [(state, by_measured[measured]) for measured, state in first_live.items()]
    shift = median(theirs.time - ours.time for ours, theirs in pairs)
    assert median(abs(theirs.time - ours.time - shift) for ours, theirs in pairs) < 0.005
    # commands count from when they were sent, live from when they were accepted
    places = [(o.position, t.position) for o, t in pairs]
    assert median(math.dist(o, t) for o, t in places if o is not None and t is not None) < 0.01
    assert all(state.linear_velocity is not None for state in replayed)
    assert replayed[-1].position != replayed[0].position


def fed(path: Path, *, pause: float = 0.0) -> tuple[ReplayedRobot, list[LinkState], Seen]:
    """Replay a log; return the robot, the states of its link, and what was published."""
    states: list[RobotState] = []
    changes: list[LinkState] = []
    robot = ReplayedRobot(replace(settings_at(path, path), serial_log=None))
    robot.on_state, robot.on_change = states.append, lambda state, _: changes.append(state)
    for entry in read_serial_log(path):
        robot.take(entry, entry.time)
    robot.advance(entry.time + pause)
    return robot, changes, Seen(states, robot.status().commands)


@pytest.mark.xdist_group('replayed_robot')
@pytest.mark.slow
def test_commands_feet_and_link_are_those_of_the_robot(
    recorded: tuple[Protocol, Path, Seen],
) -> None:
    """Each command of the log counts; after the last entry the reports become old.

    A second turn begins anew.
    """
    protocol, log, live = recorded
    robot, changes, replayed = fed(log, pause=2.0)
    assert replayed.commands == live.commands
    assert live.commands >= 40
    assert replayed.contact_ratios() == pytest.approx(live.contact_ratios(), abs=0.1)
    assert max(live.contact_ratios()) < 1.0
    status = robot.status()
    assert changes[0] is LinkState.WAITING
    assert LinkState.RUNNING in changes
    assert changes[-1] is LinkState.STOPPED
    assert (status.protocol, status.firmware) == (protocol.name, 'L-2.0.0')
    assert status.baud == protocol.baud
    assert len(replayed.states) >= len(live.states) >= 50
    assert status.parser.damaged == status.parser.skipped == 0
    assert status.age >= 2.0
    robot.restart()
    assert robot.latest is None
    assert robot.status().state is LinkState.CONNECTING


@pytest.mark.xdist_group('replayed_robot')
@pytest.mark.parametrize(
    ('lines', 'reason'),
    [
        (['< 55 00'], 'before the line `open`'),
        (['open', '< 55 00'], 'no report'),
        (['open vendor'], "protocol 'vendor'"),
        (['open v1'], 'no model'),
        ([], 'no report'),
    ],
)
def test_a_log_that_shows_no_robot_is_refused(
    tmp_path: Path, lines: list[str], reason: str
) -> None:
    """With what is missing in it."""
    path = tmp_path / 'cut.log'
    opened = {'port': 'p', 'baud': 1, 'firmware': 'L', 'model': None}
    with path.open('w') as log:
        for line in lines:
            kind, _, protocol = line.partition(' ')
            entry = json.dumps({**opened, 'protocol': protocol or 'v2'})
            log.write(f'(1.000000) {f"open {entry}" if kind == "open" else line}\n')
    with pytest.raises(RecordingError, match=reason):
        recorded_in(path, URDF)


@pytest.fixture(params=[V2, V1], ids=lambda protocol: protocol.name)
def peer(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[PtyPeer]:
    """A robot without physics."""
    protocol: Protocol = request.param
    with PtyPeer(tmp_path / 'port', protocol) as peer:
        yield peer


def backend_of(peer: PtyPeer) -> SerialBackend:
    """A back end for it."""
    return SerialBackend(settings_at(peer.link))


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


def test_torque_comes_back_where_the_arm_is(peer: PtyPeer) -> None:
    """Each reported servo gets its own position as target before it wakes; an arm would snap."""
    urdf = robot_urdf('lite', arm=True)
    joints = JointMap(map(servo_of, movable_joints(urdf)))
    robot = SerialRobot(RobotSettings(LinkOptions(str(peer.link)), urdf, joints))
    moved = pytest.approx((math.radians(20.0),) * 12, abs=0.02)

    def is_moved() -> bool:
        sample = robot.latest and robot.latest.joints
        return bool(sample and sample.positions[:12] == moved)

    robot.start()
    try:
        wait_for(lambda: robot.set_torque(on=False), 'robot')
        wait_for(lambda: not peer.torque, 'torque off')
        peer.angles.update(dict.fromkeys(peer.angles, 20.0))
        wait_for(is_moved, 'report of where it was put')
        assert robot.set_torque(on=True)
        wait_for(lambda: peer.torque, 'torque on')
    finally:
        robot.end(print)
    targets = {motor: angle for angles in peer.commands for motor, angle in angles.items()}
    reported = MOTOR_ORDER if peer.protocol is V2 else BULK_READ_ORDER
    assert targets == dict.fromkeys(reported, pytest.approx(20.0, abs=0.6))


@pytest.mark.parametrize('peer', [V2], indirect=True)
def test_commands_that_could_not_leave_add_up_to_no_jump(peer: PtyPeer) -> None:
    """A computer that holds up only the thread of the line sends the newest, one step on."""
    robot = SerialRobot(settings_at(peer.link))
    robot.start()
    try:
        wait_for(lambda: robot.command([0.0] * 12), 'robot')
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
    assert max(steps) <= math.degrees(LimiterSettings().max_joint_speed * MAX_PERIOD) + 0.01


def test_what_is_no_command_is_refused(peer: PtyPeer) -> None:
    """Before a byte leaves, with the reason."""
    with backend_of(peer) as backend:
        backend.reset()
        with pytest.raises(CommandError, match='finite'):
            backend.step([math.nan] * 12)
        backend.step(None)
    assert peer.commands == []


@pytest.mark.parametrize('peer', [V2], indirect=True)
def test_a_program_that_stops_stepping_leaves_no_leg_in_the_air(peer: PtyPeer) -> None:
    """As with the node: 0.5 s after the last targets the robot is laid down."""
    lifted = [q + 0.3 * (name == 'fl_thigh_joint') for name, q in POSE.items()]
    lying = JOINTS.angles([pose_positions(Pose.LIE)[name] for name in JOINTS.names])
    with backend_of(peer) as backend:
        backend.reset()
        for _ in range(80):
            backend.step(lifted)
        legs = pytest.approx([lying[motor] for motor in LEG_MOTORS], abs=1.5)
        wait_for(lambda: [peer.angles[motor] for motor in LEG_MOTORS] == legs, 'lying pose')


def test_a_robot_that_is_lost_is_reported(peer: PtyPeer) -> None:
    """By the step that waits for its report."""
    with backend_of(peer) as backend:
        backend.reset()
        peer.behaviour.silent = True
        with pytest.raises(NoAnswerError):
            deque(iter(lambda: backend.step(None), None), maxlen=0)


def test_what_protocol_v1_cannot_send_is_a_limit_of_the_joint(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """93 of 109 degrees of a mini: the clamp is reported. As a lite it is not commanded."""
    urdf = robot_urdf('mini')
    joints = JointMap(map(servo_of, movable_joints(urdf)))
    beyond = [1.9 if name == 'fl_thigh_joint' else q for name, q in POSE.items()]
    monkeypatch.setattr('quad_hardware.backend.CONNECT_TIME', 0.1)
    with PtyPeer(tmp_path / 'port', V1, firmware='M-4.3.3') as peer:
        with backend_of(peer) as other:

            def refused() -> bool:
                with pytest.raises(NoAnswerError) as refusal:
                    other.reset()
                return 'start with preset mini' in str(refusal.value)

            wait_for(refused, 'refusal that names the preset')
        robot = SerialRobot(RobotSettings(LinkOptions(str(peer.link)), urdf, joints))
        warnings: list[str] = []
        robot.on_warning = warnings.append
        robot.start()
        wait_for(lambda: robot.latest is not None, 'robot')
        wait_for(lambda: robot.command(beyond) and peer.angles[12] > 92.0, 'leg at its limit')
        sent = robot._estimator._sent['fl_thigh_joint']
        robot.end(warnings.append)
    assert robot.counters.clamped > 0
    assert any('beyond limits, taken to them: fl_thigh_joint' in text for text in warnings)
    assert sent == pytest.approx(math.radians(93.0), abs=0.01)
