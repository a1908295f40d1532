# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The motion actions over DDS, with plans and executions that the test makes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
import threading
import time
from types import SimpleNamespace
from typing import Any

from action_msgs.msg import GoalStatus
from isolation import Isolation
from moveit_msgs.action import ExecuteTrajectory, MoveGroup, MoveGroupSequence
from moveit_msgs.msg import RobotState, RobotTrajectory
import pytest
from ros_client import RosClient
from sensor_msgs.msg import JointState

from arm_planning import PlanningCode, PlanningError
from arm_planning.ros import actions
from arm_planning.ros.background import Background
from arm_planning.ros.execution import Done, INVALIDATED
from arm_planning.ros.planning import PlannedMotion
from node_runner import action_goals

TIMEOUT = 20.0  # [s]

Action = tuple[Any, str]  # type and name
MOTION: Action = (MoveGroup, 'move_action')
SEQUENCE: Action = (MoveGroupSequence, 'sequence_move_group')
TRAJECTORY: Action = (ExecuteTrajectory, 'execute_trajectory')


def code_of(result: Any) -> Any:
    """Return the code of a result of any action."""
    return getattr(result, 'response', result).error_code


class Bench:
    """Both actions and their clients in one node."""

    def __init__(self, client: RosClient) -> None:
        self.client = client
        self.plans = 0
        self.warnings: list[str] = []
        self.requests: list[Any] = []
        self.stops = True
        self.stale = self.moving = 0
        self.refusal: Exception | None = None
        self.executions: list[Done] = []
        self.may_plan = threading.Event()
        self.may_plan.set()
        self.background = Background(client.node, 'planning')
        planning: Any = SimpleNamespace(
            prepare=partial(self._prepare, 1),
            prepare_sequence=partial(self._prepare, 2),
            display=lambda _: None,
            is_moving=self._is_moving,
        )
        execution: Any = SimpleNamespace(start=self._start, stop=self._stop, stops=0)
        self.execution = execution
        self.actions = [
            actions.ExecuteAction(client.node, execution),
            *(
                actions.MotionAction(client.node, kind, planning, self.background, execution)
                for kind in (
                    actions.single_motion(planning, self.warnings.append),
                    actions.sequence(planning),
                )
            ),
        ]

    def _is_moving(self, _group: str) -> bool:
        self.moving -= 1
        return self.moving >= 0

    def _prepare(self, count: int, request: Any, *_: Any) -> Callable[[], PlannedMotion]:
        if self.stale:
            self.stale -= 1
            raise PlanningError(PlanningCode.ROBOT_STATE_STALE, 'nobody knows where it is')
        if self.refusal is not None:
            raise self.refusal
        self.plans += 1
        self.requests.append(request)

        def plan() -> PlannedMotion:
            assert self.may_plan.wait(TIMEOUT)
            return PlannedMotion(RobotState(), [RobotTrajectory()] * count, 0.0)

        return plan

    def _start(self, _trajectory: Any, done: Done, *_: Any) -> Any:
        self.executions.append(done)
        return SimpleNamespace(done=done, is_sent=True)

    def _stop(self, execution: Any, *, reason: str) -> None:
        if self.stops:
            execution.done(PlanningCode.PREEMPTED, reason)

    def move(self, *, delay: float) -> Any:
        """Send a goal that is planned anew after a delay in [s]; return its handle."""
        goal = MoveGroup.Goal()
        goal.planning_options.replan = True
        goal.planning_options.replan_delay = delay
        return self.begin(MoveGroup, 'move_action', goal)

    def begin(self, kind: Any, name: str, goal: Any) -> Any:
        """Send a goal; return its handle when its execution has begun."""
        handle = self.send(kind, name, goal)
        self.wait_for_execution(1)
        return handle

    def send(self, kind: Any, name: str, goal: Any) -> Any:
        """Send a goal; return its handle."""
        caller = self.client.action(kind, name)
        assert caller.wait_for_server(TIMEOUT)  # type: ignore[no-untyped-call]
        sent = caller.send_goal_async(goal)  # type: ignore[no-untyped-call]
        self.client.spin_until(sent.done, TIMEOUT, 'acceptance')
        return sent.result()

    def cancel(self, handle: Any) -> None:
        """Cancel a goal."""
        answer = handle.cancel_goal_async()
        self.client.spin_until(answer.done, TIMEOUT, 'answer to the cancel')

    def wait_for_execution(self, number: int) -> None:
        """Wait until a plan is executed."""
        self.client.spin_until(
            lambda: len(self.executions) >= number, TIMEOUT, f'execution {number}'
        )

    def result(self, handle: Any) -> tuple[int, Any]:
        """Return status and result of a goal."""
        result = handle.get_result_async()
        self.client.spin_until(result.done, TIMEOUT, 'result')
        return result.result().status, result.result().result


@pytest.fixture(name='bench')
def make_bench(isolation: Isolation) -> Iterator[Bench]:
    """Give a bench."""
    with RosClient(isolation.domain_id) as client:
        bench = Bench(client)
        yield bench
        bench.may_plan.set()
        bench.background.close()


@pytest.mark.parametrize('delay', [0.0, 0.02])
@pytest.mark.parametrize('busy', [False, True])
def test_a_motion_that_is_not_clear_any_more_is_planned_anew_once(
    bench: Bench, delay: float, *, busy: bool
) -> None:
    """Not with each expiry of the timer, of which a busy executor finds many."""
    handle = bench.move(delay=delay)
    if busy:  # longer than its period: it is due again and again, as the delay is
        bench.client.node.create_timer(0.005, partial(time.sleep, 0.01))
    for number in range(1, actions.REPLAN_ATTEMPTS):
        bench.executions[-1](INVALIDATED, 'the scene has changed')
        bench.wait_for_execution(number + 1)
        bench.client.spin_for(0.1)  # five delays
        assert bench.plans == number + 1
    bench.executions[-1](PlanningCode.SUCCESS, '')
    status, result = bench.result(handle)
    assert (status, result.error_code.val) == (GoalStatus.STATUS_SUCCEEDED, 1)


def test_a_refusal_of_the_second_plan_says_why_the_first_has_ended(bench: Bench) -> None:
    """The client sees an arm that stands on its way."""
    handle = bench.move(delay=0.0)
    bench.refusal = PlanningError(PlanningCode.GOAL_IN_COLLISION, 'the goal is covered')
    bench.executions[-1](INVALIDATED, 'a box has come')
    code = code_of(bench.result(handle)[1])
    words = 'the goal is covered; the arm was stopped on its way: a box has come'
    assert (code.val, code.message) == (PlanningCode.GOAL_IN_COLLISION, words)


@pytest.mark.parametrize('action', [MOTION, SEQUENCE], ids=['motion', 'sequence'])
def test_whatever_a_goal_raises_ends_that_goal_only(bench: Bench, action: Action) -> None:
    """With the place of the defect; an executor would end the program."""
    bench.refusal = ZeroDivisionError('no such luck')
    status, result = bench.result(bench.send(*action, action[0].Goal()))
    code = code_of(result)
    assert (status, code.val) == (GoalStatus.STATUS_ABORTED, PlanningCode.CRASH)
    assert 'ZeroDivisionError: no such luck (a defect in _prepare' in code.message


def test_a_sequence_is_followed_part_by_part(bench: Bench) -> None:
    """The next one begins with the end of the one before; it is not planned anew from there."""
    goal = MoveGroupSequence.Goal()
    handle = bench.begin(*SEQUENCE, goal)
    for part in (1, 2):
        bench.wait_for_execution(part)
        assert len(bench.executions) == part
        bench.executions[-1](PlanningCode.SUCCESS, '')
    status, result = bench.result(handle)
    assert (status, code_of(result).val) == (GoalStatus.STATUS_SUCCEEDED, 1)
    assert len(result.response.planned_trajectories) == 2
    goal.planning_options.replan = True
    status, result = bench.result(bench.send(*SEQUENCE, goal))
    assert status == GoalStatus.STATUS_ABORTED
    assert 'replan' in code_of(result).message
    assert bench.plans == 1


@pytest.mark.parametrize('stops', [True, False], ids=['stopped', 'arrived'])
def test_no_part_begins_after_a_cancel(bench: Bench, stops: bool) -> None:
    """Not even where the part before had arrived just then."""
    bench.stops = stops
    handle = bench.begin(*SEQUENCE, MoveGroupSequence.Goal())
    bench.cancel(handle)
    if not stops:
        bench.executions[0](PlanningCode.SUCCESS, '')
    status, result = bench.result(handle)
    found = status, code_of(result).val
    assert found == (GoalStatus.STATUS_CANCELED, PlanningCode.PREEMPTED)
    assert len(bench.executions) == 1


@pytest.mark.parametrize(
    ('action', 'planned'),
    [(MOTION, False), (SEQUENCE, False), (TRAJECTORY, False), (MOTION, True), (SEQUENCE, True)],
)
def test_a_stop_while_a_goal_is_accepted_or_planned_counts(
    bench: Bench, action: Action, planned: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its motion would begin after the stop; the next goal moves the arm again."""
    answer = action_goals._Server._answer_goal

    async def stop_before(server: Any, request: Any) -> None:
        bench.execution.stops += 1
        await answer(server, request)

    with monkeypatch.context() as delayed:
        if planned:
            bench.may_plan.clear()
        else:  # the acceptance is delayed for the client
            delayed.setattr(action_goals._Server, '_answer_goal', stop_before)
        handle = bench.send(*action, action[0].Goal())
    if planned:
        bench.client.spin_until(lambda: bench.plans == 1, TIMEOUT, 'the plan')
        bench.execution.stops += 1
        bench.may_plan.set()
    status, result = bench.result(handle)
    code = code_of(result)
    assert (status, code.val) == (GoalStatus.STATUS_ABORTED, PlanningCode.PREEMPTED)
    assert code.message == 'everything was stopped meanwhile'
    assert not bench.executions
    bench.begin(*action, action[0].Goal())


@pytest.mark.parametrize('plan_only', [False, True])
def test_a_motion_is_executed_from_where_the_robot_is(bench: Bench, *, plan_only: bool) -> None:
    """MoveIt ignores another start state, too, with a warning; a plan may begin anywhere."""
    goal = MoveGroup.Goal()
    goal.request.start_state.joint_state = JointState(name=['a'], position=[1.0])
    goal.planning_options.plan_only = plan_only
    bench.moving = 2
    bench.send(*MOTION, goal)
    bench.client.spin_until(lambda: bool(bench.requests), TIMEOUT, 'the plan')
    start = bench.requests[0].start_state
    assert list(start.joint_state.name) == ['a'] * plan_only
    assert start.is_diff != plan_only
    assert len(bench.warnings) == (not plan_only)
    assert (bench.moving == 2) == plan_only, 'what only plans does not wait for rest'


@pytest.mark.parametrize('fate', ['they come', 'none comes', 'canceled'])
def test_a_goal_waits_for_joint_states(bench: Bench, fate: str) -> None:
    """A client that comes with the robot is not refused; after a second it is, with the reason."""
    bench.stale = 3 if fate == 'they come' else 1000
    handle = bench.send(*MOTION, MoveGroup.Goal())
    if fate == 'they come':
        bench.wait_for_execution(1)
        bench.executions[0](PlanningCode.SUCCESS, '')
    elif fate == 'canceled':
        bench.cancel(handle)
    status, result = bench.result(handle)
    assert bench.plans == (fate == 'they come')
    if fate == 'they come':
        assert (status, bench.stale) == (GoalStatus.STATUS_SUCCEEDED, 0)
    elif fate == 'canceled':
        assert status == GoalStatus.STATUS_CANCELED
        assert result.error_code.val == PlanningCode.PREEMPTED
    else:
        assert status == GoalStatus.STATUS_ABORTED
        assert result.error_code.val == PlanningCode.ROBOT_STATE_STALE
        assert result.error_code.message == 'nobody knows where it is'
        assert 980 < bench.stale < 1000


def test_a_goal_waits_until_the_arm_has_come_to_rest(bench: Bench) -> None:
    """After a jog; of one that goes on moving the execution is refused as ever."""
    for moving in (3, 1000):
        bench.moving = moving
        handle = bench.send(MoveGroup, 'move_action', MoveGroup.Goal())
        bench.client.spin_until(lambda: bool(bench.executions), TIMEOUT, 'execution')
        assert bench.moving in {-1, 1000 - 10}
        bench.executions.pop()(PlanningCode.SUCCESS, '')
        assert bench.result(handle)[0] == GoalStatus.STATUS_SUCCEEDED
