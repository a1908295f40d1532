# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What is recorded: black boxes of a master, their replay, and bags of whole robots."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
import re
import signal
import struct
import time

from bus_watch import BusRecorder
import can
from diagnostic_msgs.msg import DiagnosticArray
from frontend_cli import PROGRAM, with_frontend
from isolation import Isolation
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from processes import executable, RunningProcess
import pytest
from ros_client import RosClient
from rosbags.rosbag2 import Reader
from sensor_msgs.msg import JointState
from simulated_arm import JOINTS, panda_bus, SimulatedArm
from simulated_quad import SimulatedQuad

from canopen_core.can import read_log
from canopen_core.standard import CobId

pytestmark = pytest.mark.scenario

FAULTY = 4  # node id of panda_joint3
TOO_HOT = 0x4310


def diagnosed(messages: list[DiagnosticArray]) -> dict[str, str]:
    """Return the path of the black box by the name of the status, of the last message."""
    statuses = messages[-1].status if messages else []
    return {
        status.name: value.value
        for status in statuses
        for value in status.values
        if value.key == 'black_box'
    }


def _writes_at_its_end_what_it_saw_last(arm: SimulatedArm, folder: Path) -> None:
    """Drives that are lost right before Ctrl-C are written at the end, without the wait."""
    for joint in arm.joints:
        assert arm.client.trigger(f'/{joint}/shutdown').success
    before = set(folder.glob('*/can.log'))
    arm.slaves.signal(signal.SIGKILL)
    arm.master.wait_for('panda_joint1: heartbeat lost')
    assert arm.master.stop() == 0, arm.master.output
    assert 'heartbeat lost' in arm.master.wait_for(r'black box: .*can\.log', count=2)
    (path,) = set(folder.glob('*/can.log')) - before
    assert any(frame.can_id == CobId.SYNC for frame in read_log(path))


MOVED = 'panda_joint3'
POSITION = 0x284  # CAN identifier of its TPDO with the position
SHOWN = ('state', 'statusword', 'error_code', 'mode', 'nmt_state', 'emergency')


@dataclass
class Received:
    """What was received of the moved drive."""

    states: list[JointState] = field(default_factory=list)  # its joint states
    robot: list[JointState] = field(default_factory=list)  # joint states of the robot
    diagnostics: list[DiagnosticArray] = field(default_factory=list)  # messages of /diagnostics

    @classmethod
    def by(cls, client: RosClient) -> Received:
        """Listen."""
        return cls(
            client.listen(JointState, f'/{MOVED}/joint_states', 100),
            client.listen(JointState, '/joint_states', 100),
            client.listen(DiagnosticArray, '/diagnostics'),
        )

    @property
    def positions(self) -> set[float]:
        """Positions of the drive."""
        return {message.position[0] for message in self.states}

    def faulted(self) -> dict[str, str]:
        """Return what the diagnostics say of the drive since its fault; empty before."""
        for message in self.diagnostics:
            for status in message.status:
                values = {value.key: value.value for value in status.values}
                if status.name == f'{MOVED}: drive' and values['state'] == 'Fault':
                    return {key: values[key] for key in SHOWN}
        return {}


def replay(path: Path, *arguments: str) -> list[str]:
    """Return the command that replays a log of the arm."""
    parameters = (f'log:={path}', f'bus_config:={panda_bus()}', 'diagnostics_period:=0.1')
    words = [word for parameter in parameters for word in ('-p', parameter)]
    return [executable('arm_canopen', 'replay'), '--ros-args', *words, *arguments]


def test_a_fault_is_written_and_seen_again_as_when_it_happened(
    isolation: Isolation, tmp_path: Path
) -> None:
    """What was on the bus is in the black box, before and after; its replay shows the same.

    Log and /diagnostics have its path. Beside a master, there is no replay.
    """
    folder = tmp_path / 'boxes'
    arguments = ['robot_joint_states:=true', f'black_box_folder:={folder}']
    words = [word for each in arguments for word in ('-p', each)]
    with (
        BusRecorder(isolation.bus) as recorder,
        SimulatedArm(isolation, master_arguments=words) as arm,
    ):
        live = Received.by(arm.client)
        arm.init_all()
        assert arm.client.trigger(f'/{MOVED}/position_mode').success
        assert arm.send_target(MOVED, 1.0).success
        arm.client.spin_until(lambda: len(live.positions) > 50, 30.0, 'motion')
        fault_at = time.monotonic()
        arm.inject(MOVED, 'over_temperature')
        line = arm.master.wait_for(r'black box: .*can\.log')
        found = re.search(r'black box: (\S+)', line)
        assert found is not None
        path = Path(found[1])
        assert path.parent.parent == folder
        expected = {'master: bus': str(path), f'{MOVED}: drive': str(path)}
        arm.client.spin_until(
            lambda: {k: v for k, v in diagnosed(live.diagnostics).items() if v} == expected,
            20.0,
            'path of the black box in /diagnostics',
        )
        arm.client.spin_until(lambda: bool(live.faulted()), 30.0, 'fault in /diagnostics')
        recorder.pause()
        refused = arm.run(*replay(path))
        assert refused.wait(60.0) == 1, refused.output
        refused.wait_for('runs already.*__ns:=/replay')
        _writes_at_its_end_what_it_saw_last(arm, folder)
    check_log(path, recorder, fault_at)
    check_replay(path, isolation, live)


def check_log(path: Path, recorder: BusRecorder, fault_at: float) -> None:
    """Compare a log with what a bystander saw, and with how others read it."""
    ours = list(read_log(path))
    emergency = CobId.EMCY + FAULTY
    (raised,) = [
        number
        for number, frame in enumerate(ours)
        if frame.can_id == emergency and frame.data[:2] == TOO_HOT.to_bytes(2, 'little')
    ]
    before, after = ours[:raised], ours[raised:]
    assert after[-1].timestamp - after[0].timestamp > 2.0
    assert {frame.can_id for frame in before} >= {CobId.NMT, CobId.SYNC, 0x182, 0x202, 0x602}
    theirs = [(each.arbitration_id, bytes(each.data)) for each in can.LogReader(path)]
    assert theirs == [(frame.can_id, frame.data) for frame in ours]
    for can_id in (0x204, 0x584):  # commands of the master, answers of the drive
        of_box = iter([frame.data for frame in ours if frame.can_id == can_id])
        seen = [
            frame.data
            for frame in recorder.frames
            if frame.can_id == can_id and frame.timestamp < fault_at
        ]
        # a bystander that is too slow loses some; all that it saw are there, in their order
        assert seen
        assert all(data in of_box for data in seen)
    report = (path.parent / 'report.txt').read_text('utf-8')
    assert re.search(r'panda_joint3: .*0x4310', report), report
    assert 'panda_joint3 (4)' in report


def check_replay(path: Path, isolation: Isolation, live: Received) -> None:
    """Compare a replay with what was received live."""
    frames = [frame for frame in read_log(path) if frame.can_id == POSITION]
    recorded = {struct.unpack_from('<i', frame.data)[0] * 0.001 for frame in frames}
    looped = replay(path, '-p', 'robot_joint_states:=true', '-p', 'loop:=true')
    with (
        RosClient(isolation.domain_id, 'second_client') as client,
        RunningProcess(looped, isolation.env) as player,
    ):
        again = Received.by(client)
        client.spin_until(
            lambda: bool(again.faulted()) and len(again.positions & live.positions) > 25,
            60.0,
            'fault and motion of the log',
        )
        assert player.stop() == 0, player.output
    assert again.positions <= recorded
    assert live.positions <= recorded
    assert again.faulted() == live.faulted()
    assert again.robot[-1].name == live.robot[-1].name == JOINTS
    player.wait_for(f'{MOVED}: EMCY: 0x4310')
    player.wait_for(f'{MOVED}: FAULT: .*0x4310')


def test_a_replay_ends_when_the_master_comes(isolation: Isolation, tmp_path: Path) -> None:
    """No subscriber receives both; a damaged log is an error with its place."""
    log = tmp_path / 'bus.log'
    log.write_text('(1.000000) can0 080#\n(2.000000) can0 080#\n(3.0) can0 nonsense\n')
    with RunningProcess(replay(log, '-p', 'rate:=100.0'), isolation.env) as damaged:
        assert damaged.wait(60.0) == 1
        damaged.wait_for('line 3')
    log.write_text('(1.000000) can0 080#\n(9000.000000) can0 080#\n')
    master = [
        executable('arm_canopen', 'master'),
        '--ros-args',
        '-p',
        f'bus_config:={panda_bus()}',
    ]
    master += ['-p', f'can_interface_name:={isolation.bus}']
    with RunningProcess(replay(log), isolation.env) as player:
        player.wait_until_ready()
        with RunningProcess(master, isolation.env):
            assert player.wait(60.0) == 1, player.output
        player.wait_for('runs already')


DURATION = 4.0  # [s] of walking
RATE = 30.0  # [1/s]; what a topic of a cycle has at least
SEVERAL = {'/rosout', '/parameter_events', '/diagnostics', '/tf', '/tf_static'}
"""Topics that several nodes publish."""


def sequences(file: Path) -> dict[str, list[int]]:
    """Return the numbers that DDS gave the messages of each topic; every one is decoded."""
    found: dict[str, list[int]] = {}
    with file.open('rb') as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        for _, channel, message, decoded in reader.iter_decoded_messages():
            assert decoded is not None
            found.setdefault(channel.topic, []).append(message.sequence)
    return found


def runs(numbers: list[int]) -> int:
    """Count how many unbroken rows numbers make: one for each publisher that lost nothing."""
    ends: Counter[int] = Counter()
    count = 0
    for number in numbers:
        if ends[number - 1]:
            ends[number - 1] -= 1
        else:
            count += 1
        ends[number] += 1
    return count


def reported(output: str) -> dict[str, int]:
    """Return what the recorder says it has missed: where other processes starve it, DDS drops."""
    lines = re.findall(r'messages never arrived at the recorder: (.*)', output)
    pairs = [pair.split(': ') for line in lines for pair in line.split(', ')]
    return {name: int(count) for name, count in pairs}


@pytest.mark.slow
def test_all_of_arm_and_quadruped_is_recorded(isolation: Isolation, tmp_path: Path) -> None:
    """Every message is there or reported as lost; two readers that are not ours agree."""
    folder = tmp_path / 'bag'
    with (
        SimulatedArm(isolation) as arm,
        SimulatedQuad(isolation, tmp_path, tapped=False) as quad,
        RunningProcess(
            [*PROGRAM, 'bag', 'record', '-a', '-o', str(folder)], with_frontend(isolation.env)
        ) as recorder,
    ):
        recorder.wait_for('Recording...')
        arm.init_all()
        quad.stand()
        quad.walk(DURATION)
        assert recorder.stop(30.0) == 0
        assert arm.master.stop() == 0, arm.master.output
        assert arm.slaves.stop() == 0, arm.slaves.output
    assert 'dropped' not in recorder.output
    lost = reported(recorder.output)
    numbers = sequences(folder / 'bag_0.mcap')
    with Reader(folder) as reader:
        assert {
            name: topic.msgcount for name, topic in reader.topics.items() if topic.msgcount
        } == {name: len(each) for name, each in numbers.items()}
    cyclic = ['/joint_states', '/imu', *(f'/{joint}/joint_states' for joint in JOINTS)]
    for name in cyclic:
        assert len(numbers[name]) > DURATION * RATE, name
    for name in set(numbers) - SEVERAL:
        found = numbers[name]
        assert found == sorted(set(found)), name
        assert found[-1] - found[0] + 1 == len(found) + lost.get(name, 0), name
    nodes = len(JOINTS) + 10
    for name in SEVERAL & set(numbers):
        assert lost or runs(numbers[name]) <= nodes, name
