# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Asks the controller for something, and never waits for the answer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from rclpy.node import Node
from rclpy.task import Future

ANSWER_TIMEOUT = 3.0  # [s]
DISCOVERY_TIMEOUT = 2.0  # [s] that DDS may need to find a service after the start
KEY_REPEAT_TIME = 0.7  # [s] within which the same question is the keyboard repeating a key


@dataclass(frozen=True, slots=True)
class _Question:
    what: str  # in words
    request: Any
    requested_at: float


class CommandClient:
    """Client of a service that answers ``success`` and ``message``. Times are in [s]."""

    def __init__(
        self,
        node: Node,
        service_type: Any,  # noqa: ANN401
        service: str,
        show: Callable[[str], None],
        granted: Callable[[str], None] = lambda _: None,
        *,
        drops_repeats: bool = True,
    ) -> None:
        """Make the client.

        Args:
            node: The node; somebody has to spin it for answers to arrive.
            service_type: Type of the service.
            service: Its name.
            show: Receives the answers, and why there is none.
            granted: Receives what was requested, when it was granted.
            drops_repeats: The same request is not sent again while a key repeats it.
        """
        self._client = node.create_client(service_type, service)
        self._name = node.resolve_service_name(service)
        self._show = show
        self._granted = granted
        self._drops_repeats = drops_repeats
        self._question: _Question | None = None  # the last one
        self._future: Future | None = None
        self._is_waiting = False  # for the service to be found

    def request(self, what: str, request: Any, now: float) -> None:  # noqa: ANN401
        """Ask for something, named by a word; a question that is still open is dropped."""
        last = self._question
        if (
            self._drops_repeats
            and last is not None
            and last.what == what
            and now - last.requested_at < KEY_REPEAT_TIME
        ):
            return
        self.cancel()
        self._question = _Question(what, request, now)
        self._is_waiting = True
        self.check(now)

    def cancel(self) -> None:
        """Drop a question that is still open: it is not sent any more, or its answer ignored."""
        self._question = None
        self._is_waiting = False
        self._forget()

    def check(self, now: float) -> None:
        """Send what waits for the service; give up what is overdue."""
        question = self._question
        if question is None:
            return
        age = now - question.requested_at
        if self._is_waiting and self._client.service_is_ready():
            self._is_waiting = False
            self._future = self._client.call_async(question.request)
            self._future.add_done_callback(partial(self._answered, question.what))
        elif self._is_waiting and age > DISCOVERY_TIMEOUT:
            self._is_waiting = False
            self._show(
                f'{question.what}: no service {self._name}; is controller_node '
                'running, with this ROS_DOMAIN_ID and namespace?'
            )
        elif self._future is not None and age > ANSWER_TIMEOUT:
            self._forget()
            self._show(
                f'{question.what}: no answer of {self._name} within {ANSWER_TIMEOUT:.0f} s; '
                'does controller_node still run?'
            )

    def _forget(self) -> None:
        if self._future is not None:
            self._client.remove_pending_request(self._future)
            self._future = None

    def _answered(self, what: str, future: Future) -> None:
        if future is not self._future:
            return
        self._future = None
        response = future.result()
        if response is None:
            return
        if response.success:
            self._granted(what)
            self._show(f'{what}: {response.message or "done"}')
        else:
            self._show(f'{what} refused: {response.message}')
