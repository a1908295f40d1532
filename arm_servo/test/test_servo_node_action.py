# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The action: a goal that nobody foresaw ends with a code, and the program goes on."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from servo_commands import SteppedWorker
from servo_drives import Drives

from arm_servo.core.motion_queue import MotionCommand
from arm_servo.ros.trajectory.action import TrajectoryAction
from arm_trajectory import GoalCode, GoalPoint, TrajectoryGoal


class Server:
    """What the action does with rclpy's server and its goals."""

    def __init__(self) -> None:
        self.concluded: list[Any] = []
        self.logged: list[str] = []

    def notify_execute(self, handle: object, _callback: object) -> None:
        """Note the end of a goal."""
        self.concluded.append(handle)

    def get_logger(self) -> Any:
        """Return what takes log messages."""
        return SimpleNamespace(error=self.logged.append, warning=self.logged.append)


def action(drives: Drives, follow: Any) -> tuple[TrajectoryAction, Server]:
    """Return the action without its ROS server."""
    server = Server()
    made: Any = object.__new__(TrajectoryAction)
    made._node, made._server, made._gateway, made._goals = server, server, drives.gateway, {}
    made._convert = lambda request: request.goal
    made._follow = follow
    return made, server


def handle(goal: object) -> Any:
    """Return the handle of a goal that was accepted."""
    return SimpleNamespace(
        goal_id=SimpleNamespace(uuid=bytes(16)),
        request=SimpleNamespace(goal=goal, trajectory=SimpleNamespace(points=[])),
        is_cancel_requested=False,
        publish_feedback=lambda _feedback: None,
        abort=lambda: None,
        succeed=lambda: None,
        canceled=lambda: None,
    )


def ready(worker: SteppedWorker | None = None) -> Drives:
    """Return drives that follow."""
    drives = Drives(worker=worker)
    drives.attach()
    drives.run(2)
    return drives


def test_an_unexpected_error_at_the_start_of_a_goal_is_its_result() -> None:
    """It does not leave the callback, where it would end the master and all drives with it."""
    drives = ready()

    def follow(_goal: TrajectoryGoal) -> MotionCommand:
        raise ZeroDivisionError('no such luck')

    made, server = action(drives, follow)
    goal = handle(None)
    made._start(goal)
    made._watch()
    assert server.concluded == [goal]
    result = made._conclude(goal)
    assert result.error_code == GoalCode.INVALID_GOAL
    assert 'ZeroDivisionError' in result.error_string
    assert server.logged


def test_an_unexpected_error_of_the_planning_is_its_result(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The next goal is planned as ever."""
    drives = ready()
    made, server = action(drives, drives.gateway.request)
    there = [axis.setpoint + 0.05 for axis in drives.axes]
    goal = TrajectoryGoal(drives.gateway.model.joints, [GoalPoint(2.0, there)])
    with monkeypatch.context() as patch:
        patch.setattr(drives.gateway._core, 'prepare', lambda *_: 1 // 0)
        bad = handle(goal)
        made._start(bad)
        drives.run(5)
        made._watch()
        assert server.concluded == [bad]
        assert made._conclude(bad).error_code == GoalCode.INVALID_GOAL
    good = handle(goal)
    made._start(good)
    drives.run(300)
    made._watch()
    assert made._conclude(good).error_code == GoalCode.SUCCESSFUL


def test_a_cancel_in_the_middle_of_the_planning_ends_the_goal() -> None:
    """As canceled, and nothing moves."""
    worker = SteppedWorker()
    drives = ready(worker)
    made, server = action(drives, drives.gateway.request)
    before = drives.path[-1].tolist()
    goal = handle(
        TrajectoryGoal(
            drives.gateway.model.joints,
            [GoalPoint(2.0, [axis.setpoint + 0.05 for axis in drives.axes])],
        )
    )
    made._start(goal)
    drives.run(1)
    goal.is_cancel_requested = True
    made._cancel(goal)
    worker.run()
    drives.run(20)
    made._watch()
    assert server.concluded == [goal]
    assert made._conclude(goal).error_code == GoalCode.SUCCESSFUL
    assert drives.path[-1].tolist() == before
