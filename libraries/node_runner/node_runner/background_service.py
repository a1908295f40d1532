# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A service whose answers are made in a thread: no callback of the executor waits for them."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor, Future
from typing import Any

from rclpy.node import Node
from rclpy.service import Service


def create_background_service(
    node: Node,
    kind: Any,  # noqa: ANN401  # service classes have no type
    name: str,
    work: Callable[[Any, Any], Any],
    pool: Executor,
) -> Service:
    """Create a service; its response is sent when the work is done.

    Args:
        node: The node that offers it.
        kind: Its type.
        name: Its name.
        work: Gets request and response in a thread of the pool; fills the response and returns
            it. What it raises is for the log: the client gets the response as it is then.
        pool: Does the work. Shut it down before the node is destroyed.
    """
    pending: dict[int, Future[Any]] = {}

    def take(request: Any, response: Any) -> Any:  # noqa: ANN401
        pending[id(response)] = pool.submit(work, request, response)
        return response

    service = node.create_service(kind, name, take)
    send_now = service.send_response

    def send_later(response: Any, header: Any) -> None:  # noqa: ANN401
        def finish(done: Future[Any]) -> None:
            if done.cancelled():
                return  # the node ends
            if error := done.exception():
                node.get_logger().error(f'{name}: {type(error).__name__}: {error}')
            send_now(response, header)

        pending.pop(id(response)).add_done_callback(finish)

    # the executor calls this with what the callback returned; create_service takes no class
    service.send_response = send_later  # type: ignore[method-assign]
    return service
