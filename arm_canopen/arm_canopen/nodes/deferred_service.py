# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Services whose answer comes later, without a callback that waits.

rclpy sends the response when the callback returns. The callbacks here return a ``Deferred``
instead, and the response is sent when it is resolved, from whatever thread. Coroutine callbacks
are no way out: in Jazzy the events executor does not run them, the single-threaded one runs them
one after another.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
import threading
from typing import Any

from rclpy.node import Node
from rclpy.service import Service

from .output_thread import OutputThread


class Deferred:
    """A response that is not known yet."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._response: Any = None
        self._send: Callable[[Any], None] | None = None

    def resolve(self, response: Any) -> None:  # noqa: ANN401  # message classes have no type
        """Give the response."""
        with self._lock:
            self._response = response
            send = self._send
        if send is not None:
            send(response)

    def send_by(self, send: Callable[[Any], None]) -> None:
        """Give the way to send it."""
        with self._lock:
            self._send = send
            response = self._response
        if response is not None:
            send(response)


class DeferredServices:
    """Creates services of one process whose handlers return futures."""

    def __init__(self, output: OutputThread) -> None:
        self._output = output

    def create(
        self,
        node: Node,
        service_type: Any,  # noqa: ANN401  # service classes have no type
        name: str,
        handler: Callable[[Any], Future[Any]],
        respond: Callable[[Any, Future[Any]], None],
    ) -> Service:
        """Create a service.

        Args:
            node: The node that offers it.
            service_type: Its type.
            name: Its name.
            handler: Called with each request; returns the future of its outcome.
            respond: Called with an empty response and the finished future; fills the response in.
        """

        def callback(request: Any, response: Any) -> Deferred:  # noqa: ANN401
            deferred = Deferred()

            def finish(future: Future[Any]) -> None:
                try:
                    respond(response, future)
                finally:  # a client gets an answer, also when it could not be filled in
                    deferred.resolve(response)

            def finished(future: Future[Any]) -> None:
                self._output.post(lambda: finish(future))

            handler(request).add_done_callback(finished)
            return deferred

        service = node.create_service(service_type, name, callback)
        send_now = service.send_response

        def send_later(deferred: Deferred, header: Any) -> None:  # noqa: ANN401
            deferred.send_by(lambda response: send_now(response, header))

        # an instance attribute, because create_service offers no class of one's own
        setattr(service, 'send_response', send_later)  # noqa: B010
        return service
