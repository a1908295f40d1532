# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Action goals that a control loop carries out, so that no callback waits for their end."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Generic, TypeVar

from rclpy.action.server import ActionServer, CancelResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.task import Future

RESULT_TIMEOUT = 10.0
"""Time in [s] that an ended goal is kept for late requests, as by rcl; rclpy keeps it for 900."""

ANSWER_DELAY = 0.02
"""Least time in [s] from a request to its answer.

Clients of rclpy 7.1 note a request after it was sent, and drop an answer that another thread gets
before: 1 of 40 motions of pymoveit2 waited for ever. Python switches threads every 5 ms, and with
several of them, or on a busy computer, it takes some switches. Cancel requests are not delayed,
because the motion would go on meanwhile.
"""


class _Server(ActionServer):
    """Does not answer at once, see ``ANSWER_DELAY``."""

    async def _execute_goal_request(self, request: Any) -> None:  # noqa: ANN401  # rclpy has no types
        await self._delayed()
        await super()._execute_goal_request(request)

    async def _execute_get_result_request(self, request: Any) -> None:  # noqa: ANN401
        await self._delayed()
        await super()._execute_get_result_request(request)

    async def _delayed(self) -> None:
        elapsed = Future()
        steady = Clock(clock_type=ClockType.STEADY_TIME)  # simulated time may stand still
        timer = self._node.create_timer(
            ANSWER_DELAY,
            lambda: elapsed.set_result(None),
            callback_group=self.callback_group,
            clock=steady,
        )
        await elapsed
        self._node.destroy_timer(timer)


class Ending(Enum):
    """Status with which a goal ends."""

    SUCCEEDED = 'succeeded'
    CANCELED = 'canceled'  # aborted, unless a client has asked for it
    ABORTED = 'aborted'


@dataclass(slots=True, eq=False)
class ServedGoal:
    """A goal from its acceptance to its result; servers derive from it what they remember."""

    handle: Any  # rclpy's ``ServerGoalHandle``
    has_ended: bool = field(default=False, init=False)  # whether its result is on the way

    @property
    def request(self) -> Any:  # noqa: ANN401
        """The goal message."""
        return self.handle.request

    @property
    def is_cancel_requested(self) -> bool:
        """Whether a client has asked to cancel it."""
        return bool(self.handle.is_cancel_requested)


GoalT = TypeVar('GoalT', bound=ServedGoal)


class GoalServer(Generic[GoalT]):
    """Accepts every goal of an action and answers it when :meth:`end` is called for it."""

    def __init__(
        self,
        node: Node,
        action: Any,  # noqa: ANN401  # rclpy has no types here
        name: str,
        *,
        accept: Callable[[Any], GoalT],
        start: Callable[[GoalT], None],
        refuse: Callable[[GoalT, Exception], None] | None = None,
        cancel: Callable[[GoalT], None],
        conclude: Callable[[GoalT], tuple[Ending, Any]],
    ) -> None:
        """Offer the action; all callbacks run in the executor.

        Args:
            node: Node of the server.
            action: Type of the action.
            name: Name of the action.
            accept: Makes the record of a goal from its handle.
            start: Begins with a goal.
            refuse: Notes what ``start`` has raised; the goal ends then. By default it is raised.
            cancel: Begins to end a goal that a client cancels.
            conclude: Returns status and result message of a goal that has ended.
        """
        self._goals: dict[bytes, GoalT] = {}
        self._accept, self._start, self._refuse = accept, start, refuse
        self._cancel, self._conclude = cancel, conclude
        self._server = _Server(
            node,
            action,
            name,
            execute_callback=self._answer,
            handle_accepted_callback=self._begin,
            cancel_callback=self._end_early,
            result_timeout=RESULT_TIMEOUT,
            # an executor that heeds groups would wait in one for the timer of the same
            callback_group=ReentrantCallbackGroup(),
        )

    @property
    def running(self) -> list[GoalT]:
        """The goals that have not ended."""
        return [goal for goal in self._goals.values() if not goal.has_ended]

    def end(self, goal: GoalT) -> None:
        """Answer a goal with what ``conclude`` returns; once, from any thread."""
        if not goal.has_ended:
            goal.has_ended = True
            self._server.notify_execute(goal.handle, None)  # leads to _answer

    def destroy(self) -> None:
        """Withdraw the action; goals are answered no more."""
        self._server.destroy()

    def _begin(self, handle: Any) -> None:  # noqa: ANN401
        # handle.execute() would end the goal when its callback returns, which is now
        handle._update_state(rclpy_implementation.GoalEvent.EXECUTE)  # noqa: SLF001
        goal = self._goals[bytes(handle.goal_id.uuid)] = self._accept(handle)
        try:
            self._start(goal)
        except Exception as error:
            if self._refuse is None:
                raise
            self._refuse(goal, error)
            self.end(goal)

    def _end_early(self, handle: Any) -> CancelResponse:  # noqa: ANN401
        goal = self._goals.get(bytes(handle.goal_id.uuid))
        if goal is not None and not goal.has_ended:
            self._cancel(goal)
        return CancelResponse.ACCEPT

    def _answer(self, handle: Any) -> Any:  # noqa: ANN401
        ending, result = self._conclude(self._goals.pop(bytes(handle.goal_id.uuid)))
        if ending is Ending.SUCCEEDED:
            handle.succeed()
        elif ending is Ending.CANCELED and handle.is_cancel_requested:
            handle.canceled()
        else:
            handle.abort()
        return result
