# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Homing, halting, streaming, moves, units and STOP of drives, over DDS and a real bus."""

from __future__ import annotations

from pathlib import Path
from typing import Any, TYPE_CHECKING

from action_msgs.msg import GoalStatus
from canopen_interfaces.srv import COTargetDouble
import pytest
from rclpy.action.client import ActionClient
from sensor_msgs.msg import JointState
from simulated_arm import panda_bus, SimulatedArm
from std_msgs.msg import Float64, String

from arm_msgs.action import Home
from arm_msgs.srv import InjectFault, Move, ReadUnits, WriteObject

if TYPE_CHECKING:
    from isolation import Isolation

pytestmark = pytest.mark.scenario
JOINT = '/panda_joint4'


class Goal:
    """One goal of the homing action."""

    def __init__(self, arm: SimulatedArm, method: int) -> None:
        """Send it, and wait until it is accepted."""
        self.phases: list[str] = []
        self._arm = arm
        client = ActionClient(arm.client.node, Home, f'{JOINT}/home')
        assert client.wait_for_server(10.0)
        sent = client.send_goal_async(Home.Goal(method=method), self._note)
        arm.client.spin_until(sent.done, 10.0, 'acceptance')
        self.handle: Any = sent.result()
        assert self.handle.accepted
        self._result = self.handle.get_result_async()

    def _note(self, message: Any) -> None:
        self.phases.append(message.feedback.phase)

    def result(self) -> Any:
        """Wait for its end."""
        self._arm.client.spin_until(self._result.done, 20.0, 'the result')
        return self._result.result()


def positions(arm: SimulatedArm) -> list[float]:
    """Listen to the positions of the joint."""
    messages: list[float] = []

    def note(message: Any) -> None:
        messages.append(message.position[0])

    arm.client.node.create_subscription(JointState, f'{JOINT}/joint_states', note, 10)
    return messages


def test_homing_as_an_action_and_as_a_service(isolation: Isolation) -> None:
    """Feedback has the phase, cancelling stops it, a method that fails says why."""
    with SimulatedArm(isolation) as arm:
        goal = Goal(arm, 35)
        done = goal.result()
        assert done.status == GoalStatus.STATUS_SUCCEEDED
        assert done.result.success
        assert 'homed by method 35' in done.result.message
        assert done.result.position == pytest.approx(0.0, abs=1e-3)

        crawl = WriteObject.Request(object='0x6099:01', value='5')  # [inc/s]
        assert arm.client.call(WriteObject, f'{JOINT}/write_object', crawl).success
        slow = Goal(arm, 17)  # to a limit switch that is far away
        arm.client.spin_until(lambda: 'homing' in slow.phases, 10.0, 'feedback')
        assert not arm.client.trigger(f'{JOINT}/home').success  # busy
        cancelled = slow.handle.cancel_goal_async()
        arm.client.spin_until(cancelled.done, 10.0, 'the cancellation')
        ended = slow.result()
        assert ended.status == GoalStatus.STATUS_CANCELED
        assert 'homing was cancelled' in ended.result.message

        wrong = Goal(arm, 36).result()
        assert wrong.status == GoalStatus.STATUS_ABORTED
        assert 'method 36' in wrong.result.message
        assert arm.client.trigger(f'{JOINT}/enable').success


def test_many_homings_at_a_time_harm_nobody(isolation: Isolation) -> None:
    """Goals that are refused because another one runs end at once, and the master goes on."""
    with SimulatedArm(isolation) as arm:
        client = ActionClient(arm.client.node, Home, f'{JOINT}/home')
        assert client.wait_for_server(10.0)
        for _ in range(5):
            sent = [client.send_goal_async(Home.Goal(method=35)) for _ in range(6)]
            arm.client.spin_until(lambda: all(goal.done() for goal in sent), 10.0, 'acceptance')  # noqa: B023
            ends = [goal.result().get_result_async() for goal in sent]
            arm.client.spin_until(lambda: all(end.done() for end in ends), 20.0, 'the results')  # noqa: B023
            reached = [end.result().result.success for end in ends]
            assert reached.count(True) == 1, [end.result().result.message for end in ends]
        assert arm.client.trigger(f'{JOINT}/enable').success


def reads_units(arm: SimulatedArm) -> None:
    """Read how the joint counts, and where that is written: the very file of the master."""
    bus, stat = panda_bus(), panda_bus().stat()
    answer = arm.client.call(ReadUnits, f'{JOINT}/read_units', ReadUnits.Request())
    assert answer.success, answer.message
    scale = answer.scale_pos_to_dev
    assert scale > 0.0
    assert answer.scale_pos_from_dev == pytest.approx(1.0 / scale)
    assert answer.scale_vel_from_dev == pytest.approx(1.0 / answer.scale_vel_to_dev)
    assert (answer.device, answer.channel) == (JOINT[1:], -1)
    assert Path(answer.bus_config) == bus
    assert (answer.bus_config_inode, answer.bus_config_changed) == (stat.st_ino, stat.st_mtime_ns)


def stops_all(arm: SimulatedArm) -> None:
    """STOP: what moves stands, also for move_group; without success where that is not known."""
    events = arm.client.listen(String, '/trajectory_execution_event')
    target = COTargetDouble.Request(target=3.0)
    assert arm.client.call(COTargetDouble, f'{JOINT}/target', target).success
    answer = arm.client.trigger('/stop')
    assert answer.success, answer.message
    others = ', '.join(name for name in arm.joints if name != JOINT[1:])
    assert answer.message in {
        f'{what}: {JOINT[1:]}. not enabled: {others}' for what in ('stopped', 'stand')
    }
    arm.client.spin_until(lambda: [each.data for each in events] == ['stop'], 10.0, 'the event')
    lost = InjectFault.Request(fault='power_off')
    assert arm.client.call(InjectFault, '/fake_slaves/panda_joint5/fault', lost).success
    arm.master.wait_for('panda_joint5: heartbeat lost')
    answer = arm.client.trigger('/stop')
    assert not answer.success
    assert answer.message.startswith(
        'NOT known to stand: panda_joint5 is not seen to come to rest'
    )
    assert f'stand: {JOINT[1:]}. not enabled: ' in answer.message


def test_halt_quick_stop_moves_and_streams(isolation: Isolation) -> None:
    """Halt keeps the drive enabled, quick stop does not; moves add up; streams end in a stop."""
    with SimulatedArm(isolation) as arm:
        reads_units(arm)
        for service in ('init', 'position_mode'):
            assert arm.client.trigger(f'{JOINT}/{service}').success
        request = COTargetDouble.Request(target=3.0)
        assert arm.client.call(COTargetDouble, f'{JOINT}/target', request).success
        halted = arm.client.trigger(f'{JOINT}/halt')
        assert halted.success, halted.message
        assert 'Operation enabled' in halted.message

        received = positions(arm)
        arm.client.spin_until(lambda: len(received) > 5, 10.0, 'joint states')
        relative = Move.Request(target=0.1, relative=True)
        assert not arm.client.call(Move, '/panda_joint5/move', relative).success
        back = arm.client.call(Move, f'{JOINT}/move', Move.Request(target=0.0))
        assert back.success, back.message
        for _ in range(2):
            step = Move.Request(target=0.1, relative=True, queue=True)
            assert arm.client.call(Move, f'{JOINT}/move', step).success
        arm.client.spin_until(lambda: abs(received[-1] - 0.2) < 2e-3, 20.0, 'position 0.2')

        assert arm.client.trigger(f'{JOINT}/cyclic_position_mode').success
        stream = arm.client.node.create_publisher(Float64, f'{JOINT}/target', 10)
        arm.client.spin_until(
            lambda: stream.get_subscription_count() > 0, 10.0, 'the subscription'
        )

        def send() -> bool:
            stream.publish(Float64(data=0.0))
            return abs(received[-1]) < 2e-3

        arm.client.spin_until(send, 20.0, 'position 0.0')
        arm.master.wait_for('the stream of targets has paused')
        stops_all(arm)
        stopped = arm.client.trigger(f'{JOINT}/quick_stop')
        assert stopped.success, stopped.message
        stream.publish(Float64(data=0.5))
        arm.master.wait_for('~/target: panda_joint4 takes no stream of targets')
        assert 'Switch on disabled' in arm.client.trigger(f'{JOINT}/shutdown').message
