# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The ROS client of the demos: services of drives, goals of actions, and /diagnostics."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.action.client import ActionClient

from process_supervisor import CallError
from process_supervisor.graph_client import GraphClient

from ..service_client import ServiceClient
from .figures import Figures

ANSWER_TIMEOUT = 30.0
"""Longest time for an answer in [s]."""


class ArmClient(ServiceClient):
    """A node of its own; use it in one thread.

    Attributes:
        figures: The latest of /diagnostics.
    """

    def __init__(self, given_up: Callable[[], bool], namespace: str = '') -> None:
        """Join the ROS graph.

        Args:
            given_up: True when nothing shall be waited for any more.
            namespace: That of the arm.
        """
        super().__init__('demo', given_up, namespace)
        self.figures = Figures()
        self.node.create_subscription(DiagnosticArray, 'diagnostics', self._take, 50)

    def _take(self, message: DiagnosticArray) -> None:
        self.figures = self.figures.updated(message.status)


class ActionRun:
    """A goal on its way.

    Attributes:
        feedback: What the server has sent so far.
    """

    def __init__(
        self,
        client: GraphClient,
        action: ActionClient,
        goal: Any,  # noqa: ANN401  # goals have no type
        name: str,
    ) -> None:
        """Send it, and wait until it is accepted.

        Args:
            client: Who sends it.
            action: The action.
            goal: The goal.
            name: Name of the action.

        Raises:
            CallError: It was not accepted, or nobody answers.
            GivenUpError: It is no longer wanted.
        """
        self.feedback: list[Any] = []
        self._client, self._name = client, name
        client.wait_until(action.server_is_ready, ANSWER_TIMEOUT, name)
        client.wait_until_known([f'{name}/_action/send_goal'], ANSWER_TIMEOUT)
        sent = action.send_goal_async(goal, lambda each: self.feedback.append(each.feedback))
        client.wait_until(sent.done, ANSWER_TIMEOUT, f'the answer of {name}')
        if not sent.result().accepted:
            raise CallError(f'{name}: the goal was not accepted')
        self._handle = sent.result()
        self._result = self._handle.get_result_async()

    @property
    def done(self) -> bool:
        """Whether it has ended."""
        return bool(self._result.done())

    @property
    def status(self) -> int:
        """The action_msgs/GoalStatus it ended with, once it is done."""
        return int(self._result.result().status)

    @property
    def result(self) -> Any:  # noqa: ANN401
        """Its result, once it is done."""
        return self._result.result().result

    def cancel(self) -> None:
        """Ask for its end.

        Raises:
            CallError: Nobody answers.
            GivenUpError: It is no longer wanted.
        """
        answer = self._handle.cancel_goal_async()
        self._client.wait_until(answer.done, ANSWER_TIMEOUT, f'the cancel of {self._name}')
