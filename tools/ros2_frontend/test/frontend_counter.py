# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""An action server for the command-line tests; prints `ready` when up.

The method decides the fate of a goal: below 0 it is rejected, 0 is aborted, 100 and above counts
until it is cancelled, and what is between is counted to.
"""

from __future__ import annotations

import contextlib
from typing import Any

import rclpy
from rclpy.action.server import ActionServer, CancelResponse, GoalResponse
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.task import Future

from arm_msgs.action import Home

ENDLESS = 100


class Counter(Node):
    """Offers the action `/count`."""

    def __init__(self) -> None:
        super().__init__('counter')
        self._ticks: list[Future] = []
        self.create_timer(0.01, self._tick)
        self._server = ActionServer(  # type: ignore[no-untyped-call]
            self,
            Home,
            'count',
            self._count,
            goal_callback=self._judge,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
        )

    def _judge(self, goal: Any) -> GoalResponse:
        return GoalResponse.REJECT if goal.method < 0 else GoalResponse.ACCEPT

    async def _count(self, handle: Any) -> Any:
        order, step = handle.request.method, 0
        while step < order or order >= ENDLESS:
            if handle.is_cancel_requested:
                print('cancelled', flush=True)
                handle.canceled()
                return Home.Result()
            tick = Future()  # type: ignore[no-untyped-call]
            self._ticks.append(tick)
            await tick
            step += 1
            handle.publish_feedback(Home.Feedback(elapsed=float(step)))
        if order:
            handle.succeed()
        else:
            handle.abort()
        return Home.Result(message=f'counted to {order}')

    def _tick(self) -> None:
        ticks, self._ticks = self._ticks, []
        for tick in ticks:
            tick.set_result(None)  # type: ignore[no-untyped-call]


def main() -> None:
    """Serve until the process is ended."""
    rclpy.init()
    executor = SingleThreadedExecutor()
    executor.add_node(Counter())
    print('ready', flush=True)
    with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
        executor.spin()


if __name__ == '__main__':
    main()
