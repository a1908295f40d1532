# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""ROS interfaces of one robot, shared by its viewers.

Finds the robot's nodes among those of others, calls services and actions without blocking, and
runs a viewer node.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
import sys
import threading
import traceback
from typing import Any, Protocol, TYPE_CHECKING

from rclpy.client import Client
from rclpy.node import Node
from rclpy.task import Future

from node_runner import log_as, notify_ready, spin

if TYPE_CHECKING:
    from rclpy.action.client import ActionClient

DESCRIPTION = '/robot_description'  # topic of each robot, in its namespace
SET_NMT_TYPE, SET_MODE_TYPE = 'canopen_interfaces/srv/CONmtID', 'quad_msgs/srv/SetMode'
"""Service types that only a CANopen master has, and only a walking robot's controller."""


def of_robot(description: str, topics: Iterable[str], nodes: Iterable[str]) -> list[str]:
    """Return the nodes of one robot: those whose closest robot namespace is its own.

    All names are fully qualified; ``description`` is the robot's description topic.
    """
    robots = {name.removesuffix(DESCRIPTION) for name in topics if name.endswith(DESCRIPTION)}
    own = description.removesuffix(DESCRIPTION)
    robots.add(own)

    def nearest(node: str) -> str | None:
        above = [robot for robot in robots if node.startswith(f'{robot}/')]
        return max(above, key=len, default=None)

    return sorted(node for node in set(nodes) if nearest(node) == own)


def stops_robot(node: str, services: Mapping[str, Collection[str]]) -> bool:
    """Return whether a node's `stop` stops the robot: it controls drives or legs."""
    beside = node.rpartition('/')[0]
    return SET_NMT_TYPE in services.get(f'{node}/set_nmt', ()) or SET_MODE_TYPE in services.get(
        f'{beside}/set_mode', ()
    )


TRIGGER = 'std_srvs/srv/Trigger'


class Report(Protocol):
    """Callback that reports the outcome of a request."""

    def __call__(self, text: str, *, failed: bool) -> None:
        """Report the outcome."""


class TriggerCalls:
    """Clients of Trigger services. Call in the node's thread."""

    def __init__(self, node: Node, report: Report) -> None:
        self._node, self._report = node, report
        self._clients: dict[str, Client] = {}
        self._running: dict[str, Sequence[str]] = {}

    @property
    def running(self) -> str:
        """Label of the last unanswered request; empty for none."""
        return next(reversed(self._running), '')

    def forget(self, services: frozenset[str]) -> None:
        """Stop waiting for services that are not among these."""
        self._running = {w: each for w, each in self._running.items() if services >= set(each)}

    def client(self, service: str) -> Any:  # noqa: ANN401  # requests have no type
        """Return the client of a service; create it early, since discovery takes time."""
        if service not in self._clients:
            from std_srvs.srv import Trigger  # the Foxglove bridge does not need it

            self._clients[service] = self._node.create_client(Trigger, service)
        return self._clients[service]

    def call(self, service: str, take: Callable[[bool, str], None]) -> None:
        """Call a service; ``take`` receives success and answer text."""
        client = self.client(service)
        if not client.service_is_ready():
            take(False, 'its service is not there')
            return
        future = client.call_async(client.srv_type.Request())
        future.add_done_callback(lambda done: take(succeeded(done), text_of(done)))

    def call_all(
        self, what: str, services: Sequence[str], done: Callable[[bool], None] = lambda _: None
    ) -> None:
        """Call services in parallel; report all answers together, failures first."""
        answers: dict[str, tuple[bool, str]] = {}

        def take(service: str, ok: bool, text: str) -> None:
            answers[service] = ok, text
            if len(answers) < len(services):
                return
            self._running.pop(what, None)
            bad = [f'{n.split("/")[-2]}: {said}' for n, (ok, said) in answers.items() if not ok]
            texts = bad or list(dict.fromkeys(said for _, said in answers.values() if said))
            count = f'{len(services) - len(bad)} of {len(services)} done'
            self._report(f'{what}: {"; ".join((count, *texts))}', failed=bool(bad))
            done(not bad)

        if not services:
            self._report(f'{what}: is not offered', failed=True)
            done(False)
            return
        self._running[what] = services
        for service in services:
            self.call(service, partial(take, service))


def succeeded(call: Future) -> bool:
    """Return whether a call succeeded."""
    return call.exception() is None and bool(call.result().success)


def text_of(call: Future) -> str:
    """Return the answer text of a call."""
    error = call.exception()
    return f'no answer: {error}' if error is not None else str(call.result().message)


Done = Callable[['ActionCall', Any, str], None]
"""Called with a goal and its result, or with None and the reason."""


class ActionCall:
    """An action goal that can be canceled at any time, even before the server answers."""

    def __init__(self, client: ActionClient, goal: Any, done: Done) -> None:  # noqa: ANN401
        """Send the goal."""
        self._done, self._handle = done, None
        self._is_canceled = self.ended = False
        client.send_goal_async(goal).add_done_callback(self._answered)

    def cancel(self) -> None:
        """Cancel the goal."""
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
        self._done(self, result, why)


class Border:
    """Catches errors in ROS callbacks: reports each once, and lets the node continue."""

    def __init__(self, node: Node, say: Callable[[str], None] = lambda _: None) -> None:
        self._node, self._say = node, say
        self._said: set[str] = set()

    @contextmanager
    def around(self, what: str) -> Iterator[None]:
        """Report an exception of the block instead of raising it."""
        try:
            yield
        except Exception as error:  # noqa: BLE001  # ROS input can raise anything
            self.report(what, error)

    def report(self, what: str, error: Exception) -> None:
        """Log an error once."""
        text = f'{what}: {_reason(error)}'
        if text in self._said:
            return
        self._said.add(text)
        self._node.get_logger().error(text)
        self._node.get_logger().debug(''.join(traceback.format_exception(error)))
        self._say(text)


def _reason(error: Exception) -> str:
    if isinstance(error, ModuleNotFoundError):
        package = (error.name or str(error)).partition('.')[0]
        return f'{package} is not installed here: run `make build`, or install it'
    return str(error) if isinstance(error, ValueError) else f'{type(error).__name__}: {error}'


def serve(
    node: Node,
    seen_at: str,
    close: Callable[[], None],
    stop: threading.Event,
    border: Border | None = None,
) -> None:
    """Run a viewer until ``stop`` is set, then close its connections."""
    border = border or Border(node)
    log_as(node)
    sys.stdout.write(f'{seen_at}\n')  # not to /rosout and bags: it may contain a token
    sys.stdout.flush()
    notify_ready(seen_at)
    try:
        spin([node], stop, survive=lambda error: border.report('a message or answer', error))
    finally:
        close()
        node.destroy_node()
