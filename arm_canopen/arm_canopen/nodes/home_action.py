# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Homing as an action: with feedback, and to be cancelled."""

from __future__ import annotations

from concurrent.futures import Future
from dataclasses import dataclass, field
from functools import partial
import math
import time
from typing import Any, TYPE_CHECKING

from rclpy.action.server import CancelResponse

from arm_msgs.action import Home
from node_runner.action_goals import serve_goals

from ..cia402.commands import AxisCommands
from ..cia402.homing import HomingProgress
from ..master.runner import NetworkThread
from ..master.scheduler import Promise
from .output_thread import OutputThread

if TYPE_CHECKING:
    from .device_node import DeviceNode

FEEDBACK_PERIOD = 0.1  # [s]


@dataclass(slots=True)
class _Homing:
    """A goal from its acceptance to its end."""

    phase: str = HomingProgress.ENABLING.value
    begin: float = field(default_factory=time.monotonic)
    timer: Any = None
    task: Promise[str] | None = None
    result: Any = None


class HomeAction:
    """The action ``~/home`` of one axis.

    rclpy runs a goal in a callback or coroutine, which would keep the executor from everything
    else; here the goal ends when the sequence in the thread of the network has ended.
    """

    def __init__(
        self,
        node: DeviceNode,
        commands: AxisCommands,
        name: str,
        thread: NetworkThread,
        output: OutputThread,
    ) -> None:
        """Offer the action; arguments as of :class:`.axis_services.AxisServices`."""
        self._node = node
        self._commands = commands
        self._thread = thread
        self._output = output
        self._goals: dict[bytes, _Homing] = {}
        self._server = serve_goals(
            node,
            Home,
            name,
            start=self._start,
            conclude=self._conclude,
            cancel=self._cancel,
        )

    def _start(self, goal: Any) -> None:  # noqa: ANN401  # rclpy has no types here
        homing = _Homing()
        self._goals[bytes(goal.goal_id.uuid)] = homing
        # made and destroyed in the executor only: it may be about to run the timer
        homing.timer = self._node.create_timer(
            FEEDBACK_PERIOD, partial(self._publish_feedback, goal, homing)
        )

        def notify(progress: HomingProgress) -> None:
            homing.phase = progress.value

        def run() -> Promise[str]:
            self._node.admit()
            method = goal.request.method or None
            homing.task = self._commands.run('home', self._commands.home(method, notify))
            return homing.task

        def finished(future: Future[str]) -> None:
            self._output.post(partial(self._finish, goal, homing, future))

        self._thread.run(run).add_done_callback(finished)

    def _cancel(self, goal: Any) -> CancelResponse:  # noqa: ANN401
        homing = self._goals.get(bytes(goal.goal_id.uuid))

        def cancel() -> None:
            # only its own command; another one may run by now
            if homing is not None and homing.task is not None and not homing.task.done:
                self._commands.cancel('homing was cancelled')

        self._thread.call(cancel)
        return CancelResponse.ACCEPT

    def _publish_feedback(self, goal: Any, homing: _Homing) -> None:  # noqa: ANN401
        if homing.result is None and goal.is_active:
            elapsed = time.monotonic() - homing.begin
            goal.publish_feedback(
                Home.Feedback(phase=homing.phase, position=self._position(), elapsed=elapsed)
            )

    def _position(self) -> float:
        view = self._commands.axis.view
        return view.position if view.fresh else math.nan

    def _finish(self, goal: Any, homing: _Homing, future: Future[str]) -> None:  # noqa: ANN401
        error = future.exception()
        homing.result = Home.Result(
            success=error is None,
            message=future.result() if error is None else str(error),
            position=self._position(),
        )
        self._server.notify_execute(goal, None)  # leads to _conclude, in the executor

    def _conclude(self, goal: Any) -> Home.Result:  # noqa: ANN401
        homing = self._goals.pop(bytes(goal.goal_id.uuid))
        self._node.destroy_timer(homing.timer)
        result = homing.result
        if result.success:
            goal.succeed()
        elif goal.is_cancel_requested:
            goal.canceled()
        else:
            goal.abort()
        return result
