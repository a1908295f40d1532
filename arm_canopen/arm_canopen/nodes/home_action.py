# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Homing as an action: with feedback, and to be cancelled."""

from __future__ import annotations

from concurrent.futures import Future
from functools import partial
import math
import time
from typing import Any, TYPE_CHECKING

from rclpy.action.server import ActionServer, CancelResponse
from rclpy.impl.implementation_singleton import rclpy_implementation

from arm_msgs.action import Home

from ..cia402.drive_commands import DriveCommands
from ..cia402.homing import HomingProgress
from ..master.runner import NetworkThread
from ..master.scheduler import Promise
from .output_thread import OutputThread

if TYPE_CHECKING:
    from .device_node import DeviceNode

FEEDBACK_PERIOD = 0.1  # [s]


class HomeAction:
    """The action ``~/home`` of one axis.

    rclpy runs a goal in a callback or coroutine, which would keep the executor from everything
    else; here the goal is told its end when the sequence in the thread of the network has ended.
    """

    def __init__(
        self,
        node: DeviceNode,
        commands: DriveCommands,
        name: str,
        thread: NetworkThread,
        output: OutputThread,
    ) -> None:
        """Offer the action; arguments as of :class:`.axis_services.AxisServices`."""
        self._node = node
        self._commands = commands
        self._thread = thread
        self._output = output
        self._phases: dict[bytes, str] = {}
        self._results: dict[bytes, Home.Result] = {}
        self._server = ActionServer(
            node,
            Home,
            name,
            execute_callback=self._conclude,
            handle_accepted_callback=self._start,
            cancel_callback=self._cancel,
        )

    def _start(self, goal: Any) -> None:  # noqa: ANN401  # rclpy has no types here
        # goal.execute() would end the goal when its callback returns, which is now
        goal._update_state(rclpy_implementation.GoalEvent.EXECUTE)  # noqa: SLF001
        begin = time.monotonic()
        key = bytes(goal.goal_id.uuid)
        self._phases[key] = HomingProgress.ENABLING.value
        timer = self._node.create_timer(
            FEEDBACK_PERIOD, lambda: self._publish_feedback(goal, time.monotonic() - begin)
        )

        def tell(progress: HomingProgress) -> None:
            self._phases[key] = progress.value

        def run() -> Promise[str]:
            self._node.admit()
            method = goal.request.method or None
            return self._commands.run('home', self._commands.home(method, tell))

        def finished(future: Future[str]) -> None:
            self._output.post(partial(self._finish, goal, timer, future))

        self._thread.run(run).add_done_callback(finished)

    def _cancel(self, goal: Any) -> CancelResponse:  # noqa: ANN401
        self._thread.call(lambda: self._commands.cancel('homing was cancelled'))
        return CancelResponse.ACCEPT

    def _publish_feedback(self, goal: Any, elapsed: float) -> None:  # noqa: ANN401
        phase = self._phases.get(bytes(goal.goal_id.uuid))
        if phase is not None and goal.is_active:
            position = self._commands.drive.position
            goal.publish_feedback(Home.Feedback(phase=phase, position=position, elapsed=elapsed))

    def _finish(self, goal: Any, timer: Any, future: Future[str]) -> None:  # noqa: ANN401
        self._node.destroy_timer(timer)
        key = bytes(goal.goal_id.uuid)
        self._phases.pop(key, None)
        error = future.exception()
        drive = self._commands.drive
        self._results[key] = Home.Result(
            success=error is None,
            message=future.result() if error is None else str(error),
            position=drive.position if drive.objects.known else math.nan,
        )
        self._server.notify_execute(goal, None)  # leads to _conclude, in the executor

    def _conclude(self, goal: Any) -> Home.Result:  # noqa: ANN401
        result = self._results.pop(bytes(goal.goal_id.uuid))
        if result.success:
            goal.succeed()
        elif goal.is_cancel_requested:
            goal.canceled()
        else:
            goal.abort()
        return result
