# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``stop``: one service that stops the robot, whatever moves it."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Future
from typing import Any

from rclpy.node import Node
from std_msgs.msg import String
from std_srvs.srv import Trigger

from node_runner import create_deferred_service

from ..cia402.commands import AxisCommands
from ..cia402.stop_all import stop_all, StopReport
from ..master.runner import NetworkThread
from .output_thread import OutputThread

SERVICE = 'stop'
EVENT_TOPIC, STOP_EVENT = 'trajectory_execution_event', 'stop'
"""By which MoveIt's move_group, or ours, gives up what it executes, and what it was to execute."""


class StopService:
    """Halts all drives of a bus; it is there at any time, also while devices boot."""

    def __init__(
        self,
        node: Node,
        commands: Sequence[AxisCommands],
        thread: NetworkThread,
        output: OutputThread,
    ) -> None:
        self._node, self._commands, self._thread = node, commands, thread
        self._events = node.create_publisher(String, EVENT_TOPIC, 10)
        create_deferred_service(node, Trigger, SERVICE, self._stop, self._answer, post=output.post)

    def _stop(self, _: Trigger.Request) -> Future[StopReport]:
        self._events.publish(String(data=STOP_EVENT))  # or a plan would begin after the halt
        scheduler = self._thread.network.scheduler
        return self._thread.run_coroutine(lambda: stop_all(self._commands, scheduler))

    def _answer(self, response: Any, future: Future[StopReport]) -> Any:  # noqa: ANN401
        error = future.exception()
        if error is None:
            report = future.result()
            response.success, response.message = not report.failed, str(report)
        else:
            response.success, response.message = False, str(error)
        words = f'{SERVICE}: {response.message}'
        # a line of its own for each severity: rclpy refuses another one from the same line
        if response.success:
            self._node.get_logger().info(words)
        else:
            self._node.get_logger().error(words)
        return response
