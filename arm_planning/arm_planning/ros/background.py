# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Runs long work in threads beside the executor of a node, so that no callback waits for it."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
import traceback
from typing import Any

from moveit_msgs.msg import MoveItErrorCodes
from rclpy.node import Node

from node_runner import create_deferred_service

from ..exceptions import PlanningCode, PlanningError

SOURCE = 'move_group'  # who reports an error code


def error_code(code: PlanningCode = PlanningCode.SUCCESS, reason: str = '') -> MoveItErrorCodes:
    """Return a moveit_msgs/MoveItErrorCodes."""
    return MoveItErrorCodes(val=int(code), message=reason, source=SOURCE)


def as_refusal(error: BaseException) -> PlanningError:
    """Return an error as a PlanningError; an unexpected one gets CRASH and its source line."""
    if isinstance(error, PlanningError):
        return error
    place = traceback.extract_tb(error.__traceback__)[-1]
    return PlanningError(
        PlanningCode.CRASH,
        f'{type(error).__name__}: {error} (a defect in {place.name}, line {place.lineno})',
    )


class Background:
    """Threads beside the executor of a node, one per lane; each lane runs its work in order.

    Attributes:
        is_closing: Whether the node is shutting down; long work then ends early.
    """

    def __init__(self, node: Node, name: str) -> None:
        self._node, self._name = node, name
        self._pools: dict[str, ThreadPoolExecutor] = {}
        self.is_closing = False

    def _lane(self, name: str) -> ThreadPoolExecutor:
        if name not in self._pools:
            self._pools[name] = ThreadPoolExecutor(1, thread_name_prefix=self._name)
        return self._pools[name]

    def submit(
        self, work: Callable[[], Any], then: Callable[[Future[Any]], None], lane: str = ''
    ) -> Future[Any]:
        """Run work in a lane, then a callback with its future in the executor of the node."""
        future = self._lane(lane).submit(work)

        def hand_over(done: Future[Any]) -> None:
            executor = self._node.executor
            if executor is not None:
                executor.create_task(then, done)

        future.add_done_callback(hand_over)
        return future

    def serve(
        self,
        kind: Any,  # noqa: ANN401  # rclpy has no types here
        name: str,
        begin: Callable[[Any], Callable[[], Any]],
        refuse: Callable[[Any, PlanningError], None],
        lane: Callable[[Any], str] = lambda _: '',
    ) -> None:
        """Offer a service whose responses are computed in the thread of a lane.

        ``begin`` gets the request in the executor, and returns a function that makes the response.
        """

        def respond(response: Any, outcome: Future[Any]) -> Any:  # noqa: ANN401
            error = outcome.exception()
            if error is None:
                return outcome.result()
            refusal = as_refusal(error)
            refuse(response, refusal)
            self._node.get_logger().warning(f'{name} refused: {refusal}')
            return response

        def submit(request: Any) -> Future[Any]:  # noqa: ANN401
            work = begin(request)  # or it is refused, and has no lane
            return self._lane(lane(request)).submit(work)

        create_deferred_service(self._node, kind, name, submit, respond)

    def close(self) -> None:
        """Drop queued work, and wait for running work."""
        self.is_closing = True
        for pool in self._pools.values():
            pool.shutdown(wait=True, cancel_futures=True)
