# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a black box has kept of a bus, replayed: the same messages as when it happened."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
import re
import struct
from typing import TYPE_CHECKING

from canopen_interfaces.srv import COTargetDouble
from diagnostic_msgs.msg import DiagnosticArray
from processes import executable, RunningProcess
import pytest
from ros_client import RosClient
from sensor_msgs.msg import JointState
from simulated_arm import JOINTS, panda_bus, SimulatedArm

from arm_msgs.srv import InjectFault
from canopen_core.can import read_log

if TYPE_CHECKING:
    from isolation import Isolation
pytestmark = pytest.mark.scenario

MOVED = 'panda_joint3'
POSITION = 0x284  # CAN identifier of its TPDO with the position
SHOWN = ('state', 'statusword', 'error_code', 'mode', 'nmt_state', 'emergency')


@dataclass
class Received:
    """What was received of the moved drive.

    Attributes:
        states: Its joint states.
        robot: Joint states of the robot.
        diagnostics: Messages of /diagnostics.
    """

    states: list[JointState] = field(default_factory=list)
    robot: list[JointState] = field(default_factory=list)
    diagnostics: list[DiagnosticArray] = field(default_factory=list)

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


def test_a_recorded_fault_is_seen_as_when_it_happened(
    isolation: Isolation, tmp_path: Path
) -> None:
    """Joint states and diagnostics of the replay are those of the master; beside it, none."""
    arguments = ['robot_joint_states:=true', f'black_box_folder:={tmp_path}']
    words = [word for each in arguments for word in ('-p', each)]
    with SimulatedArm(isolation, master_arguments=words) as arm:
        live = Received.by(arm.client)
        arm.init_all()
        assert arm.client.trigger(f'/{MOVED}/position_mode').success
        request = COTargetDouble.Request(target=1.0)
        assert arm.client.call(COTargetDouble, f'/{MOVED}/target', request).success
        arm.client.spin_until(lambda: len(live.positions) > 50, 30.0, 'motion')
        fault = InjectFault.Request(fault='over_temperature')
        assert arm.client.call(InjectFault, f'/fake_slaves/{MOVED}/fault', fault).success
        arm.client.spin_until(lambda: bool(live.faulted()), 30.0, 'fault in /diagnostics')
        path = Path(re.search(r'black box: (\S+)', arm.master.wait_for('black box: '))[1])  # type: ignore[index]

        refused = arm.run(*replay(path))
        assert refused.wait(60.0) == 1, refused.output
        refused.wait_for('runs already.*__ns:=/replay')
        assert arm.master.stop() == 0
        assert arm.slaves.stop() == 0

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
