# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Action servers of a node without DDS: goals are sent, canceled and answered in the test."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

from builtin_interfaces.msg import Time
import pytest

from node_runner import action_goals


class _Server:
    """What GoalServer uses of rclpy's server."""

    def __init__(self, node: GoalNode, *_: object, **callbacks: Any) -> None:
        node.servers.append(self)
        self.receive = callbacks['receive']
        self.begin = callbacks['handle_accepted_callback']
        self.cancel = callbacks['cancel_callback']
        self._execute = callbacks['execute_callback']

    def notify_execute(self, handle: Any, _: object) -> None:
        """Answer at once."""
        handle.result = self._execute(handle)


class GoalNode:
    """What action servers use of a node.

    Attributes:
        servers: Its action servers.
        logged: Its log messages.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(action_goals, '_Server', _Server)
        self.servers: list[Any] = []
        self.logged: list[str] = []
        self._timers: list[Callable[[], None]] = []

    def get_logger(self) -> Any:
        """Return what takes log messages."""
        return SimpleNamespace(error=self.logged.append, warning=self.logged.append)

    def get_clock(self) -> Any:
        """Return a clock that stands still."""
        return SimpleNamespace(now=lambda: SimpleNamespace(to_msg=Time))

    def create_timer(self, _: float, callback: Callable[[], None]) -> None:
        """Note what :meth:`watch` calls."""
        self._timers.append(callback)

    def watch(self) -> None:
        """Let all timers expire once."""
        for callback in self._timers:
            callback()

    def send(self, request: object, meanwhile: Callable[[], object] = lambda: None) -> Any:
        """Send a goal to the first server; its handle gets ``ending`` and ``result``.

        Args:
            meanwhile: Called between its request and its acceptance.
        """
        handle = SimpleNamespace(request=request, ending='', result=None)
        handle.goal_id = SimpleNamespace(uuid=id(handle).to_bytes(16, 'big'))
        handle.is_cancel_requested = False
        handle.publish_feedback = handle._update_state = lambda _: None
        for name, ending in (('succeed', 'succeeded'), ('abort', 'aborted'), ('canceled',) * 2):
            setattr(handle, name, lambda ending=ending: setattr(handle, 'ending', ending))
        self.servers[0].receive(handle.goal_id.uuid)
        meanwhile()
        self.servers[0].begin(handle)
        return handle

    def cancel(self, handle: Any) -> None:
        """Cancel a goal as a client."""
        handle.is_cancel_requested = True
        self.servers[0].cancel(handle)
