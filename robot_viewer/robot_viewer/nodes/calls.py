# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Calls of Trigger services, one by one or side by side, and goals of actions; none waits."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Protocol

from rclpy.action.client import ActionClient
from rclpy.client import Client
from rclpy.node import Node
from rclpy.task import Future
from std_srvs.srv import Trigger

TRIGGER = 'std_srvs/srv/Trigger'
Done = Callable[[Any, str], None]
"""Takes the result of an action, or None and why there is none."""


class Report(Protocol):
    """Reports what became of a request."""

    def __call__(self, what: str, text: str, *, failed: bool) -> None:
        """Report it."""


class TriggerCalls:
    """Clients of Trigger services; everything in the thread of the node."""

    def __init__(self, node: Node, report: Report) -> None:
        self._node, self._report = node, report
        self._clients: dict[str, Client] = {}
        self._running: dict[str, Sequence[str]] = {}

    @property
    def running(self) -> str:
        """What was requested last and is not answered yet, in words; empty for nothing."""
        return next(reversed(self._running), '')

    def forget(self, services: frozenset[str]) -> None:
        """Wait for no answer of services that are none of these."""
        self._running = {w: each for w, each in self._running.items() if services >= set(each)}

    def client(self, service: str) -> Client:
        """Return the client of a service, which finds its server in time when made early."""
        if service not in self._clients:
            self._clients[service] = self._node.create_client(Trigger, service)
        return self._clients[service]

    def call(self, service: str) -> Future | None:
        """Call a service; return its answer to come, None where it is not there."""
        client = self.client(service)
        if not client.service_is_ready():
            self._report(service, 'is not there', failed=True)
            return None
        future = client.call_async(Trigger.Request())

        def answered(done: Future) -> None:
            self._report(service, text_of(done), failed=not succeeded(done))

        future.add_done_callback(answered)
        return future

    def call_all(
        self, what: str, services: Sequence[str], done: Callable[[bool], None] | None = None
    ) -> None:
        """Call services at the same time; report all answers at once, the failures first.

        Args:
            what: What it is for, in words.
            services: Their full names.
            done: Takes whether all have succeeded.
        """
        if not services:
            self._report(what, 'is not offered', failed=True)
            if done is not None:
                done(False)
            return
        answers: dict[str, tuple[bool, str]] = {}

        def take(service: str, call: Future | None) -> None:
            text = 'its service is not there' if call is None else text_of(call)
            answers[service] = call is not None and succeeded(call), text
            if len(answers) < len(services):
                return
            self._running.pop(what, None)
            bad = [f'{_node_of(each)}: {said}' for each, (ok, said) in answers.items() if not ok]
            texts = bad or list(dict.fromkeys(said for _, said in answers.values() if said))
            count = f'{len(services) - len(bad)} of {len(services)} done'
            self._report(what, '; '.join((count, *texts)), failed=bool(bad))
            if done is not None:
                done(not bad)

        self._running[what] = services
        for service in services:
            client = self.client(service)
            if client.service_is_ready():
                call = client.call_async(Trigger.Request())
                call.add_done_callback(partial(take, service))
            else:
                take(service, None)


def succeeded(call: Future) -> bool:
    """Return whether a call was answered with success."""
    return call.exception() is None and bool(call.result().success)


def text_of(call: Future) -> str:
    """Return what a call was answered with, in words."""
    error = call.exception()
    return f'no answer: {error}' if error is not None else str(call.result().message)


def _node_of(service: str) -> str:
    return service.rpartition('/')[0].rpartition('/')[2]


class ActionCall:
    """A goal that may be canceled at any time, also before the server has answered.

    Attributes:
        ended: There is a result, or will be none.
    """

    def __init__(self, client: ActionClient, goal: Any, done: Done) -> None:  # noqa: ANN401
        """Send it."""
        self._done, self._handle = done, None
        self._is_canceled = self.ended = False
        client.send_goal_async(goal).add_done_callback(self._answered)

    def cancel(self) -> None:
        """Cancel it."""
        if self._is_canceled:
            return
        self._is_canceled = True
        if self._handle is not None:
            self._handle.cancel_goal_async()

    def _answered(self, future: Future) -> None:
        if future.exception() is not None:
            self._end(None, f'no answer: {future.exception()}')
            return
        handle = future.result()
        if not handle.accepted:
            self._end(None, 'the goal was not accepted')
            return
        self._handle = handle
        if self._is_canceled:
            handle.cancel_goal_async()
        handle.get_result_async().add_done_callback(self._ended)

    def _ended(self, future: Future) -> None:
        error = future.exception()
        if error is not None:
            self._end(None, f'no result: {error}')
        else:
            self._end(future.result().result, '')

    def _end(self, result: Any, why: str) -> None:  # noqa: ANN401
        self.ended = True
        self._done(result, why)
