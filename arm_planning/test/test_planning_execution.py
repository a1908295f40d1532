# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Execution of trajectories, with controllers that misbehave."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
import math
import re
from types import SimpleNamespace
from typing import Any

from action_msgs.msg import GoalStatus
from action_msgs.srv import CancelGoal
from control_msgs.action import FollowJointTrajectory
import pytest
import rclpy
from rclpy.context import Context
from rclpy.node import Node
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from arm_planning import PlanningCode, PlanningError
from arm_planning.ros import execution, parameters
from arm_planning.ros.execution import TrajectoryExecution
from arm_planning.ros.parameters import ExecutionLimits, FOLLOW, KINDS
from node_runner.action_goals import GoalClient

JOINTS = ('left', 'right')


class Controller:
    """An action client of a controller that answers as the test wants."""

    accepted = True

    def __init__(self) -> None:
        self.is_ready, self.cancels, self.forgets = True, 0, False
        self.result: Future[Any] = Future()
        self.goal: Any = None

    def server_is_ready(self) -> bool:
        """Return whether it runs."""
        return self.is_ready

    def send_goal_async(self, goal: Any) -> Future[Any]:
        """Accept it."""
        self.goal, self.result = goal, Future()
        return answered(self)

    def get_result_async(self) -> Future[Any]:
        """Return when it ends."""
        return self.result

    def cancel_goal_async(self) -> Future[Any]:
        """Take a cancel."""
        self.cancels += 1
        code = CancelGoal.Response.ERROR_UNKNOWN_GOAL_ID if self.forgets else 0
        return answered(CancelGoal.Response(return_code=code))

    def end(
        self, status: int = GoalStatus.STATUS_CANCELED, words: str = '', code: int = 0
    ) -> None:
        """Confirm the end."""
        self.answer(status, FollowJointTrajectory.Result(error_string=words, error_code=code))

    def answer(self, status: int, result: Any) -> None:
        """End with a result."""
        self.result.set_result(SimpleNamespace(status=status, result=result))


def answered(value: Any) -> Future[Any]:
    """Return a future that is done."""
    future: Future[Any] = Future()
    future.set_result(value)
    return future


ARM = {'arm': parameters.Controller(JOINTS, FOLLOW, FOLLOW.namespace)}


class Bench:
    """An execution with controllers of two joints, which stand at 0; the node of the execution."""

    def __init__(
        self, monkeypatch: pytest.MonkeyPatch, known: Mapping[str, parameters.Controller] = ARM
    ) -> None:
        self.clients = {each.action(name): Controller() for name, each in known.items()}
        self.controller = next(iter(self.clients.values()))
        self.ends: list[tuple[PlanningCode, str]] = []
        self.place, self.turns = 0.0, dict[str, int]()
        self.watch: Callable[[], None] = lambda: None
        monkeypatch.setattr(execution, 'GoalClient', lambda *parts: self.clients[parts[2]])
        self.is_known = True
        match = SimpleNamespace(advance=lambda: self.is_known)
        monkeypatch.setattr(execution, 'ServerMatch', lambda *_: match)
        node: Any = SimpleNamespace(
            create_timer=lambda _, callback: setattr(self, 'watch', callback),
            create_subscription=lambda *_, **__: None,
            resolve_topic_name=lambda name: f'/{name}',
        )
        self.execution = TrajectoryExecution(
            node, known, self.received, ExecutionLimits(), continuous=['left']
        )

    def received(self, joints: Sequence[str]) -> Mapping[str, float]:
        """Return where joints are."""
        return {name: self.place + self.turns.get(name, 0) * math.tau for name in joints}

    def start(self, trajectory: Any = None) -> execution.Execution:
        """Start a trajectory."""
        return self.execution.start(
            motion() if trajectory is None else trajectory,
            lambda code, reason: self.ends.append((code, reason)),
        )

    def refusal(self, trajectory: Any = None) -> PlanningError:
        """Return why a trajectory is refused."""
        with pytest.raises(PlanningError) as caught:
            self.start(trajectory)
        return caught.value

    def expire(self, running: execution.Execution) -> None:
        """Let the time of an execution be over."""
        running.deadline = 0.0
        self.watch()

    def failure(self) -> str:
        """Return why the only execution has failed; its joints are free."""
        ((code, reason),) = self.ends
        assert code is PlanningCode.CONTROL_FAILED
        self.controller.is_ready = True
        self.start()
        return reason


@pytest.fixture(name='bench')
def make_bench(monkeypatch: pytest.MonkeyPatch) -> Bench:
    """Return a bench."""
    return Bench(monkeypatch)


def motion() -> JointTrajectory:
    """Return a motion of one second."""
    points = [
        JointTrajectoryPoint(positions=[at, at], velocities=[0.0] * 2, accelerations=[0.0] * 2)
        for at in (0.0, 0.5, 1.0)
    ]
    points[1].time_from_start.nanosec, points[2].time_from_start.sec = 500_000_000, 1
    return JointTrajectory(joint_names=list(JOINTS), points=points)


def changed(change: Callable[[Any], None]) -> JointTrajectory:
    """Return the motion with its middle point changed."""
    trajectory = motion()
    change(trajectory.points[1])
    return trajectory


@pytest.mark.parametrize(
    ('trajectory', 'words'),
    [
        (changed(lambda p: p.positions.__setitem__(1, float('nan'))), 'positions is nan.*right'),
        (changed(lambda p: p.velocities.__setitem__(0, float('inf'))), 'velocities is inf.*left'),
        (changed(lambda p: p.accelerations.pop()), 'point 1 has 1 accelerations of 2 joints'),
        (changed(lambda p: p.velocities.pop()), 'point 1 has 1 velocities of 2 joints'),
        (changed(lambda p: p.positions.append(1.0)), 'point 1 has 3 positions of 2 joints'),
        (changed(lambda p: setattr(p.time_from_start, 'sec', 2)), 'point 2 has .* 1 s'),
        (changed(lambda p: setattr(p.time_from_start, 'nanosec', 0)), 'point 1 has .* 0 s'),
        (changed(lambda p: setattr(p.time_from_start, 'sec', -3)), 'point 1 .*not negative'),
        (JointTrajectory(joint_names=['left', 'left'], points=motion().points), 'left is named'),
        (JointTrajectory(joint_names=['left']), 'no points'),
    ],
)
def test_what_no_controller_can_follow_is_refused(
    bench: Bench, trajectory: JointTrajectory, words: str
) -> None:
    """Before any controller gets a part of it."""
    refused = bench.refusal(trajectory)
    assert refused.code is PlanningCode.INVALID_MOTION_PLAN
    assert re.search(words, str(refused))


def test_a_controller_that_does_not_confirm_keeps_its_joints(bench: Bench) -> None:
    """The client is answered; the joints are free when the result arrives."""
    running = bench.start()
    bench.execution.stop(running)
    bench.watch()
    assert not bench.ends
    bench.expire(running)  # STOP_TIMEOUT is over
    assert bench.controller.cancels == 2
    assert 'arm did not confirm' in str(bench.refusal())
    bench.controller.end()
    assert 'arm did not confirm' in bench.failure()


@pytest.mark.parametrize('kind', ['GripperCommand', 'ParallelGripperCommand'])
def test_a_gripper_gets_where_the_trajectory_ends(
    monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    """Beside the arm, which follows the rest; one that stalls has not arrived.

    A part of a sequence was planned from where the fingers would meet; arms must be there.
    """
    hand = parameters.Controller(['right'], KINDS[kind], 'grip')
    arm = parameters.Controller(['left'], FOLLOW, FOLLOW.namespace)
    bench = Bench(monkeypatch, {'arm': arm, 'hand': hand})
    follower, gripper = bench.clients['arm/follow_joint_trajectory'], bench.clients['hand/grip']
    for status, code, words in (
        (GoalStatus.STATUS_SUCCEEDED, PlanningCode.SUCCESS, ''),
        (GoalStatus.STATUS_ABORTED, PlanningCode.CONTROL_FAILED, 'hand: stalled before its goal'),
    ):
        bench.start()
        trajectory, command = follower.goal.trajectory, gripper.goal.command
        assert list(trajectory.joint_names) == ['left']
        assert [list(point.positions) for point in trajectory.points] == [[0.0], [0.5], [1.0]]
        assert command.position in (1.0, array('d', [1.0]))
        follower.end(GoalStatus.STATUS_SUCCEEDED)
        gripper.answer(status, KINDS[kind].action.Result(stalled=bool(words)))
        assert bench.ends.pop() == (code, words)
        bench.turns['right'] = 1  # it holds something
    bench.place = 0.1
    assert "at joint 'left'" in str(bench.refusal())


def test_an_execution_whose_watch_raises_ends_with_a_reason(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its controller is stopped; a defect that is only logged would leave the client waiting."""
    bench.start()
    with monkeypatch.context() as broken:
        broken.setattr(bench.controller, 'server_is_ready', lambda: 1 // 0)
        broken.setattr(bench.execution, '_is_found', lambda _: True)
        bench.watch()
    assert bench.controller.cancels == 1
    bench.controller.end()
    assert 'ZeroDivisionError' in bench.failure()


@pytest.mark.parametrize('fate', ['forgets', 'is_ready'])
def test_a_controller_that_was_restarted_frees_its_joints(bench: Bench, fate: str) -> None:
    """It knows nothing of the goal any more, or is gone."""
    running = bench.start()
    bench.execution.stop(running)
    setattr(bench.controller, fate, fate == 'forgets')
    bench.expire(running)
    bench.failure()


@pytest.mark.parametrize('kind', [FOLLOW, KINDS['ParallelGripperCommand']])
def test_a_controller_that_is_gone_while_it_moves_ends_the_motion(
    monkeypatch: pytest.MonkeyPatch, kind: Any
) -> None:
    """Also a gripper, whose time is not watched."""
    bench = Bench(monkeypatch, {'arm': parameters.Controller(JOINTS, kind, 'goals')})
    running = bench.start()
    bench.watch()
    bench.controller.is_ready = False
    bench.watch()
    bench.expire(running)  # STOP_TIMEOUT is over
    assert 'its action is gone' in bench.failure()


def test_a_start_is_reported_with_the_way_to_its_first_point(bench: Bench) -> None:
    """What is refused is not reported."""
    begun: list[Any] = []
    bench.execution.on_start = lambda: begun.append(bench.execution.running[-1].way)
    trajectory = motion()
    del trajectory.points[0]
    trajectory.points[0].positions = [0.005, 0.0]
    bench.start(trajectory)
    (way,) = begun
    assert [list(point.positions) for point in way.points] == [[0, 0], [0.005, 0], [1, 1]]
    bench.refusal()
    assert len(begun) == 1


@pytest.mark.parametrize('change', ['', 'the scene has changed: a and b would touch'])
def test_why_a_controller_gave_up_is_found_out_first(bench: Bench, change: str) -> None:
    """It looks at the scene too, and may be quicker: that is another code than a defect."""
    asked: list[execution.Execution] = []
    bench.execution.on_failure = asked.append
    running = bench.start()
    bench.controller.end(GoalStatus.STATUS_ABORTED, 'left is in fault')
    assert (asked, bench.ends) == ([running], [])
    bench.execution.explain(running, change)
    ((code, reason),) = bench.ends
    assert code is (execution.INVALIDATED if change else PlanningCode.CONTROL_FAILED)
    assert change in reason
    assert 'arm: left is in fault' in reason  # a drive may fail in front of an object, too
    # neither a cancel nor the joints wait for it
    canceled = bench.start()
    bench.controller.end(GoalStatus.STATUS_ABORTED)
    bench.execution.stop(canceled, reason='canceled')
    bench.execution.explain(canceled, 'the scene has changed')
    assert bench.ends[1:] == [(PlanningCode.PREEMPTED, 'canceled')]
    bench.ends.clear()
    running = bench.start()
    bench.controller.end(GoalStatus.STATUS_ABORTED)
    bench.expire(running)
    assert 'did not confirm' not in bench.failure()


@pytest.mark.parametrize(
    ('status', 'words', 'code', 'reason'),
    [
        (GoalStatus.STATUS_ABORTED, 'left is in fault', -1, 'arm: left is in fault'),
        (GoalStatus.STATUS_ABORTED, '', -4, 'arm: PATH_TOLERANCE_VIOLATED'),
        (GoalStatus.STATUS_ABORTED, '', -99, 'arm: error code -99'),
        (GoalStatus.STATUS_ABORTED, '', 0, 'arm: did not reach the end, and gave no reason'),
        (GoalStatus.STATUS_CANCELED, '', 0, 'arm: canceled by another client'),
    ],
)
def test_a_controller_that_says_little_is_put_into_words(
    bench: Bench, status: int, words: str, code: int, reason: str
) -> None:
    """Some give a code alone, or neither code nor words."""
    bench.start()
    bench.controller.end(status, words, code)
    assert bench.ends == [(PlanningCode.CONTROL_FAILED, reason)]


@pytest.mark.parametrize(
    ('status', 'outcome'),
    [
        (GoalStatus.STATUS_SUCCEEDED, PlanningCode.SUCCESS),
        (GoalStatus.STATUS_CANCELED, execution.INVALIDATED),
    ],
)
def test_a_scene_that_changes_at_the_end_is_too_late(
    bench: Bench, status: int, outcome: PlanningCode
) -> None:
    """What counts is whether the arm has arrived."""
    bench.execution.on_failure = lambda _: pytest.fail('it was stopped')
    bench.execution.stop(bench.start(), execution.INVALIDATED, 'the scene has changed')
    bench.controller.end(status)
    assert [code for code, _ in bench.ends] == [outcome]


def test_a_controller_that_is_not_found_yet_is_waited_for(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nor one that does not know its client, which could not cancel; its time counts from then.

    One that does not come is named, and gets nothing when it comes later.
    """
    bench.controller.is_ready, bench.is_known = False, False
    running = bench.start()
    first = running.begin
    bench.watch()
    bench.controller.is_ready = True
    bench.watch()
    assert (bench.controller.goal, bench.ends) == (None, [])
    bench.is_known = True
    bench.watch()
    assert bench.controller.goal is not None
    assert running.begin > first
    bench.controller.end(GoalStatus.STATUS_SUCCEEDED)
    assert bench.ends.pop() == (PlanningCode.SUCCESS, '')
    monkeypatch.setattr(execution, 'FINDING_TIMEOUT', 0.0)
    bench.controller.is_ready, bench.controller.goal = False, None
    bench.start()
    bench.watch()
    reason = 'no action /arm/follow_joint_trajectory; start the controller arm'
    assert bench.ends == [(PlanningCode.CONTROL_FAILED, reason)]
    bench.controller.is_ready = True
    bench.watch()
    assert bench.controller.goal is None


@pytest.mark.parametrize('code', [PlanningCode.PREEMPTED, execution.INVALIDATED])
def test_what_waits_for_its_controller_can_be_stopped(bench: Bench, code: PlanningCode) -> None:
    """It ends at once and is no success, as nothing has moved; its joints are free."""
    bench.controller.is_ready = False
    bench.execution.stop(bench.start(), code, 'a box is in the way')
    assert bench.ends == [(code, 'a box is in the way')]
    bench.controller.is_ready = True
    bench.watch()
    assert bench.controller.goal is None
    bench.start()
    assert bench.controller.goal is not None


def test_a_robot_that_moved_while_its_controller_was_waited_for_is_not_moved(bench: Bench) -> None:
    """The trajectory does not begin where it is any more."""
    bench.controller.is_ready = False
    bench.start()
    bench.place, bench.controller.is_ready = 0.2, True
    bench.watch()
    assert bench.controller.goal is None
    bench.place = 0.0
    words = 'it is at 0.2000, the trajectory begins at 0.0000; plan anew'
    assert words in bench.failure()


def test_whole_turns_of_a_continuous_joint_do_not_count(bench: Bench) -> None:
    """The way to a first point that comes later is that within the turn, too."""
    later = motion()
    for number, point in enumerate(later.points, 1):
        point.time_from_start.sec = number
    bench.turns = {'right': -2}
    assert 'plan anew' in str(bench.refusal(later))
    bench.turns = {'left': -2}
    way = bench.start(later).way
    assert way is not None
    assert list(way.points[0].positions) == pytest.approx([0.0, 0.0])


def test_an_acceptance_that_comes_twice_counts_once() -> None:
    """Both wait for a client that a busy computer held up; rclpy raises for the second."""
    context = Context()
    rclpy.init(context=context)
    node: Any = Node('client', context=context)
    make: Any = GoalClient
    client = make(node, FollowJointTrajectory, 'arm/follow_joint_trajectory')
    goal_id = FollowJointTrajectory.Impl.SendGoalService.Request().goal_id
    client._goal_sequence_number_to_goal_id[7] = goal_id
    pending: Future[Any] = Future()
    client._pending_goal_requests[7] = pending
    response = FollowJointTrajectory.Impl.SendGoalService.Response(accepted=True)
    for _ in range(2):
        with pytest.raises(StopIteration):
            client.execute({'goal': (7, response)}).send(None)
    assert pending.result().accepted
    client.destroy()
    node.destroy_node()
    context.shutdown()
