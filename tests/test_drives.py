# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Services, actions and topics of drives, over DDS and a real bus; one arm for all tests."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
import time
from typing import Any

from action_msgs.msg import GoalStatus
from canopen_interfaces.srv import CONmtID
from isolation import reserve
import numpy as np
import pytest
from ros_client import LATCHED
from sensor_msgs.msg import JointState
from simulated_arm import JOINTS, panda_bus, SimulatedArm
from std_msgs.msg import Float64, String
from std_srvs.srv import Trigger

from arm_msgs.action import Home
from arm_msgs.srv import Move, ReadObject, ReadUnits, WriteObject

pytestmark = pytest.mark.scenario
JOINT = '/panda_joint4'
FAILING = 'panda_joint5'


@pytest.fixture(scope='module')
def started() -> Iterator[SimulatedArm]:
    """Boot the arm, for all tests of this module."""
    with (
        reserve() as isolation,
        SimulatedArm(isolation, master_arguments=['-p', 'robot_joint_states:=true']) as arm,
    ):
        yield arm


@pytest.fixture
def arm(started: SimulatedArm) -> Iterator[SimulatedArm]:
    """Give a test the arm without faults, operational, with the drive without power."""
    yield started
    for joint in (JOINT[1:], FAILING):
        started.inject(joint, 'none')
        _expect_nmt(started, f'/{joint}', 'START')
        answer = started.client.trigger(f'/{joint}/shutdown')
        assert answer.success, answer.message


def _expect_nmt(arm: SimulatedArm, joint: str, state: str) -> None:
    states = arm.client.listen(String, f'{joint}/nmt_state', LATCHED)
    arm.client.spin_until(lambda: bool(states) and states[-1].data == state, 30.0, state)


def _read(arm: SimulatedArm, path: str) -> ReadObject.Response:
    return arm.client.call(ReadObject, f'{JOINT}/read_object', ReadObject.Request(object=path))


def _write(
    arm: SimulatedArm, path: str, value: str = '', data: bytes = b''
) -> WriteObject.Response:
    request = WriteObject.Request(object=path, value=value, data=data)
    return arm.client.call(WriteObject, f'{JOINT}/write_object', request)


class HomingRun:
    """A goal of the homing action."""

    def __init__(self, arm: SimulatedArm, method: int) -> None:
        self.phases: list[str] = []  # phases of its feedback
        self._client = arm.client
        client = arm.client.action(Home, f'{JOINT}/home')
        arm.client.spin_until(client.server_is_ready, 10.0, 'the action')
        goal = Home.Goal(method=method)
        sent = client.send_goal_async(goal, lambda each: self.phases.append(each.feedback.phase))
        arm.client.spin_until(sent.done, 10.0, 'acceptance')
        self.handle: Any = sent.result()  # handle of the accepted goal
        assert self.handle.accepted
        self._result = self.handle.get_result_async()

    def result(self) -> Any:
        """Wait for its end."""
        self._client.spin_until(self._result.done, 20.0, 'the result')
        return self._result.result()


def test_homing_as_an_action_and_as_a_service(arm: SimulatedArm) -> None:
    """Feedback has the phase, cancelling stops it, a method that fails says why."""
    done = HomingRun(arm, 35).result()
    assert done.status == GoalStatus.STATUS_SUCCEEDED
    assert done.result.success
    assert 'homed by method 35' in done.result.message
    assert done.result.position == pytest.approx(0.0, abs=1e-3)

    before = _read(arm, '0x6099:01').value
    assert _write(arm, '0x6099:01', '5').success  # [inc/s]
    slow = HomingRun(arm, 17)  # to a limit switch that is far away
    arm.client.spin_until(lambda: 'homing' in slow.phases, 10.0, 'feedback')
    assert not arm.client.trigger(f'{JOINT}/home').success  # busy
    cancelled = slow.handle.cancel_goal_async()
    arm.client.spin_until(cancelled.done, 10.0, 'the cancellation')
    ended = slow.result()
    assert ended.status == GoalStatus.STATUS_CANCELED
    assert 'homing was cancelled' in ended.result.message
    assert _write(arm, '0x6099:01', before).success

    wrong = HomingRun(arm, 36).result()
    assert wrong.status == GoalStatus.STATUS_ABORTED
    assert 'method 36' in wrong.result.message
    assert arm.client.trigger(f'{JOINT}/enable').success


def test_a_halt_right_after_a_goal_to_home_is_not_overtaken(arm: SimulatedArm) -> None:
    """The acceptance of a goal is delayed for its client."""
    assert arm.client.trigger(f'{JOINT}/enable').success
    client = arm.client.action(Home, f'{JOINT}/home')
    arm.client.spin_until(client.server_is_ready, 10.0, 'the action')
    arm.client.client_of(Trigger, f'{JOINT}/halt')
    messages = ['']
    deadline = time.monotonic() + 30.0
    while 'was stopped before it was homed' not in messages[-1]:
        assert time.monotonic() < deadline, messages  # which of the two comes first, DDS decides
        sent = client.send_goal_async(Home.Goal(method=35))
        halted = arm.client.call_async(Trigger, f'{JOINT}/halt', Trigger.Request())
        arm.client.spin_until(sent.done, 10.0, 'acceptance')
        arm.client.spin_until(halted.done, 10.0, 'the halt')
        assert halted.result().success, halted.result().message
        homed = sent.result().get_result_async()
        arm.client.spin_until(homed.done, 20.0, 'the result')
        messages.append(homed.result().result.message)


def test_one_of_many_homings_at_a_time_is_done(arm: SimulatedArm) -> None:
    """The others are refused at once, and the master goes on."""
    for _ in range(5):
        runs = [HomingRun(arm, 35) for _ in range(6)]
        ends = [run.result().result for run in runs]
        assert sum(end.success for end in ends) >= 1, [end.message for end in ends]
    assert arm.client.trigger(f'{JOINT}/enable').success


def test_units_are_those_of_the_masters_file(arm: SimulatedArm) -> None:
    """The answer says how the joint counts, and names the very file."""
    answer = arm.client.call(ReadUnits, f'{JOINT}/read_units', ReadUnits.Request())
    assert answer.success, answer.message
    scale = answer.scale_pos_to_dev
    assert scale > 0.0
    assert answer.scale_pos_from_dev == pytest.approx(1.0 / scale)
    assert answer.scale_vel_from_dev == pytest.approx(1.0 / answer.scale_vel_to_dev)
    assert (answer.device, answer.channel) == (JOINT[1:], -1)
    assert Path(answer.bus_config) == panda_bus()


def test_halt_quick_stop_moves_and_streams(arm: SimulatedArm) -> None:
    """Halt keeps the drive enabled, quick stop does not; moves add up; streams end in a stop."""
    for service in ('init', 'position_mode'):
        assert arm.client.trigger(f'{JOINT}/{service}').success
    refused = arm.client.trigger(f'{JOINT}/cyclic_torque_mode')
    assert not refused.success
    assert 'in no RPDO' in refused.message
    assert arm.send_target(JOINT[1:], 3.0).success
    halted = arm.client.trigger(f'{JOINT}/halt')
    assert halted.success, halted.message
    assert 'Operation enabled' in halted.message

    states = arm.client.listen(JointState, f'{JOINT}/joint_states')
    arm.client.spin_until(lambda: len(states) > 5, 10.0, 'joint states')
    relative = Move.Request(target=0.1, relative=True)
    assert not arm.client.call(Move, f'/{FAILING}/move', relative).success  # not enabled
    back = arm.client.call(Move, f'{JOINT}/move', Move.Request(target=0.0))
    assert back.success, back.message
    for _ in range(2):
        step = Move.Request(target=0.1, relative=True, queue=True)
        assert arm.client.call(Move, f'{JOINT}/move', step).success
    arm.client.spin_until(lambda: abs(states[-1].position[0] - 0.2) < 2e-3, 20.0, 'position 0.2')

    assert arm.client.trigger(f'{JOINT}/cyclic_position_mode').success
    stream = arm.client.node.create_publisher(Float64, f'{JOINT}/target', 10)
    arm.client.spin_until(lambda: stream.get_subscription_count() > 0, 10.0, 'the subscription')

    def send() -> bool:
        stream.publish(Float64(data=0.0))
        return bool(abs(states[-1].position[0]) < 2e-3)

    arm.client.spin_until(send, 20.0, 'position 0.0')
    arm.master.wait_for('the stream of targets has paused')
    stopped = arm.client.trigger(f'{JOINT}/quick_stop')
    assert stopped.success, stopped.message
    stream.publish(Float64(data=0.5))
    arm.master.wait_for('~/target: panda_joint4 takes no stream of targets')
    assert 'Switch on disabled' in arm.client.trigger(f'{JOINT}/shutdown').message


def test_stop_names_what_stands_and_what_is_not_known_to(arm: SimulatedArm) -> None:
    """Also for move_group, by its event; without success where a drive is lost."""
    assert arm.client.trigger(f'{JOINT}/init').success
    assert arm.client.trigger(f'{JOINT}/position_mode').success
    events = arm.client.listen(String, '/trajectory_execution_event')
    assert arm.send_target(JOINT[1:], 3.0).success
    answer = arm.client.trigger('/stop')
    assert answer.success, answer.message
    others = ', '.join(name for name in arm.joints if name != JOINT[1:])
    assert answer.message in {
        f'{what}: {JOINT[1:]}. not enabled: {others}' for what in ('stopped', 'stand')
    }
    arm.client.spin_until(lambda: [each.data for each in events] == ['stop'], 10.0, 'the event')
    lost = f'{FAILING}: heartbeat lost'
    count = len([line for line in arm.master.lines if lost in line])
    arm.inject(FAILING, 'power_off')
    arm.master.wait_for(lost, count=count + 1)
    answer = arm.client.trigger('/stop')
    assert not answer.success
    assert answer.message.startswith(f'NOT known to stand: {FAILING} is not seen to come to rest')
    assert f'stand: {JOINT[1:]}. not enabled: ' in answer.message


def test_objects_are_read_and_written_by_name(arm: SimulatedArm) -> None:
    """Any type comes as text and as bytes; what fails says why."""
    answer = _read(arm, 'Profile velocity')
    assert (answer.success, answer.message) == (True, '')
    assert (answer.index, answer.type, answer.value) == (0x6081, 'UNSIGNED32', '1000')
    assert bytes(answer.data) == (1000).to_bytes(4, 'little')
    text = _read(arm, '0x1008')
    assert text.type == 'VISIBLE_STRING'
    assert text.value == bytes(text.data).decode()
    assert len(text.value) > 4

    done = _write(arm, 'software position limit/min', '-2000')
    assert (done.success, done.index, done.subindex) == (True, 0x607D, 1), done.message
    assert '= -2000' in done.message
    assert _read(arm, '0x607D:01').value == '-2000'
    assert _write(arm, '0x607D:01', data=(0).to_bytes(4, 'little')).success
    assert _read(arm, '0x607D:01').value == '0'

    for refused, words in (
        (_read(arm, 'Contrlword'), '0x6040:00 Controlword'),
        (_read(arm, str(0x6041)), "object: '0x6041'"),  # what YAML makes of { object: 0x6041 }
        (_write(arm, str(0x6081), '1'), "object: '0x6081'"),
        (_write(arm, 'Profile velocity', 'fast'), "'fast'"),
        (_write(arm, 'Statusword', '1'), 'read'),
        (_write(arm, 'Controlword', '15'), 'written by its driver'),
    ):
        assert not refused.success
        assert words in refused.message


def test_nmt_commands_reach_one_device_or_all(arm: SimulatedArm) -> None:
    """Each service of a device, the master's for any, and a state that says what was received."""
    _expect_nmt(arm, JOINT, 'START')
    for service, state in (
        ('nmt_stop_node', 'STOP'),
        ('nmt_start_node', 'START'),
        ('nmt_enter_pre_operational', 'PREOP'),
    ):
        assert arm.client.trigger(f'{JOINT}/{service}').success
        _expect_nmt(arm, JOINT, state)
    everybody = CONmtID.Request(nmtcommand=1, nodeid=0)
    assert arm.client.call(CONmtID, '/master/set_nmt', everybody).success
    _expect_nmt(arm, JOINT, 'START')
    nonsense = CONmtID.Request(nmtcommand=7, nodeid=0)
    assert not arm.client.call(CONmtID, '/master/set_nmt', nonsense).success
    arm.master.wait_for('nmtcommand 7 is none of 1 START')
    booted = f'{JOINT[1:]}: operational'
    for service in ('nmt_reset_communication', 'nmt_reset_node'):
        count = len([line for line in arm.master.lines if booted in line])
        assert arm.client.trigger(f'{JOINT}/{service}').success
        arm.master.wait_for(booted, count=count + 1)
        _expect_nmt(arm, JOINT, 'START')


def test_the_master_publishes_the_joints_of_its_bus(arm: SimulatedArm) -> None:
    """All of a SYNC in one message, from one publisher; a drive that is lost is left out."""
    states = arm.client.listen(JointState, '/joint_states', 100)

    def published(names: list[str]) -> bool:
        return bool(states) and [*states[-1].name] == names

    arm.client.spin_until(lambda: published(JOINTS), 20.0, 'all joints')
    assert len(arm.client.node.get_publishers_info_by_topic('/joint_states')) == 1
    arm.client.spin_until(lambda: len(states) > 100, 20.0, 'more of them')
    stamps = [state.header.stamp.sec * 10**9 + state.header.stamp.nanosec for state in states]
    periods = [after - before for before, after in pairwise(stamps)]
    assert min(periods) > 0
    assert np.median(periods) == pytest.approx(10e6, rel=0.05)  # [ns] of SYNC
    assert time.time_ns() - stamps[-1] < 60 * 10**9  # on the clock of ROS
    arm.inject(FAILING, 'disconnect')
    others = [joint for joint in JOINTS if joint != FAILING]
    arm.client.spin_until(lambda: published(others), 20.0, 'the other joints')
