# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from typing import Any

from action_msgs.msg import GoalStatus
from isolation import Isolation
import pytest
from rclpy.action.server import CancelResponse
from ros_client import RosClient
from tf2_msgs.action import LookupTransform

from node_runner import action_goals

TIMEOUT = 20.0  # [s]


@pytest.mark.slow
def test_a_goal_goes_on_after_its_callback_and_is_forgotten_after_its_end(
    isolation: Isolation, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Rclpy would keep each for 15 minutes: a busy server grew by 5 MB an hour."""
    monkeypatch.setattr(action_goals, 'RESULT_TIMEOUT', 1.0)
    begun: list[Any] = []

    def conclude(goal: Any) -> LookupTransform.Result:
        goal.succeed()
        return LookupTransform.Result()

    with RosClient(isolation.domain_id) as client:
        server = action_goals.serve_goals(
            client.node,
            LookupTransform,
            'look_up',
            start=begun.append,
            conclude=conclude,
            cancel=lambda _: CancelResponse.REJECT,
        )
        caller = client.action(LookupTransform, 'look_up')
        assert caller.wait_for_server(TIMEOUT)  # type: ignore[no-untyped-call]

        def result_of(goal: Any) -> Any:
            result = goal.get_result_async()
            client.spin_until(result.done, TIMEOUT, 'a result')
            return result.result()

        sent = caller.send_goal_async(LookupTransform.Goal())  # type: ignore[no-untyped-call]
        client.spin_until(sent.done, TIMEOUT, 'acceptance')
        goal = sent.result()
        client.spin_until(lambda: bool(begun), TIMEOUT, 'the start')
        assert begun[0].status == GoalStatus.STATUS_EXECUTING
        server.notify_execute(begun[0], None)  # type: ignore[no-untyped-call]
        assert result_of(goal).status == GoalStatus.STATUS_SUCCEEDED
        client.spin_until(
            lambda: result_of(goal).status == GoalStatus.STATUS_UNKNOWN, TIMEOUT, 'its end'
        )
        server.destroy()  # type: ignore[no-untyped-call]
