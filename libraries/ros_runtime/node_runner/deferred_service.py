# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A service whose responses are sent later: no callback of the executor waits for them.

rclpy sends a response when the callback returns. Coroutine callbacks do not help: in Jazzy the
events executor does not run them, and the single-threaded one runs them one by one.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from functools import partial
from typing import Any

from rclpy.node import Node
from rclpy.service import Service


def create_deferred_service(
    node: Node,
    kind: Any,  # noqa: ANN401  # service classes have no type
    name: str,
    begin: Callable[[Any], Future[Any]],
    respond: Callable[[Any, Future[Any]], Any] = lambda _, outcome: outcome.result(),
    *,
    post: Callable[[Callable[[], None]], None] = lambda work: work(),
) -> Service:
    """Create a service that sends its response when a future is done.

    The caller finishes or cancels pending futures before it destroys the node; a cancelled request
    gets no answer.

    Args:
        begin: Called in the executor with each request; returns the future of its outcome. Its
            exception is an outcome, too.
        respond: Called with an empty response and the outcome; returns the response to send. By
            default the outcome is the response. If it raises, that is logged, and the empty
            response is sent as filled in so far.
        post: Runs ``respond`` and the sending in a thread of the caller's choice; by default in
            the thread that finishes the future.
    """

    def receive(request: Any, response: Any) -> tuple[Any, Future[Any]]:  # noqa: ANN401
        try:
            return response, begin(request)
        except Exception as error:  # noqa: BLE001  # it must not end the executor
            refused: Future[Any] = Future()
            refused.set_exception(error)
            return response, refused

    service = node.create_service(kind, name, receive)
    send_now = service.send_response

    def send(response: Any, outcome: Future[Any], header: Any) -> None:  # noqa: ANN401
        try:
            response = respond(response, outcome)
        except Exception as error:  # noqa: BLE001  # the client gets an answer all the same
            node.get_logger().error(f'{name}: {type(error).__name__}: {error}')
        send_now(response, header)

    def send_later(received: tuple[Any, Future[Any]], header: Any) -> None:  # noqa: ANN401
        response, outcome = received

        def finish(_: Future[Any]) -> None:
            if not outcome.cancelled():
                post(partial(send, response, outcome, header))

        outcome.add_done_callback(finish)

    # the executor calls this with what the callback returned; create_service takes no class
    service.send_response = send_later  # type: ignore[method-assign, assignment]
    return service
