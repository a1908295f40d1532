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

from arm_msgs.action import Home
from canopen_core import DriveError
from node_runner.action_goals import Ending, GoalServer, ServedGoal

from ..cia402.commands import AxisCommands
from ..cia402.homing import HomingProgress
from ..master.runner import NetworkThread
from ..master.scheduler import Promise
from .output_thread import OutputThread

if TYPE_CHECKING:
    from .device_node import DeviceNode

FEEDBACK_PERIOD = 0.1  # [s]


@dataclass(slots=True, eq=False)
class _Homing(ServedGoal):
    """A goal from its request to its end."""

    stop_count: Future[int]  # at its request
    phase: str = HomingProgress.ENABLING.value
    begin: float = field(default_factory=time.monotonic)
    timer: Any = None
    task: Promise[str] | None = None
    result: Any = None


class HomeAction:
    """The action ``~/home`` of one axis: a goal ends when the network's thread has homed it."""

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
        self._server = GoalServer(
            node,
            Home,
            name,
            accept=lambda: _Homing(thread.call(lambda: commands.stop_count)),
            start=self._start,
            conclude=self._conclude,
            cancel=self._cancel,
            fail=self._fail,
        )

    def _start(self, homing: _Homing) -> None:
        # made and destroyed in the executor only: it may be about to run the timer
        homing.timer = self._node.create_timer(
            FEEDBACK_PERIOD, partial(self._publish_feedback, homing)
        )

        def notify(progress: HomingProgress) -> None:
            homing.phase = progress.value

        def run() -> Promise[str]:
            self._node.admit()
            if homing.stop_count.result() != self._commands.stop_count:
                raise DriveError(f'{self._commands.axis.name} was stopped before it was homed')
            method = homing.handle.request.method or None
            homing.task = self._commands.run('home', self._commands.home(method, notify))
            return homing.task

        def finished(future: Future[str]) -> None:
            self._output.post(partial(self._finish, homing, future))

        self._thread.run(run).add_done_callback(finished)

    def _cancel(self, homing: _Homing) -> None:
        def cancel() -> None:
            # only its own command; another one may run by now
            if homing.task is not None and not homing.task.done:
                self._commands.cancel('homing was cancelled')

        self._thread.call(cancel)

    def _publish_feedback(self, homing: _Homing) -> None:
        if not homing.has_ended:
            elapsed = time.monotonic() - homing.begin
            homing.handle.publish_feedback(
                Home.Feedback(phase=homing.phase, position=self._position(), elapsed=elapsed)
            )

    def _position(self) -> float:
        view = self._commands.axis.view
        return view.position if view.fresh else math.nan

    def _finish(self, homing: _Homing, future: Future[str]) -> None:
        error = future.exception()
        homing.result = Home.Result(
            success=error is None,
            message=future.result() if error is None else str(error),
            position=self._position(),
        )
        self._server.end(homing)

    def _conclude(self, homing: _Homing) -> tuple[Ending, Home.Result]:
        self._node.destroy_timer(homing.timer)
        ending = Ending.SUCCEEDED if homing.result.success else Ending.CANCELED
        return ending, homing.result

    def _fail(self, homing: _Homing, error: Exception) -> Home.Result:
        if homing.timer is not None:
            self._node.destroy_timer(homing.timer)
        message = f'{type(error).__name__}: {error}'
        return Home.Result(success=False, message=message, position=math.nan)
