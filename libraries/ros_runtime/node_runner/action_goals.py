# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Action goals that a control loop executes, so that no callback waits for their end."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from contextlib import suppress
from dataclasses import dataclass, field
from enum import Enum
import time
import traceback
from typing import Any, Generic, TypeVar

from builtin_interfaces.msg import Time
from rclpy.action.client import ActionClient
from rclpy.action.server import ActionServer, CancelResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node

RESULT_TIMEOUT = 10.0
"""Time in [s] that an ended goal is kept for late requests, as by rcl; rclpy keeps it for 900."""

ANSWER_DELAY = 0.02
"""Minimum time in [s] from a request to its answer.

Clients of rclpy 7.1 register a request only after sending it, and drop an answer that another
thread receives before: 1 of 40 motions of pymoveit2 hung. Python switches threads every 5 ms, and
with several threads, or on a busy computer, it takes some switches. Cancel requests are not
delayed, because the motion would go on meanwhile. The record of a goal is made when its request
comes, so that a stop during the delay counts for it.
"""

REPEATS = (2.0, 3.0)
"""Pauses in [s] after which acceptance is sent again while no result has been requested.

Longer than clients are held up: one that finds two of them ends with an error of rclpy's. A client
that requests the result has received the acceptance. On a busy computer its thread may pause for
longer than ``ANSWER_DELAY`` between sending and registering. A client that has the acceptance, but
never requests a result, drops the repeats with a warning.
"""

RESULT_RATIO, LONGEST_DELAY = 4.0, 0.5
"""Delay of a result: ratio times (time from goal to result request, less ``ANSWER_DELAY``), and
its maximum in [s]. No message confirms a result; that time shows how long threads pause.
"""


class _Server(ActionServer):
    """Answers after the client has registered its request, see ``ANSWER_DELAY``, ``REPEATS``."""

    def __init__(
        self,
        *args: Any,  # noqa: ANN401  # as of rclpy
        receive: Callable[[bytes], None],
        forget: Callable[[bytes], None],
        cancel_received: Callable[[], None],
        **kwargs: Any,  # noqa: ANN401
    ) -> None:
        """Callbacks: a goal was received; its answer was sent; the client cancels all goals."""
        self._came_at: dict[bytes, float] = {}
        """Arrival times in [s] of goals whose result was not yet requested."""
        self._receive, self._forget = receive, forget
        self._cancel_received = cancel_received
        super().__init__(*args, **kwargs)

    async def _execute_goal_request(self, request: Any) -> None:  # noqa: ANN401  # rclpy has no types
        header, goal = request
        uuid = bytes(goal.goal_id.uuid)
        if uuid not in self._came_at:
            self._came_at[uuid] = time.monotonic()
            first, *others = REPEATS
            self._later(ANSWER_DELAY + first, self._accept_again, header, uuid, *others)
        self._receive(uuid)
        self._later(ANSWER_DELAY, self._answer_goal, request)

    async def _answer_goal(self, request: Any) -> None:  # noqa: ANN401
        await super()._execute_goal_request(request)
        self._forget(bytes(request[1].goal_id.uuid))

    async def _execute_cancel_request(self, request: Any) -> None:  # noqa: ANN401
        asked = request[1].goal_info
        if not any(asked.goal_id.uuid) and asked.stamp == Time():  # all goals are canceled
            self._cancel_received()
        await super()._execute_cancel_request(request)

    async def _execute_get_result_request(self, request: Any) -> None:  # noqa: ANN401
        now = time.monotonic()
        came = self._came_at.pop(bytes(request[1].goal_id.uuid), now)
        paced = RESULT_RATIO * (now - came - ANSWER_DELAY)
        delay = min(max(ANSWER_DELAY, paced), LONGEST_DELAY)
        self._later(delay, super()._execute_get_result_request, request)

    async def _execute_expire_goals(self, expired_goals: Any) -> None:  # noqa: ANN401
        for goal in expired_goals:
            self._came_at.pop(bytes(goal.goal_id.uuid), None)
        await super()._execute_expire_goals(expired_goals)

    async def _accept_again(self, header: Any, uuid: bytes, *pauses: float) -> None:  # noqa: ANN401
        goal = self._goal_handles.get(uuid)
        if goal is None or uuid not in self._came_at:
            return
        response = self.action_type.Impl.SendGoalService.Response(accepted=True)
        response.stamp = goal._goal_info.stamp  # noqa: SLF001  # rclpy shows no other
        with suppress(rclpy_implementation.RCLError):  # the client has gone
            self._handle.send_goal_response(header, response)
        if pauses:
            self._later(pauses[0], self._accept_again, header, uuid, *pauses[1:])

    def _later(
        self,
        delay: float,
        work: Callable[..., Coroutine[Any, Any, None]],
        *args: Any,  # noqa: ANN401
    ) -> None:
        """Run a coroutine after a time in [s].

        The coroutine must not wait: rclpy's EventsExecutor busy-polls a waiting coroutine, which
        takes a core. A timer is not destroyed in its callback, which may be queued twice.
        """

        async def begin() -> None:
            self._node.destroy_timer(timer)
            await work(*args)

        def due() -> None:
            if not timer.is_canceled():
                timer.cancel()
                self._node.executor.create_task(begin)

        timer = self._node.create_timer(
            delay,
            due,
            callback_group=self.callback_group,
            clock=Clock(clock_type=ClockType.STEADY_TIME),  # simulated time may stand still
        )


class GoalClient(ActionClient):
    """An action client that tolerates a repeated acceptance.

    Our action servers repeat it if no result is requested soon. On a busy computer both may be
    queued; rclpy raises RuntimeError for the second, and its EventsExecutor crashes (SIGSEGV) when
    a task raises.
    """

    async def execute(self, taken_data: dict[str, Any]) -> None:
        """Process the received data, without a repeated acceptance."""
        sequence, _ = taken_data.get('goal', (None, None))
        goal_id = self._goal_sequence_number_to_goal_id.get(sequence)
        if goal_id is not None and bytes(goal_id.uuid) in self._goal_handles:
            del taken_data['goal']
        await super().execute(taken_data)


class Ending(Enum):
    """Final status of a goal."""

    SUCCEEDED = 'succeeded'
    CANCELED = 'canceled'  # aborted, unless a client has asked for it
    ABORTED = 'aborted'


@dataclass(slots=True, eq=False)
class ServedGoal:
    """A goal from its request to its result; servers derive their goal records from it."""

    handle: Any = field(default=None, init=False)  # rclpy's ``ServerGoalHandle``, once accepted
    is_canceled_early: bool = field(default=False, init=False)  # canceled before its acceptance
    has_ended: bool = field(default=False, init=False)  # whether its result is on the way
    # why it could not be started or watched
    failure: Exception | None = field(default=None, init=False)


GoalT = TypeVar('GoalT', bound=ServedGoal)


class GoalServer(Generic[GoalT]):
    """Accepts every goal of an action and answers it when :meth:`end` is called for it."""

    def __init__(
        self,
        node: Node,
        action: Any,  # noqa: ANN401  # rclpy has no types here
        name: str,
        *,
        accept: Callable[[], GoalT],
        start: Callable[[GoalT], None],
        cancel: Callable[[GoalT], None],
        conclude: Callable[[GoalT], tuple[Ending, Any]],
        fail: Callable[[GoalT, Exception], Any],
        refusals: tuple[type[Exception], ...] = (),
        has_stopped: Callable[[GoalT], bool] = lambda _: True,
    ) -> None:
        """Create the action server; callbacks run in the executor and never end it.

        Args:
            accept: Creates the record of a goal when its request arrives: a goal stopped after
                that must not begin.
            start: Starts a goal, ``ANSWER_DELAY`` after its request.
            cancel: Starts the cancellation of a goal by a client; if it raises, the request is
                rejected.
            conclude: Returns status and result message of a goal that has ended.
            fail: Returns the result message, with code and reason, of a goal that is aborted
                because ``start``, ``conclude`` or a :meth:`watch` raised.
            refusals: Exceptions of ``start`` for goals that cannot be executed; any other is a
                defect, logged with its traceback.
            has_stopped: Whether the motion of a goal has stopped: a goal whose :meth:`watch`
                raised is canceled, and answered then.
        """
        self._received: dict[bytes, GoalT] = {}  # goals that are not accepted yet
        self._goals: dict[bytes, GoalT] = {}
        self._accept, self._start, self._cancel = accept, start, cancel
        self._conclude, self._fail, self._refusals = conclude, fail, refusals
        self._has_stopped = has_stopped
        self._name, self._log = name, node.get_logger()
        self._server = _Server(
            node,
            action,
            name,
            execute_callback=self._answer,
            handle_accepted_callback=self._begin,
            cancel_callback=self._end_early,
            receive=self._receive,
            forget=self._forget,
            cancel_received=self._cancel_received,
            result_timeout=RESULT_TIMEOUT,
            # an executor that heeds groups would wait in one for the timer of the same
            callback_group=ReentrantCallbackGroup(),
        )

    @property
    def running(self) -> list[GoalT]:
        """The goals that have not ended."""
        return [goal for goal in self._goals.values() if not goal.has_ended]

    def watch(self, look: Callable[[GoalT], None]) -> None:
        """Call ``look`` for each running goal; cancel and abort a goal for which it raises.

        That goal is answered once its motion has stopped, or if that cannot be determined.
        """
        for goal in self.running:
            try:
                if goal.failure is None:
                    look(goal)
            except Exception as error:  # noqa: BLE001  # the others are looked at, too
                goal.failure = error
                self._end_early(goal.handle)
            if goal.failure is not None:
                self._end_failed(goal)

    def _end_failed(self, goal: GoalT) -> None:
        try:
            is_due = self._has_stopped(goal)
        except Exception as error:  # noqa: BLE001  # the others are looked at, too
            self._log_defect(error)
            is_due = True  # it cannot be asked: the client is not left without an answer
        if is_due:
            self.end(goal)

    def end(self, goal: GoalT) -> None:
        """Answer a goal with the result of ``conclude``; once, always in the same thread."""
        if not goal.has_ended:
            goal.has_ended = True
            self._server.notify_execute(goal.handle, None)  # leads to _answer

    def destroy(self) -> None:
        """Destroy the action server; pending goals get no answer."""
        self._server.destroy()

    def _receive(self, uuid: bytes) -> None:
        self._received.setdefault(uuid, self._accept())

    def _forget(self, uuid: bytes) -> None:
        self._received.pop(uuid, None)

    def _cancel_received(self) -> None:
        for goal in self._received.values():
            goal.is_canceled_early = True

    def _begin(self, handle: Any) -> None:  # noqa: ANN401
        # handle.execute() would end the goal when its callback returns, which is now
        handle._update_state(rclpy_implementation.GoalEvent.EXECUTE)  # noqa: SLF001
        uuid = bytes(handle.goal_id.uuid)
        goal = self._goals[uuid] = self._received[uuid]
        goal.handle = handle
        try:
            self._start(goal)
        except Exception as error:  # noqa: BLE001  # the goal is answered with it
            goal.failure = error
            self.end(goal)
        if goal.is_canceled_early and not goal.has_ended:
            handle._update_state(rclpy_implementation.GoalEvent.CANCEL_GOAL)  # noqa: SLF001
            self._end_early(handle)

    def _end_early(self, handle: Any) -> CancelResponse:  # noqa: ANN401
        goal = self._goals.get(bytes(handle.goal_id.uuid))
        if goal is not None and not goal.has_ended:
            try:
                self._cancel(goal)
            except Exception as error:  # noqa: BLE001  # the goal goes on: the answer says so
                self._log_defect(error)
                return CancelResponse.REJECT
        return CancelResponse.ACCEPT

    def _answer(self, handle: Any) -> Any:  # noqa: ANN401
        goal = self._goals.pop(bytes(handle.goal_id.uuid))
        ending, result = self._outcome(goal)
        if ending is Ending.SUCCEEDED:
            handle.succeed()
        elif ending is Ending.CANCELED and handle.is_cancel_requested:
            handle.canceled()
        else:
            handle.abort()
        return result

    def _outcome(self, goal: GoalT) -> tuple[Ending, Any]:
        error = goal.failure
        if error is None:
            try:
                return self._conclude(goal)
            except Exception as defect:  # noqa: BLE001  # rclpy would answer with an empty result
                error = defect
                self._log_defect(error)
        elif not isinstance(error, self._refusals):
            self._log_defect(error)
        return Ending.ABORTED, self._fail(goal, error)

    def _log_defect(self, error: Exception) -> None:
        self._log.error(f'{self._name}: {"".join(traceback.format_exception(error))}')
