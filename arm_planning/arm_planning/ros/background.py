# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Work that takes time beside the executor of a node: no callback ever waits for it."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
import traceback
from typing import Any

from moveit_msgs.msg import MoveItErrorCodes
from rclpy.node import Node

from node_runner import create_deferred_service

from ..exceptions import PlanningCode, PlanningError

SOURCE = 'move_group'
"""Who reports an error code."""


def error_code(code: PlanningCode = PlanningCode.SUCCESS, reason: str = '') -> MoveItErrorCodes:
    """Return a moveit_msgs/MoveItErrorCodes.

    Args:
        code: The code.
        reason: What is wrong, in words.
    """
    return MoveItErrorCodes(val=int(code), message=reason, source=SOURCE)


def as_refusal(error: BaseException) -> PlanningError:
    """Return an error as one with a code; a defect is CRASH, with its place."""
    if isinstance(error, PlanningError):
        return error
    place = traceback.extract_tb(error.__traceback__)[-1]
    return PlanningError(
        PlanningCode.CRASH,
        f'{type(error).__name__}: {error} (a defect in {place.name}, line {place.lineno})',
    )


class Background:
    """One thread beside the executor of a node; work is done in turn."""

    def __init__(self, node: Node, name: str) -> None:
        """Start no thread before there is work.

        Args:
            node: The node.
            name: Name of the thread.
        """
        self._node = node
        self._pool = ThreadPoolExecutor(1, thread_name_prefix=name)

    def submit(self, work: Callable[[], Any], then: Callable[[Future[Any]], None]) -> Future[Any]:
        """Have work done, and what follows from it in the executor of the node.

        Args:
            work: What is done in the thread.
            then: Gets the future of the work when that is done or cancelled.
        """
        future = self._pool.submit(work)

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
    ) -> None:
        """Offer a service whose answers are made in the thread.

        Args:
            kind: Type of the service.
            name: Its name.
            begin: Called in the executor with the request; returns what makes the response.
            refuse: Fills the response of a request that is refused.
        """

        def respond(response: Any, outcome: Future[Any]) -> Any:  # noqa: ANN401
            error = outcome.exception()
            if error is None:
                return outcome.result()
            refusal = as_refusal(error)
            refuse(response, refusal)
            self._node.get_logger().warning(f'{name} refused: {refusal}')
            return response

        create_deferred_service(
            self._node, kind, name, lambda request: self._pool.submit(begin(request)), respond
        )

    def close(self) -> None:
        """Drop what has not begun, and wait for what has."""
        self._pool.shutdown(wait=True, cancel_futures=True)
