# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The black box of a running hardware_node: its last bytes are there, and can be replayed."""

from __future__ import annotations

from pathlib import Path
import re
from typing import TYPE_CHECKING

from diagnostic_msgs.msg import DiagnosticStatus
from processes import executable, RunningProcess
import pytest

from quad_hardware.link import LinkState
from quad_hardware.protocol import (
    Code,
    Frame,
    HOST_KINDS,
    Kind,
    ROBOT_KINDS,
    STATE,
    StreamParser,
    V2,
)
from quad_hardware.recording import Opened, read_serial_log, StateEntered, Transfer
from quad_node_rig import NodeRig

if TYPE_CHECKING:
    from isolation import Isolation

pytestmark = pytest.mark.scenario

POSES = [[0.0, thigh, -0.3] * 4 for thigh in (0.2, 0.4, 0.6)]
"""It rests in each, so that a busy machine sees them all."""


def black_box(status: DiagnosticStatus) -> str:
    """Return what a status has of the black box."""
    return next((pair.value for pair in status.values if pair.key == 'black_box'), '')


def replay_command(log: Path, *arguments: str) -> list[str]:
    """Return the command that replays a log."""
    parameters = (f'log:={log}', 'diagnostics_period:=0.1', *arguments)
    words = [word for parameter in parameters for word in ('-p', parameter)]
    return [executable('quad_hardware', 'replay'), '--ros-args', *words]


def assert_replayed(rig: NodeRig, env: dict[str, str], log: Path) -> None:
    """Replay a log; the topics have what they had, and nobody takes commands."""
    live = {topic: list(messages) for topic, messages in rig.received.items()}
    for messages in rig.received.values():
        messages.clear()
    with RunningProcess(replay_command(log, 'loop:=true', 'rate:=2.0'), env) as player:
        rig.wait_for_status('serial link', DiagnosticStatus.OK, 'reports arrive')
        known = {tuple(message.position) for message in live['/joint_states']}
        states = rig.received['/joint_states']

        def moves() -> bool:
            return len(known & {tuple(message.position) for message in states}) >= 3

        rig.client.spin_until(moves, 20.0, 'a motion, to the bit as it was')
        player.wait_for('stale: no report')
        assert player.stop() == 0, player.output
    for topic in ('/imu', '/odom', '/battery_state', '/tf'):
        assert rig.received[topic], topic
    ours, theirs = rig.received['/imu'][-1], live['/imu'][-1]
    assert (ours.header.frame_id, ours.orientation) == (theirs.header.frame_id, theirs.orientation)


def assert_whole(path: Path, log: Path, commands: list[dict[int, float]]) -> None:
    """The box has robot, states, reports and commands; so has the log that was wanted."""
    entries = list(read_serial_log(path))
    opened, waiting = entries[:2]
    assert isinstance(opened, Opened)
    assert (opened.protocol, opened.baud, opened.firmware) == ('v2', V2.baud, 'L-2.0.0')
    assert isinstance(waiting, StateEntered)
    states = [entry.state for entry in entries if isinstance(entry, StateEntered)]
    running, stale = states.index(LinkState.RUNNING), states.index(LinkState.STALE)
    assert states[0] is LinkState.WAITING
    assert running < stale < len(states) - 1, states

    robot, host = StreamParser(V2, ROBOT_KINDS), StreamParser(V2, HOST_KINDS)
    reports: list[Frame] = []
    sent: list[Frame] = []
    for entry in entries:
        if isinstance(entry, Transfer):
            (sent if entry.sent else reports).extend(
                (host if entry.sent else robot).feed(entry.data)
            )
    assert robot.counters.damaged == robot.counters.skipped == host.counters.skipped == 0
    pushed = [frame for frame in reports if frame.kind is Kind.PUSH]
    assert len(pushed) > 50
    assert {frame.address for frame in pushed} == {STATE.address}
    servos = V2.functions[Code.SERVOS]
    targets = [servos.unpack(frame.payload) for frame in sent if frame.address == Code.SERVOS]
    angles = [dict(zip(map(int, t['motor']), t['angle'], strict=True)) for t in targets]
    assert angles == commands[: len(angles)]
    assert angles[-1] == commands[-1]

    report = (path.parent / 'report.txt').read_text('utf-8')
    assert 'L-2.0.0, protocol v2 at 2000000 baud' in report
    assert f'replay --ros-args -p log:={path}' in report
    assert 'running: reports arrive' in report.partition('reported:')[2]
    # the log on demand has all that the black box has, to the byte
    everything = [e for e in read_serial_log(log) if isinstance(e, Transfer)]
    kept = [entry.data for entry in entries if isinstance(entry, Transfer)]
    assert [entry.data for entry in everything[: len(kept)]] == kept


def test_a_fault_is_written_with_what_came_before_and_after(
    isolation: Isolation, tmp_path: Path
) -> None:
    """Log and /diagnostics have the path; both directions are in it, as they were on the line."""
    folder, log = tmp_path / 'boxes', tmp_path / 'all.log'
    arguments = ('-p', f'black_box_folder:={folder}', '-p', f'serial_log:={log}')
    with NodeRig(isolation, tmp_path, *arguments) as rig:
        for pose in POSES:
            rig.stream(pose, 0.5)
        assert black_box(rig.status('serial link')) == ''
        rig.peer.behaviour.silent = True
        rig.node.wait_for('stale: no report')  # at once: the box is written 3 s later
        rig.peer.behaviour.silent = False
        line = rig.node.wait_for(r'black box: .*serial\.log')
        found = re.search(r'black box: (\S+) \((.*)\)', line)
        assert found is not None
        path = Path(found[1])
        assert found[2].startswith('serial link: stale: no report')
        assert path.parent.parent == folder
        rig.client.spin_until(
            lambda: black_box(rig.status('serial link')) == str(path), 20.0, 'path in diagnostics'
        )
        commands = list(rig.peer.commands)
        with RunningProcess(replay_command(path), isolation.env) as refused:
            assert refused.wait(60.0) == 1, refused.output
            refused.wait_for('runs already.*__ns:=/replay')
        assert rig.node.stop() == 0
        assert_replayed(rig, isolation.env, path)

    assert_whole(path, log, commands)
