# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A log of a serial session, replayed: the states are those that the robot had live."""

from __future__ import annotations

from dataclasses import replace
import math
from pathlib import Path
from statistics import median
import threading
from typing import NamedTuple

import pytest

from quad_description import ContactSource, movable_joints, robot_urdf, RobotState
from quad_hardware import RecordingError
from quad_hardware.backend import recorded_in, ReplayedRobot
from quad_hardware.estimation import EstimatorSettings, ImuMounting
from quad_hardware.joints import JointMap, servo_of
from quad_hardware.link import LinkOptions, LinkState
from quad_hardware.protocol import Protocol, V1, V2
from quad_hardware.recording import read_serial_log
from quad_hardware.serial_robot import RobotSettings, SerialRobot
from quad_pty_peer import PtyPeer

pytestmark = pytest.mark.xdist_group('replayed_robot')

URDF = robot_urdf()
STAND = (0.0, 0.6, -0.3) * 4
LIFTED = (0.0, 0.9, -0.9)  # of a leg in the air
TIMEOUT = 30.0  # [s] for a report, on a busy machine


def settings_at(port: Path, log: Path) -> RobotSettings:
    """Return a robot whose bytes are written to a log."""
    return RobotSettings(
        LinkOptions(str(port)),
        URDF,
        JointMap(map(servo_of, movable_joints(URDF))),
        estimator=EstimatorSettings(mounting=ImuMounting(checked=True, rates_checked=True)),
        serial_log=log,
    )


class Seen(NamedTuple):
    """What was published of a robot, live or replayed."""

    states: list[RobotState]
    commands: int  # how many were sent

    def contact_ratios(self) -> list[float]:
        """Return the ratio of the states in which each foot stands."""
        contacts = [state.foot_contacts or () for state in self.states]
        return [sum(foot) / len(contacts) for foot in zip(*contacts, strict=True)]

    def ratio_of(self, source: ContactSource) -> float:
        """Return the ratio of the states whose contacts are known so."""
        ways = [state.odometry for state in self.states if state.odometry]
        return sum(way.contact_source is source for way in ways) / len(ways)


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
            targets = STAND[: 3 * leg] + LIFTED + STAND[3 * leg + 3 :] if lifts else STAND
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


@pytest.mark.slow
def test_the_states_of_a_log_are_those_of_the_robot(
    recorded: tuple[Protocol, Path, Seen],
) -> None:
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


@pytest.mark.slow
def test_commands_and_the_feet_that_they_let_stand_are_those_of_the_robot(
    recorded: tuple[Protocol, Path, Seen],
) -> None:
    """Each command of the log counts, and the contacts are known by them as they were live."""
    _, log, live = recorded
    _, _, replayed = fed(log)
    assert replayed.commands == live.commands
    assert live.commands >= 40
    for source in ContactSource:
        assert replayed.ratio_of(source) == pytest.approx(live.ratio_of(source), abs=0.1)
    assert live.ratio_of(ContactSource.COMMANDED_HEIGHT) > 0.5
    assert replayed.contact_ratios() == pytest.approx(live.contact_ratios(), abs=0.1)
    assert max(live.contact_ratios()) < 1.0


@pytest.mark.slow
def test_status_is_that_of_the_link_and_a_second_turn_begins_anew(
    recorded: tuple[Protocol, Path, Seen],
) -> None:
    """Protocol, firmware, counters, age; after the last entry the reports become old."""
    protocol, log, live = recorded
    robot, changes, replayed = fed(log, pause=2.0)
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
    text = ''
    for line in lines:
        kind, _, protocol = line.partition(' ')
        opened = (
            f'open {{"port": "p", "baud": 1, "protocol": "{protocol or "v2"}", "firmware": "L", '
            '"model": null}'
        )
        text += f'(1.000000) {opened if kind == "open" else line}\n'
    path.write_text(text)
    with pytest.raises(RecordingError, match=reason):
        recorded_in(path, URDF)
