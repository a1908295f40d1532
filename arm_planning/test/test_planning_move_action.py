# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The action move_action over DDS, with plans and executions that the test makes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

from action_msgs.msg import GoalStatus
from isolation import Isolation
from moveit_msgs.action import MoveGroup
from moveit_msgs.msg import RobotState, RobotTrajectory
import pytest
from ros_client import RosClient

from arm_planning import PlanningCode
from arm_planning.ros.background import Background
from arm_planning.ros.execution import Done, INVALIDATED
from arm_planning.ros.move_action import MoveAction
from arm_planning.ros.planning import PlannedMotion

TIMEOUT = 20.0  # [s]


class Bench:
    """A move_action and its client in one node."""

    def __init__(self, client: RosClient) -> None:
        """Offer it."""
        self.client = client
        self.plans = 0
        self.executions: list[Done] = []
        self.background = Background(client.node, 'planning')
        planning = SimpleNamespace(prepare=self._prepare, display=lambda _: None)
        execution = SimpleNamespace(start=self._start, stop=self._stop)
        self.action = MoveAction(
            client.node,
            planning,  # type: ignore[arg-type]
            self.background,
            execution,  # type: ignore[arg-type]
        )

    def _prepare(self, _request: Any, _diff: Any) -> Callable[[], PlannedMotion]:
        self.plans += 1
        return lambda: PlannedMotion(RobotState(), RobotTrajectory(), 0.0)

    def _start(self, _trajectory: Any, done: Done) -> Done:
        self.executions.append(done)
        return done

    def _stop(self, done: Done, *, reason: str) -> None:
        done(PlanningCode.PREEMPTED, reason)

    def move(self, *, delay: float) -> Any:
        """Send a goal that is planned anew after a delay in [s]; return its handle."""
        goal = MoveGroup.Goal()
        goal.planning_options.replan = True
        goal.planning_options.replan_delay = delay
        caller = self.client.action(MoveGroup, 'move_action')
        assert caller.wait_for_server(TIMEOUT)  # type: ignore[no-untyped-call]
        sent = caller.send_goal_async(goal)  # type: ignore[no-untyped-call]
        self.client.spin_until(sent.done, TIMEOUT, 'acceptance')
        self.wait_for_execution(1)
        return sent.result()

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
        bench.background.close()


def test_a_motion_that_is_not_clear_any_more_is_planned_anew_once(bench: Bench) -> None:
    """Not again and again with each period of the delay."""
    handle = bench.move(delay=0.02)
    bench.executions[0](INVALIDATED, 'the scene has changed')
    bench.wait_for_execution(2)
    bench.client.spin_for(0.2)  # ten delays
    assert bench.plans == 2
    bench.executions[1](PlanningCode.SUCCESS, '')
    status, result = bench.result(handle)
    assert (status, result.error_code.val) == (GoalStatus.STATUS_SUCCEEDED, 1)
